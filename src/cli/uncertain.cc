#include "src/cli/uncertain.h"

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/report/read_run.h"

namespace gapscope::cli {
namespace {

// Few logs make two parameters look as if they went together exactly: so much of each covariance is taken for chance.
constexpr double kChance = 0.1;

UncertainParameter ParameterAt(const Model& model, const TuneRun& run, std::size_t i) {
  const std::string& name = run.parameters[i].name;
  return {.index = model.IndexOf(name),
          .logarithmic = run.spread.logarithmic[i],
          .together = std::ranges::any_of(run.correlated, [&](const auto& p) { return p.a == name || p.b == name; })};
}

// By the parameters' intervals: what the logs leave open together.
void TakeCovariance(const Model& model, const TuneRun& run, Uncertain* uncertain) {
  std::vector<Eigen::Index> known;
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    if (!run.parameters[i].identifiable) continue;
    known.push_back(static_cast<Eigen::Index>(i));
    uncertain->parameters.parameters.push_back(ParameterAt(model, run, i));
  }
  uncertain->parameters.covariance = run.spread.covariance(known, known);
}

// What each log alone says of a parameter, in the coordinate that it is fitted in; empty: some log does not know it.
std::vector<double> OfEachLog(const TuneRun& run, const std::string& name, bool logarithmic) {
  std::vector<double> found;
  for (const auto& fit : run.per_log) {
    const auto p = std::ranges::find(fit.parameters, name, &TuneRun::Parameter::name);
    if (p == fit.parameters.end() || !p->identifiable || (logarithmic && p->value == 0)) return {};
    found.push_back(logarithmic ? std::log(std::abs(p->value)) : p->value);
  }
  return found;
}

// By the fits to each log alone: how the logs differ.
void TakeLogs(const Model& model, const TuneRun& run, Uncertain* uncertain) {
  std::vector<Eigen::VectorXd> deviations;  // of a parameter, by log
  for (std::size_t i = 0; i < run.parameters.size(); ++i) {
    if (!run.parameters[i].identifiable) continue;
    const UncertainParameter p = ParameterAt(model, run, i);
    const std::vector<double> found = OfEachLog(run, run.parameters[i].name, p.logarithmic);
    if (found.empty()) {
      uncertain->not_of_each.push_back(run.parameters[i].name);
      continue;
    }
    const Eigen::VectorXd values = Eigen::VectorXd::Map(found.data(), static_cast<Eigen::Index>(found.size()));
    deviations.emplace_back(values.array() - values.mean());
    double& centre = uncertain->values[static_cast<std::size_t>(p.index)];
    centre = p.logarithmic ? std::copysign(std::exp(values.mean()), centre) : values.mean();
    uncertain->parameters.parameters.push_back(p);
  }
  const auto n = static_cast<Eigen::Index>(deviations.size());
  const double freedom = static_cast<double>(run.per_log.size()) - 1;
  uncertain->parameters.covariance = Eigen::MatrixXd::NullaryExpr(n, n, [&](Eigen::Index a, Eigen::Index b) {
    const double covariance =
        deviations[static_cast<std::size_t>(a)].dot(deviations[static_cast<std::size_t>(b)]) / freedom;
    return a == b ? covariance : (1 - kChance) * covariance;
  });
  uncertain->logs = run.per_log.size();
}

}  // namespace

Result<Uncertain> UncertainOf(const Model& model, const std::vector<double>& values, const nlohmann::ordered_json& json,
                              const std::string& where) {
  constexpr char kCure[] = "run `gapscope tune` (--from DIR takes over what a diagnosis found), and export its result";
  if (json.value("schema", "") != kTuneSchema)
    return Error{.what = "only a result of tune says how its parameters vary together", .where = where, .cure = kCure};
  GS_ASSIGN(const TuneRun run, ReadTuneRun(json, where));
  if (run.spread.logarithmic.size() != run.parameters.size())
    return Error{.what = "a result of an earlier version, without its covariance", .where = where, .cure = kCure};
  Uncertain uncertain;
  uncertain.values = values;
  if (run.per_log.size() >= kEnoughLogs) {
    TakeLogs(model, run, &uncertain);
  } else {
    TakeCovariance(model, run, &uncertain);
  }
  if (uncertain.parameters.parameters.empty())
    return Error{.what = "the logs know none of the parameters: there is nothing to draw",
                 .where = where,
                 .cure = "tune with more logs, or with --freeze NAME for what goes together"};
  return uncertain;
}

}  // namespace gapscope::cli
