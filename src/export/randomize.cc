#include "src/export/randomize.h"

#include <mujoco/mjxmacro.h>
#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>
#include <set>
#include <string_view>
#include <type_traits>

#include "src/core/collect.h"
#include "src/core/dense.h"
#include "src/core/statistics.h"
#include "src/export/drive_laws.h"
#include "src/fit/covariance.h"

namespace gapscope {

template <>
std::span<const EnumName<DrawsFrom>> EnumNames<DrawsFrom>() {
  static constexpr EnumName<DrawsFrom> kNames[] = {{DrawsFrom::kCovariance, "covariance"},
                                                   {DrawsFrom::kInterval, "interval"},
                                                   {DrawsFrom::kLogs, "logs"},
                                                   {DrawsFrom::kFits, "fits"}};
  return kNames;
}

namespace {

// An array of a compiled model.
struct Array {
  std::string_view name;  // a literal
  std::size_t rows = 0, columns = 0;
  std::span<const mjtNum> numbers;
};

std::vector<Array> ArraysOf(const mjModel& model, std::span<const mjtNum> delay_steps, std::span<const mjtNum> laws) {
  std::vector<Array> arrays = {{"opt.gravity", 1, 3, model.opt.gravity}};
  if (!delay_steps.empty()) arrays.push_back({kDelaySteps, delay_steps.size(), 1, delay_steps});
  if (!laws.empty()) arrays.push_back({kLaws, laws.size(), 1, laws});
  const auto add = [&]<class T>(const char* name, const T* data, mjtSize rows, mjtSize columns) {
    if constexpr (std::is_same_v<T, mjtNum>) {
      if (rows > 0 && columns > 0)
        arrays.push_back({name,
                          static_cast<std::size_t>(rows),
                          static_cast<std::size_t>(columns),
                          {data, static_cast<std::size_t>(rows * columns)}});
    }
  };
  const mjModel* m = &model;
  MJMODEL_POINTERS_PREAMBLE(m)
  (void)nuser_body, (void)nuser_jnt, (void)nuser_geom, (void)nuser_site, (void)nuser_cam, (void)nuser_tendon;
  (void)nuser_actuator, (void)nuser_sensor, (void)nq, (void)nv, (void)na, (void)nu, (void)nmocap, (void)nplastic;
#define X(type, name, nr, nc) add(#name, m->name, m->nr, nc);
  MJMODEL_POINTERS
#undef X
  return arrays;
}

// Made of other numbers by the compiler.
bool FollowsFromOthers(std::string_view field) {
  static const std::set<std::string_view> kFollow = {
      "body_subtreemass", "body_invweight0",      "dof_invweight0",    "dof_M0",
      "dof_length",       "tendon_length0",       "tendon_invweight0", "actuator_acc0",
      "actuator_length0", "actuator_lengthrange", "cam_poscom0",       "cam_pos0",
      "cam_mat0",         "light_poscom0",        "light_pos0",        "light_dir0"};
  return kFollow.contains(field);
}

Status CheckSame(const std::vector<Array>& base, const std::vector<Array>& other, const std::string& where) {
  const bool same = std::ranges::equal(base, other, [](const Array& a, const Array& b) {
    return a.name == b.name && a.rows == b.rows && a.columns == b.columns;
  });
  if (same) return Ok();
  return Error{.what = "within what the logs allow the MJCF changes its elements",
               .where = where,
               .cure = "freeze the parameter that does it, or export to an engine that has its effect"};
}

// A result does not keep the rig's size, by which an effect's bounds are scaled: of those on torques zero alone is
// known, and a bound that the value itself breaks is none.
double Moved(const UncertainParameter& uncertain, const Parameter& p, double value, double by) {
  const auto holds = [&](double bound) {
    return p.owner != Parameter::Owner::kEffect || bound == 0 || !(p.of_torque || value < p.low || value > p.high);
  };
  return std::clamp(uncertain.logarithmic ? value * std::exp(by) : value + by, holds(p.low) ? p.low : -kInfinity,
                    holds(p.high) ? p.high : kInfinity);
}

// A parameter's deviation; where it goes together with others, that with the others as they are.
double DeviationOf(const UncertainParameters& uncertain, Eigen::Index i) {
  const Eigen::MatrixXd& c = uncertain.covariance;
  if (!uncertain.parameters[static_cast<std::size_t>(i)].together) return std::sqrt(std::max(0.0, c(i, i)));
  const double precision = Ldlt(c).Solve(Eigen::VectorXd(Eigen::VectorXd::Unit(c.rows(), i)))[i];
  return precision > 0 ? std::sqrt(1 / precision) : 0;
}

// A compiled model and its arrays.
struct Compiled {
  ModelPtr model;
  std::vector<mjtNum> delay_steps, laws;
  std::vector<Array> arrays;
};
Result<Compiled> CompileWith(const MakeExport& make, std::span<const double> values) {
  GS_ASSIGN(ExportedModel exported, make(values));
  Compiled compiled{.model = std::move(exported.compiled)};
  for (const auto& [drive, steps] : exported.delay_steps) compiled.delay_steps.push_back(steps);
  compiled.laws = Collect(LawArguments(exported), &LawArgument::value);
  compiled.arrays = ArraysOf(*compiled.model, compiled.delay_steps, compiled.laws);
  return compiled;
}

// The model at changed values; it and `make` must outlive them.
class Exporter {
 public:
  Exporter(const Model& model, std::span<const double> values, const MakeExport& make, Compiled base)
      : model_(model), values_(values), make_(make), base_(std::move(base)), varies_(base_.arrays.size(), false) {}

  const std::vector<Array>& arrays() const { return base_.arrays; }

  // With these values.
  Result<Compiled> At(std::span<const double> values) const {
    GS_ASSIGN(Compiled there, CompileWith(make_, values));
    GS_RETURN_IF_ERROR(CheckSame(base_.arrays, there.arrays, model_.experiment().path));
    return there;
  }

  // Whether an array varies over the ranges that were asked for.
  bool Varies(std::size_t array) const { return varies_[array]; }

  Result<ParameterRange> RangeOf(const UncertainParameter& uncertain, double deviation) {
    const auto k = static_cast<std::size_t>(uncertain.index);
    const Parameter& p = model_.parameters()[k];
    ParameterRange range{.name = p.name, .unit = p.unit, .value = values_[k], .conditional = uncertain.together};
    const double a = Moved(uncertain, p, values_[k], -kNormalQuantile * deviation),
                 b = Moved(uncertain, p, values_[k], kNormalQuantile * deviation);
    range.low = std::min(a, b), range.high = std::max(a, b);
    std::vector<double> values(values_.begin(), values_.end());
    values[k] = range.low;
    GS_ASSIGN(const Compiled low, At(values));
    values[k] = range.high;
    GS_ASSIGN(const Compiled high, At(values));
    for (std::size_t f = 0; f < arrays().size(); ++f) {
      if (std::ranges::equal(low.arrays[f].numbers, high.arrays[f].numbers)) continue;
      varies_[f] = true;
      if (!FollowsFromOthers(arrays()[f].name)) AddNumbers(arrays()[f], low.arrays[f], high.arrays[f], &range);
    }
    return range;
  }

 private:
  static void AddNumbers(const Array& base, const Array& low, const Array& high, ParameterRange* range) {
    for (std::size_t i = 0; i < base.numbers.size(); ++i) {
      if (low.numbers[i] == high.numbers[i]) continue;
      range->numbers.push_back({.field = std::string(base.name),
                                .row = i / base.columns,
                                .column = i % base.columns,
                                .value = base.numbers[i],
                                .low = std::min(low.numbers[i], high.numbers[i]),
                                .high = std::max(low.numbers[i], high.numbers[i])});
    }
  }

  const Model& model_;
  std::span<const double> values_;
  const MakeExport& make_;
  Compiled base_;
  std::vector<bool> varies_;
};

// How far off its best value each parameter is, draw by draw.
class Moves {
 public:
  Moves(const UncertainParameters& uncertain, std::uint64_t seed) : uncertain_(uncertain), random_(seed + 1) {
    const SymmetricEigen eigen(uncertain.covariance);
    root_ = eigen.vectors * eigen.values.cwiseMax(0.0).cwiseSqrt().asDiagonal();
  }

  Eigen::VectorXd Next() {
    if (uncertain_.from == DrawsFrom::kFits) return uncertain_.fits.col(drawn_++ % uncertain_.fits.cols());
    Eigen::VectorXd by =
        root_ * Eigen::VectorXd::NullaryExpr(root_.cols(), [&](Eigen::Index) { return normal_(random_); });
    if (uncertain_.from != DrawsFrom::kInterval) return by;
    for (Eigen::Index i = 0; i < by.size(); ++i) {
      const double deviation = std::sqrt(uncertain_.covariance(i, i));
      if (deviation > 0) by[i] = kNormalQuantile * deviation * std::erf(by[i] / (std::numbers::sqrt2 * deviation));
    }
    return by;
  }

 private:
  const UncertainParameters& uncertain_;
  Eigen::MatrixXd root_;
  std::mt19937_64 random_;
  std::normal_distribution<double> normal_;
  Eigen::Index drawn_ = 0;
};

// Where a field's draws go.
DrawnField FieldOf(const Array& base, std::size_t draws) {
  DrawnField field{.name = std::string(base.name), .shape = {draws}, .values = {}};
  if (!base.name.starts_with("opt.")) field.shape.push_back(base.rows);
  if (base.columns > 1) field.shape.push_back(base.columns);
  field.values.reserve(draws * base.numbers.size());
  return field;
}

}  // namespace

Result<Randomization> Randomize(const Model& model, std::span<const double> values,
                                const UncertainParameters& uncertain, const MakeExport& make, std::size_t draws,
                                std::uint64_t seed) {
  GS_ASSIGN(Compiled base, CompileWith(make, values));
  Exporter exporter(model, values, make, std::move(base));
  Randomization result;
  const auto n = static_cast<Eigen::Index>(uncertain.parameters.size());
  for (Eigen::Index i = 0; i < n; ++i) {
    GS_ASSIGN(ParameterRange range,
              exporter.RangeOf(uncertain.parameters[static_cast<std::size_t>(i)], DeviationOf(uncertain, i)));
    result.ranges.push_back(std::move(range));
  }
  Moves moves(uncertain, seed);
  std::vector<std::size_t> varying;
  for (std::size_t f = 0; f < exporter.arrays().size(); ++f) {
    if (!exporter.Varies(f)) continue;
    varying.push_back(f);
    result.fields.push_back(FieldOf(exporter.arrays()[f], draws));
  }
  for (std::size_t d = 0; d < draws; ++d) {
    const Eigen::VectorXd by = moves.Next();
    std::vector<double> at(values.begin(), values.end());
    for (Eigen::Index i = 0; i < n; ++i) {
      const UncertainParameter& p = uncertain.parameters[static_cast<std::size_t>(i)];
      const auto k = static_cast<std::size_t>(p.index);
      at[k] = Moved(p, model.parameters()[k], values[k], by[i]);
      result.drawn.push_back(at[k]);
    }
    GS_ASSIGN(const Compiled there, exporter.At(at));
    for (std::size_t f = 0; f < varying.size(); ++f) {
      const auto numbers = there.arrays[varying[f]].numbers;
      result.fields[f].values.insert(result.fields[f].values.end(), numbers.begin(), numbers.end());
    }
  }
  return result;
}

const DrawnField* FieldOf(const Randomization& randomization, const std::string& name) {
  const auto found = std::ranges::find(randomization.fields, name, &DrawnField::name);
  return found == randomization.fields.end() ? nullptr : &*found;
}

bool MayBeDrawnAlone(const ParameterRange& range, const std::vector<ParameterRange>& all) {
  if (range.conditional || range.numbers.size() != 1) return false;
  const VaryingNumber& mine = range.numbers.front();
  return std::ranges::none_of(all, [&](const ParameterRange& other) {
    return &other != &range && std::ranges::any_of(other.numbers, [&](const VaryingNumber& number) {
      return number.field == mine.field && number.row == mine.row && number.column == mine.column;
    });
  });
}

DelayRange RangeOfDelay(const Randomization& randomization, std::size_t drive, double nominal) {
  for (const ParameterRange& range : randomization.ranges) {
    if (!MayBeDrawnAlone(range, randomization.ranges)) continue;
    const VaryingNumber& number = range.numbers.front();
    if (number.field == kDelaySteps && number.row == drive) return {number.low, number.high};
  }
  return {nominal, nominal};
}

}  // namespace gapscope
