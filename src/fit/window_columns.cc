#include "src/fit/window_columns.h"

#include <Eigen/QR>
#include <algorithm>

#include "src/fit/coupling.h"

namespace gapscope {
namespace {

// A share of a column's length that a signal's part of it must have: less is what a solver's tolerance leaves.
constexpr double kNoise = 1e-4;

}  // namespace

void WindowColumns::Begin(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian, const FitWindow& window,
                          const Eigen::VectorXd& state, Eigen::Index size) {
  const Eigen::Index m = state.size(), n = jacobian.cols() - m;
  signal_rows_ = window.scored();
  size_ = size;
  residual_.resize(residual.size() + m);
  residual_ << residual, window.prior.cwiseProduct(state);
  states_.resize(residual.size() + m, m);
  states_ << jacobian.rightCols(m), Eigen::MatrixXd(window.prior.asDiagonal());
  FindParts();
  for (Eigen::Index column = 0; column < n; ++column) Set(column, jacobian.col(column));
}

void WindowColumns::FindParts() {
  const Eigen::Index signals = SignalRows() / signal_rows_;
  std::vector<std::vector<std::size_t>> moved(static_cast<std::size_t>(states_.cols()));  // by state
  for (std::size_t state = 0; state < moved.size(); ++state) {
    const auto column = states_.col(static_cast<Eigen::Index>(state)).head(SignalRows());
    for (Eigen::Index s = 0; s < signals; ++s) {
      if (column.segment(s * signal_rows_, signal_rows_).norm() > kNoise * column.norm())
        moved[state].push_back(static_cast<std::size_t>(s));
    }
  }
  const std::vector<std::size_t> part_of = NumberParts(static_cast<std::size_t>(signals), moved);
  for (const std::size_t part : part_of) {
    parts_.resize(std::max(parts_.size(), part + 1));
    const auto signal = static_cast<Eigen::Index>(signals_.size());
    signals_.push_back({part, SignalRows(parts_[part])});
    parts_[part].signals.push_back(signal);
  }
  for (const auto& signals_of_state : moved) {
    const std::size_t part = signals_of_state.empty() ? 0 : part_of[signals_of_state.front()];
    auto& states = parts_[part].states;
    const auto state = static_cast<Eigen::Index>(states_at_.size());
    states_at_.push_back({part, SignalRows(parts_[part]) + static_cast<Eigen::Index>(states.size())});
    states.push_back(state);
  }
  for (Part& part : parts_) part.values.resize(SignalRows(part) + static_cast<Eigen::Index>(part.states.size()), size_);
}

Eigen::VectorXd WindowColumns::Rows(const Part& part, const Eigen::VectorXd& values) const {
  Eigen::VectorXd rows = Eigen::VectorXd::Zero(part.values.rows());
  Eigen::Index to = 0;
  for (const Eigen::Index s : part.signals) {
    rows.segment(to, signal_rows_) = values.segment(s * signal_rows_, signal_rows_);
    to += signal_rows_;
  }
  const Eigen::Index prior = SignalRows();
  for (std::size_t i = 0; i < part.states.size() && values.size() > prior; ++i)
    rows[to + static_cast<Eigen::Index>(i)] = values[prior + part.states[i]];
  return rows;
}

void WindowColumns::Add(Part& part, Eigen::Index column, const Eigen::VectorXd& values) const {
  part.values.col(static_cast<Eigen::Index>(part.columns.size())) = values;
  part.columns.push_back(column);
}

void WindowColumns::Set(Eigen::Index column, const Eigen::VectorXd& values) {
  const double least = kNoise * values.norm();
  for (Part& part : parts_) {
    const Eigen::VectorXd rows = Rows(part, values);
    if (parts_.size() == 1 || rows.norm() > least) Add(part, column, rows);
  }
}

void WindowColumns::Finish(const Huber& huber) {
  for (Part& part : parts_) {
    Add(part, size_ - 1, Rows(part, residual_));
    const auto used = static_cast<Eigen::Index>(part.columns.size()), m = static_cast<Eigen::Index>(part.states.size()),
               rows = SignalRows(part);
    auto columns = part.values.leftCols(used);
    Eigen::MatrixXd states(part.values.rows(), m);
    for (Eigen::Index i = 0; i < m; ++i)
      states.col(i) = Rows(part, states_.col(part.states[static_cast<std::size_t>(i)]));
    if (!huber.plain()) {
      Eigen::VectorXd residual = columns.col(used - 1).head(rows);
      Eigen::MatrixXd all(rows, used + m);
      all << columns.topRows(rows), states.topRows(rows);
      huber.Weigh(residual, all);
      columns.topRows(rows) = all.leftCols(used);
      states.topRows(rows) = all.rightCols(m);
    }
    if (m == 0) continue;
    const Eigen::HouseholderQR<Eigen::MatrixXd> qr(states);
    columns.applyOnTheLeft(qr.householderQ().adjoint());
    columns.topRows(m).setZero();
    columns.applyOnTheLeft(qr.householderQ());
  }
}

void WindowColumns::AddProducts(Eigen::Index begin, Eigen::Index count, double weight, Stripe stripe,
                                Eigen::MatrixXd* products, std::vector<double>* scratch) const {
  const auto [first, width] = stripe;
  const Eigen::Index prior = SignalRows();
  const Place& at = begin < prior ? signals_[static_cast<std::size_t>(begin / signal_rows_)]
                                  : states_at_[static_cast<std::size_t>(begin - prior)];
  const Eigen::Index row = at.row + (begin < prior ? begin % signal_rows_ : 0);
  const Part& part = parts_[at.part];
  const auto& numbers = part.columns;
  const auto place_of = [&](Eigen::Index column) {
    return std::lower_bound(numbers.begin(), numbers.end(), column) - numbers.begin();
  };
  const Eigen::Index low = place_of(first), high = place_of(first + width);
  const auto used = static_cast<Eigen::Index>(numbers.size());
  if (low == high) return;
  const auto rows = part.values.block(row, low, count, used - low);
  if (used - low == size_ - first) {  // all
    products->block(first, first, used - low, width).noalias() += weight * rows.transpose() * rows.leftCols(width);
    return;
  }
  const auto most = static_cast<std::size_t>(size_ * width);
  if (scratch->size() < most) scratch->resize(most);
  Eigen::Map<Eigen::MatrixXd> own(scratch->data(), used - low, high - low);
  own.noalias() = weight * rows.transpose() * rows.leftCols(high - low);
  for (Eigen::Index j = 0; j < own.cols(); ++j) {
    double* column = products->col(numbers[static_cast<std::size_t>(low + j)]).data();
    for (Eigen::Index i = 0; i < own.rows(); ++i) column[numbers[static_cast<std::size_t>(low + i)]] += own(i, j);
  }
}

}  // namespace gapscope
