#include "src/fit/window_columns.h"

#include <Eigen/QR>
#include <algorithm>
#include <numeric>

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

// Signals in the parts of a graph whose edges are states that move two of them (one pass for each signal is enough to
// carry the lowest number of a part to all of it).
void WindowColumns::FindParts() {
  const Eigen::Index signals = (states_.rows() - states_.cols()) / signal_rows_;
  std::vector<std::vector<Eigen::Index>> moved(static_cast<std::size_t>(states_.cols()));
  for (std::size_t state = 0; state < moved.size(); ++state) {
    for (Eigen::Index s = 0; s < signals; ++s) {
      const auto column = states_.col(static_cast<Eigen::Index>(state)).head(signals * signal_rows_);
      if (column.segment(s * signal_rows_, signal_rows_).norm() > kNoise * column.norm()) moved[state].push_back(s);
    }
  }
  std::vector<Eigen::Index> part_of(static_cast<std::size_t>(signals));
  std::iota(part_of.begin(), part_of.end(), Eigen::Index{0});
  for (Eigen::Index pass = 0; pass < signals; ++pass) {
    for (const auto& joined : moved) {
      if (joined.empty()) continue;
      Eigen::Index lowest = signals;
      for (const Eigen::Index s : joined) lowest = std::min(lowest, part_of[static_cast<std::size_t>(s)]);
      for (const Eigen::Index s : joined) part_of[static_cast<std::size_t>(s)] = lowest;
    }
  }
  signals_.assign(static_cast<std::size_t>(signals), {});
  for (Eigen::Index s = 0; s < signals; ++s) {
    const auto lowest = static_cast<std::size_t>(part_of[static_cast<std::size_t>(s)]);
    Place& place = signals_[static_cast<std::size_t>(s)];
    place.part = lowest == static_cast<std::size_t>(s) ? parts_.size() : signals_[lowest].part;
    if (place.part == parts_.size()) parts_.emplace_back();
    place.row = SignalRows(parts_[place.part]);
    parts_[place.part].signals.push_back(s);
  }
  states_at_.assign(moved.size(), {});
  for (std::size_t state = 0; state < moved.size(); ++state)
    states_at_[state].part = moved[state].empty() ? 0 : signals_[static_cast<std::size_t>(moved[state].front())].part;
  for (std::size_t state = 0; state < moved.size(); ++state) {
    Part& part = parts_[states_at_[state].part];
    states_at_[state].row = SignalRows(part) + static_cast<Eigen::Index>(part.states.size());
    part.states.push_back(static_cast<Eigen::Index>(state));
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
  const Eigen::Index prior = states_.rows() - states_.cols();
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
  const Eigen::Index prior = states_.rows() - states_.cols();
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
