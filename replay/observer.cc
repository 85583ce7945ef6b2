#include "replay/observer.h"

#include <cmath>

#include "src/core/dense.h"

namespace gapscope {

Observer::Observer(ObserverSpec spec)
    : spec_(std::move(spec)),
      left_inverse_(PseudoInverse(spec_.c)),
      state_(Eigen::VectorXd::Zero(spec_.a.rows())),
      next_(state_),
      wanted_(state_),
      readings_(spec_.c.rows()),
      references_(spec_.c.rows()) {}

void Observer::Discretise(double period_s) {
  if (std::abs(period_s - period_s_) <= 1e-9 * period_s_) return;
  const Eigen::Index n = spec_.a.rows(), m = spec_.c.rows();
  Eigen::MatrixXd augmented = Eigen::MatrixXd::Zero(n + 1 + m, n + 1 + m);
  augmented.topLeftCorner(n, n) = spec_.a - spec_.gain * spec_.c;
  augmented.block(0, n, n, 1) = spec_.b;
  augmented.topRightCorner(n, m) = spec_.gain;
  const Eigen::MatrixXd exponential = MatrixExponential(augmented * period_s);
  step_ = exponential.topLeftCorner(n, n);
  push_ = exponential.block(0, n, n, 1);
  read_ = exponential.topRightCorner(n, m);
  period_s_ = period_s;
}

double Observer::Step(std::span<const double> readings, std::span<const double> references, double sent,
                      double period_s) {
  for (Eigen::Index i = 0; i < readings_.size(); ++i) {
    readings_[i] = readings[static_cast<std::size_t>(i)];
    references_[i] = references[static_cast<std::size_t>(i)];
  }
  Discretise(period_s);
  if (settled_) {
    next_.noalias() = step_ * state_;
    next_.noalias() += read_ * readings_;
    next_ += push_ * sent;
    state_.swap(next_);
  } else {
    state_.noalias() = left_inverse_ * readings_;
    settled_ = true;
  }
  wanted_.noalias() = left_inverse_ * references_;
  return -spec_.feedback.dot(state_ - wanted_);
}

}  // namespace gapscope
