#include "src/design/sensitivity.h"

#include <algorithm>
#include <cmath>
#include <limits>

namespace gapscope {

double Hypothesis::ToSearch(std::size_t i, double value) const {
  const Free& f = free[i];
  return f.logarithmic ? std::log(value) : value;
}

double Hypothesis::ToValue(std::size_t i, double search) const {
  const Free& f = free[i];
  const double bounded = std::clamp(search, f.low, f.high);
  return f.logarithmic ? std::exp(bounded) : bounded;
}

Hypothesis MakeHypothesis(std::string name, std::shared_ptr<const Model> model, std::vector<double> values) {
  Hypothesis hypothesis{.name = std::move(name), .model = std::move(model), .values = std::move(values), .free = {}};
  const auto& parameters = hypothesis.model->parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    if (p.frozen || !(p.high > p.low)) continue;
    const bool of_effect = p.owner != Parameter::Owner::kBase, logarithmic = p.low > 0;
    Hypothesis::Free free{.parameter = static_cast<int>(i), .logarithmic = logarithmic};
    free.low = logarithmic ? std::log(p.low) : p.low;
    free.high = logarithmic ? std::log(p.high) : p.high;
    free.step = logarithmic ? 0.05 : 0.01 * (free.high - free.low);
    if (!of_effect) free.prior = logarithmic ? kNominalShare : 0.25 * (free.high - free.low);
    hypothesis.free.push_back(free);
  }
  return hypothesis;
}

double FloorOf(const MeasuredSpec& spec, const std::vector<double>& values) {
  constexpr double kPosition = 5e-4, kSpeed = 0.02, kTorqueShare = 0.01;
  const double quantisation = spec.resolution * spec.resolution / 12;
  switch (spec.kind) {
    case SignalKind::kPosition:
      return std::sqrt(kPosition * kPosition + quantisation);
    case SignalKind::kVelocity:
      return std::sqrt(kSpeed * kSpeed + quantisation);
    case SignalKind::kTorque:
      break;
  }
  double largest = 0;
  for (const double value : values) {
    if (std::isfinite(value)) largest = std::max(largest, std::abs(value));
  }
  return std::sqrt(std::pow(std::max(kTorqueShare * largest, 1e-9), 2) + quantisation);
}

std::vector<double> FloorsOf(const Recording& predicted) {
  std::vector<double> floors;
  for (const auto& measured : predicted.measured) floors.push_back(FloorOf(measured.spec, measured.values));
  return floors;
}

Predictor::Predictor(const Hypothesis& hypothesis, double time_step_s)
    : hypothesis_(hypothesis), simulator_(*hypothesis.model, time_step_s) {}

Eigen::VectorXd Predictor::Predict(const Recording& input, const std::vector<double>& values, double shift_s,
                                   const std::vector<double>& floors) {
  const mjModel& m = hypothesis_.model->compiled();
  InitialState rest;
  rest.qpos.assign(m.qpos0, m.qpos0 + m.nq);
  rest.qvel.assign(m.nv, 0.0);
  const std::size_t signals = input.measured.size(), rows = input.rows();
  buffer_.resize(rows * signals);
  simulator_.set_shift_s(shift_s);
  if (!simulator_.SetParameters(values, input) ||
      simulator_.Run(input, {0, rows}, rest, buffer_).outcome != Outcome::kCompleted)
    return {};
  std::size_t scored = 0;
  for (const auto& measured : input.measured) scored += measured.spec.scored ? 1 : 0;
  Eigen::VectorXd out(static_cast<Eigen::Index>(rows * scored));
  Eigen::Index at = 0;
  for (std::size_t s = 0; s < signals; ++s) {
    if (!input.measured[s].spec.scored) continue;
    for (std::size_t r = 0; r < rows; ++r) out[at++] = buffer_[r * signals + s] / floors[s];
  }
  return out.allFinite() ? out : Eigen::VectorXd();
}

Eigen::MatrixXd Predictor::Jacobian(const Recording& input, const std::vector<double>& values, double shift_s,
                                    const std::vector<double>& floors, const Eigen::VectorXd& at) {
  std::vector<std::size_t> positions;  // block of each scored position signal
  std::size_t scored = 0;
  for (const auto& measured : input.measured) {
    if (!measured.spec.scored) continue;
    if (measured.spec.kind == SignalKind::kPosition) positions.push_back(scored);
    ++scored;
  }
  const Eigen::Index rows = static_cast<Eigen::Index>(input.rows()),
                     parameters = static_cast<Eigen::Index>(hypothesis_.free.size());
  Eigen::MatrixXd jacobian =
      Eigen::MatrixXd::Zero(at.size(), parameters + 1 + static_cast<Eigen::Index>(positions.size()));
  std::vector<double> moved(values);
  for (Eigen::Index i = 0; i < parameters; ++i) {
    const auto& free = hypothesis_.free[static_cast<std::size_t>(i)];
    const double x = hypothesis_.ToSearch(static_cast<std::size_t>(i), values[free.parameter]);
    const double step = x + free.step <= free.high ? free.step : -free.step;
    moved[free.parameter] = hypothesis_.ToValue(static_cast<std::size_t>(i), x + step);
    const Eigen::VectorXd out = Predict(input, moved, shift_s, floors);
    moved[free.parameter] = values[free.parameter];
    if (out.size() != at.size()) return {};
    jacobian.col(i) = (out - at) / step;
  }
  const double half_sample = 0.5 * input.timeline.median_step_s;
  const Eigen::VectorXd late = Predict(input, values, shift_s + half_sample, floors);
  if (late.size() != at.size()) return {};
  jacobian.col(parameters) = late - at;
  std::size_t column = 0;
  std::vector<double> scored_floors;
  for (std::size_t s = 0; s < input.measured.size(); ++s) {
    if (input.measured[s].spec.scored) scored_floors.push_back(floors[s]);
  }
  for (const std::size_t block : positions) {
    jacobian.col(parameters + 1 + static_cast<Eigen::Index>(column++))
        .segment(static_cast<Eigen::Index>(block) * rows, rows)
        .setConstant(1 / scored_floors[block]);
  }
  return jacobian;
}

}  // namespace gapscope
