#include "src/fit/search_space.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/fit/policy.h"

namespace gapscope {
namespace {

Coordinate MakeCoordinate(const Parameter& p, int index, double value, bool logarithmic_effects) {
  Coordinate c{.parameter = index, .logarithmic = p.low > 0};
  c.scale =
      c.logarithmic ? 1 : std::max({std::abs(p.nominal), 0.05 * (p.high - p.low), std::numeric_limits<double>::min()});
  c.low = c.ToSearch(p.low);
  c.high = c.ToSearch(p.high);
  // A cubic is often next to nothing, where a logarithm is flat and its interval reaches to the upper bound.
  const bool of_size = p.of_torque && p.with != Parameter::With::kCubic;
  if (logarithmic_effects && !c.logarithmic && value != 0 && of_size) {
    c.logarithmic = true;
    c.scale = value > 0 ? 1 : -1;
    c.low = c.ToSearch(kFitPolicy.least_size_share * value);
    c.high = c.ToSearch(value > 0 ? p.high : p.low);
  }
  // A start beyond the bounds was asked for: they grow to hold it.
  if (!c.logarithmic || c.scale * value > 0) {
    c.low = std::min(c.low, c.ToSearch(value));
    c.high = std::max(c.high, c.ToSearch(value));
  }
  return c;
}

}  // namespace

double Coordinate::ToSearch(double value) const {
  return logarithmic ? std::log(std::max(scale * value, 1e-300)) : value / scale;
}
double Coordinate::ToValue(double search) const { return logarithmic ? scale * std::exp(search) : search * scale; }

SearchSpace::SearchSpace(const std::vector<Parameter>& parameters, const std::vector<int>& free,
                         std::vector<double> values, bool logarithmic_effects, bool linear_terms)
    : parameters_(parameters), values_(std::move(values)), low_(free.size()), high_(free.size()) {
  for (std::size_t i = 0; i < free.size(); ++i) {
    const auto index = static_cast<std::size_t>(free[i]);
    coordinates_.push_back(MakeCoordinate(parameters[index], free[i], values_[index], logarithmic_effects));
    low_[static_cast<Eigen::Index>(i)] = coordinates_.back().low;
    high_[static_cast<Eigen::Index>(i)] = coordinates_.back().high;
  }
  if (linear_terms) CoupleTerms();
}

void SearchSpace::CoupleTerms() {
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const Parameter& p = parameter(coordinates_[i]);
    const auto size = std::find_if(coordinates_.begin(), coordinates_.end(),
                                   [&](const Coordinate& c) { return parameter(c).name == p.size; });
    const bool couples = p.with == Parameter::With::kAngle || p.with == Parameter::With::kRest;
    if (!couples || size == coordinates_.end() || size->logarithmic || coordinates_[i].logarithmic) continue;
    Couple couple{.size = size - coordinates_.begin(), .other = static_cast<Eigen::Index>(i), .with = p.with};
    Coordinate& other = coordinates_[i];
    if (p.with == Parameter::With::kAngle) {
      other.scale = size->scale;
      size->low = -size->high;
      other.low = size->low, other.high = size->high;
    } else {
      FindCubic(&couple);
      const double sizes = couple.cubic_place >= 0 ? 2 : 1;  // the cubic's stiffness at its bound is the size's at its
      const double most = sizes * size->high * std::max(-other.low, other.high);
      other.scale *= size->scale;
      other.low = -most, other.high = most;
    }
    for (const Eigen::Index k : {couple.size, couple.other}) {
      low_[k] = coordinates_[static_cast<std::size_t>(k)].low;
      high_[k] = coordinates_[static_cast<std::size_t>(k)].high;
    }
    couples_.push_back(couple);
  }
}

void SearchSpace::FindCubic(Couple* couple) const {
  const std::string& size = parameter(coordinates_[static_cast<std::size_t>(couple->size)]).name;
  const auto found = std::find_if(parameters_.begin(), parameters_.end(), [&](const Parameter& p) {
    return p.with == Parameter::With::kCubic && p.size == size;
  });
  if (found == parameters_.end()) return;
  couple->cubic = static_cast<int>(found - parameters_.begin());
  const auto place = std::find_if(coordinates_.begin(), coordinates_.end(),
                                  [&](const Coordinate& c) { return c.parameter == couple->cubic; });
  if (place != coordinates_.end()) couple->cubic_place = place - coordinates_.begin();
}

double SearchSpace::Stiffness(const Couple& couple, const std::vector<double>& values) const {
  const Coordinate& size = coordinates_[static_cast<std::size_t>(couple.size)];
  const double linear = values[size.parameter];
  if (couple.cubic < 0) return linear;
  return linear + values[couple.cubic] * parameter(size).high / parameters_[couple.cubic].high;
}

void SearchSpace::SetCouple(const Couple& couple, double size, double other, std::vector<double>* values) const {
  const Coordinate &a = coordinates_[static_cast<std::size_t>(couple.size)],
                   &b = coordinates_[static_cast<std::size_t>(couple.other)];
  const Parameter& p = parameter(b);
  size *= a.scale, other *= b.scale;
  if (couple.with == Parameter::With::kAngle) {
    (*values)[a.parameter] = std::min(std::hypot(size, other), parameter(a).high);
    (*values)[b.parameter] = std::atan2(other, size);
  } else {
    (*values)[a.parameter] = size;
    (*values)[b.parameter] = other == 0 ? 0 : std::clamp(other / Stiffness(couple, *values), p.low, p.high);
  }
}

std::vector<double> SearchSpace::Values(const Eigen::VectorXd& y) const {
  std::vector<double> values = values_;
  for (std::size_t i = 0; i < coordinates_.size(); ++i)
    values[coordinates_[i].parameter] = coordinates_[i].ToValue(y[static_cast<Eigen::Index>(i)]);
  for (const Couple& couple : couples_) SetCouple(couple, y[couple.size], y[couple.other], &values);
  return values;
}

void SearchSpace::SetCoordinate(const Eigen::VectorXd& y, Eigen::Index i, double moved,
                                std::vector<double>* values) const {
  const Coordinate& c = coordinates_[static_cast<std::size_t>(i)];
  (*values)[c.parameter] = c.ToValue(moved);
  for (const Couple& couple : couples_) {
    if (couple.size == i || couple.other == i || couple.cubic_place == i)
      SetCouple(couple, couple.size == i ? moved : y[couple.size], couple.other == i ? moved : y[couple.other], values);
  }
}

Eigen::VectorXd SearchSpace::ToSearch(const std::vector<double>& values) const {
  Eigen::VectorXd y(size());
  for (Eigen::Index k = 0; k < size(); ++k) {
    const Coordinate& c = coordinates_[static_cast<std::size_t>(k)];
    y[k] = c.ToSearch(values[c.parameter]);
  }
  for (const Couple& couple : couples_) {
    const Coordinate &a = coordinates_[static_cast<std::size_t>(couple.size)],
                     &b = coordinates_[static_cast<std::size_t>(couple.other)];
    const double size = values[a.parameter], other = values[b.parameter];
    const bool angle = couple.with == Parameter::With::kAngle;
    y[couple.size] = (angle ? size * std::cos(other) : size) / a.scale;
    y[couple.other] = (angle ? size * std::sin(other) : Stiffness(couple, values) * other) / b.scale;
  }
  return y.cwiseMax(low_).cwiseMin(high_);
}

}  // namespace gapscope
