// Search coordinates of a fit: logarithms, scales, and pairs of parameters that act linearly together.
#include <algorithm>
#include <cmath>

#include "src/tune/fit_problem_parts.h"

namespace gapscope {

double Coordinate::ToSearch(double value) const {
  return logarithmic ? std::log(std::max(scale * value, 1e-300)) : value / scale;
}
double Coordinate::ToValue(double search) const { return logarithmic ? scale * std::exp(search) : search * scale; }

void FitProblem::CoupleTerms() {
  for (std::size_t i = 0; i < coordinates_.size(); ++i) {
    const Parameter& p = model_.parameters()[coordinates_[i].parameter];
    const auto size = std::find_if(coordinates_.begin(), coordinates_.end(), [&](const Coordinate& c) {
      return model_.parameters()[c.parameter].name == p.size;
    });
    if (p.with == Parameter::With::kNone || size == coordinates_.end() || size->logarithmic ||
        coordinates_[i].logarithmic)
      continue;
    const Couple couple{.size = size - coordinates_.begin(), .other = static_cast<Eigen::Index>(i), .with = p.with};
    Coordinate& other = coordinates_[i];
    if (p.with == Parameter::With::kAngle) {
      other.scale = size->scale;
      size->low = -size->high;
      other.low = size->low, other.high = size->high;
    } else {
      const double most = size->high * std::max(-other.low, other.high);
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

void FitProblem::SetCouple(const Couple& couple, double size, double other, std::vector<double>* values) const {
  const Coordinate &a = coordinates_[static_cast<std::size_t>(couple.size)],
                   &b = coordinates_[static_cast<std::size_t>(couple.other)];
  const Parameter& p = model_.parameters()[b.parameter];
  size *= a.scale, other *= b.scale;
  if (couple.with == Parameter::With::kAngle) {
    (*values)[a.parameter] = std::min(std::hypot(size, other), model_.parameters()[a.parameter].high);
    (*values)[b.parameter] = std::atan2(other, size);
  } else {
    (*values)[a.parameter] = size;
    (*values)[b.parameter] = other == 0 ? 0 : std::clamp(other / size, p.low, p.high);
  }
}

void FitProblem::SetCoordinate(const Eigen::VectorXd& y, Eigen::Index i, double moved,
                               std::vector<double>* values) const {
  const Coordinate& c = coordinates_[static_cast<std::size_t>(i)];
  (*values)[c.parameter] = c.ToValue(moved);
  for (const Couple& couple : couples_) {
    if (couple.size == i || couple.other == i)
      SetCouple(couple, couple.size == i ? moved : y[couple.size], couple.other == i ? moved : y[couple.other], values);
  }
}

Eigen::VectorXd FitProblem::ToSearch(const std::vector<double>& values) const {
  const auto n = static_cast<Eigen::Index>(coordinates_.size());
  Eigen::VectorXd y(n);
  for (Eigen::Index k = 0; k < n; ++k) {
    const Coordinate& c = coordinates_[static_cast<std::size_t>(k)];
    y[k] = c.ToSearch(values[c.parameter]);
  }
  for (const Couple& couple : couples_) {
    const Coordinate &a = coordinates_[static_cast<std::size_t>(couple.size)],
                     &b = coordinates_[static_cast<std::size_t>(couple.other)];
    const double size = values[a.parameter], other = values[b.parameter];
    const bool angle = couple.with == Parameter::With::kAngle;
    y[couple.size] = (angle ? size * std::cos(other) : size) / a.scale;
    y[couple.other] = (angle ? size * std::sin(other) : size * other) / b.scale;
  }
  return y.cwiseMax(low_.head(n)).cwiseMin(high_.head(n));
}

}  // namespace gapscope
