#include "tests/twin/gap.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gapscope::twin {
namespace {

constexpr double kParameterSpread = 0.2;  // relative
constexpr double kOffsetSpread_rad = 0.02, kDelaySpread_s = 5e-4;

// Angles of one window at its sampled rows, signals interleaved.
class Window {
 public:
  Window(const Record& record, std::size_t which, const Plant& plant, const GapOptions& options)
      : record_(record), which_(which), signals_(SignalCount(plant.rig)) {
    const std::size_t first = record.snapshot_rows[which];
    const std::size_t last =
        which + 1 < record.snapshot_rows.size() ? record.snapshot_rows[which + 1] : record.time_s.size() - 1;
    double next = record.time_s[first] + options.sample_s;
    for (std::size_t row = first + 1; row <= last; ++row) {
      if (record.time_s[row] + 1e-9 < next) continue;
      rows_.push_back(row);
      next = record.time_s[row] + options.sample_s;
    }
  }
  Eigen::Index size() const { return static_cast<Eigen::Index>(rows_.size()) * signals_; }

  Eigen::VectorXd Logged() const {
    Eigen::VectorXd y(size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (int s = 0; s < signals_; ++s)
        y[static_cast<Eigen::Index>(i) * signals_ + s] = record_.angle_rad[rows_[i]][s];
    }
    return y;
  }

  // `nudge`: added to the initial motion.
  Eigen::VectorXd Predicted(const Plant& plant, const Commands& commands, const std::array<double, 4>& nudge) const {
    Simulator simulator = record_.snapshots[which_];
    simulator.Become(plant);
    simulator.Nudge(nudge[0], nudge[1], nudge[2], nudge[3]);
    const double h = simulator.step_s();
    const double start = simulator.time_s();
    past_.assign(1, {simulator.q1(), simulator.q2()});
    Eigen::VectorXd y(size());
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      const double t = record_.time_s[rows_[i]];
      while (simulator.time_s() + h / 2 < t) {
        simulator.Step(commands);
        past_.push_back({simulator.q1(), simulator.q2()});
      }
      for (int s = 0; s < signals_; ++s) {
        const double at =
            std::clamp((t - plant.sensor_delay_s[s] - start) / h, 0.0, static_cast<double>(past_.size() - 1));
        const auto low = static_cast<std::size_t>(at);
        const auto high = std::min(low + 1, past_.size() - 1);
        y[static_cast<Eigen::Index>(i) * signals_ + s] =
            past_[low][s] + (at - static_cast<double>(low)) * (past_[high][s] - past_[low][s]);
      }
    }
    return y;
  }

  // 1 / floor for scored samples; a late sensor's first samples would show what went before the window.
  Eigen::VectorXd Weights(const Plant& plant, const std::array<double, 2>& floor_rad) const {
    Eigen::VectorXd w(size());
    const double start = record_.time_s[record_.snapshot_rows[which_]];
    for (std::size_t i = 0; i < rows_.size(); ++i) {
      for (int s = 0; s < signals_; ++s) {
        const bool scored = record_.time_s[rows_[i]] - start >= plant.sensor_delay_s[s];
        w[static_cast<Eigen::Index>(i) * signals_ + s] = scored ? 1 / floor_rad[s] : 0;
      }
    }
    return w;
  }

  // Change of each sample over one row: the column of a small delay.
  Eigen::VectorXd Rate(const Eigen::VectorXd& y) const {
    Eigen::VectorXd rate = Eigen::VectorXd::Zero(size());
    for (Eigen::Index i = signals_; i + signals_ < size(); ++i) {
      const auto row = static_cast<std::size_t>(i / signals_);
      rate[i] = (y[i + signals_] - y[i - signals_]) / (record_.time_s[rows_[row + 1]] - record_.time_s[rows_[row - 1]]);
    }
    return rate;
  }

  Eigen::VectorXd Offset(int signal) const {
    Eigen::VectorXd one = Eigen::VectorXd::Zero(size());
    for (Eigen::Index i = signal; i < size(); i += signals_) one[i] = 1;
    return one;
  }
  int signals() const { return signals_; }

 private:
  const Record& record_;
  std::size_t which_;
  int signals_;
  std::vector<std::size_t> rows_;
  mutable std::vector<std::array<double, 2>> past_;
};

}  // namespace

std::vector<Direction> BaseDirections(Rig rig) {
  std::vector<Direction> list;
  for (const BaseParameter& p : BaseParameters(rig)) {
    if (p.relative_spread == 0) continue;
    const auto field = p.field;
    list.push_back({[field](Plant* plant, double x) { plant->base.*field *= std::exp(x); }, 0.02,
                    p.relative_spread < 0.1 ? p.relative_spread : kParameterSpread});
  }
  return list;
}

bool Gap::Finite() const { return std::isfinite(raw) && std::isfinite(refit); }

Gap MeasureGap(const std::vector<Record>& records, const Plant& other, const std::array<double, 2>& floor_rad,
               const std::vector<Direction>& directions, bool refit, const GapOptions& options) {
  const int signals = SignalCount(other.rig);
  const auto moves = static_cast<Eigen::Index>(directions.size());
  const Eigen::Index columns = refit ? moves + signals + 1 : 0;
  std::vector<Plant> moved(directions.size(), other);
  for (std::size_t j = 0; j < directions.size(); ++j) directions[j].move(&moved[j], directions[j].step);
  const std::array<std::array<double, 4>, 4> nudges = {
      {{1e-3, 0, 0, 0}, {0, 1e-2, 0, 0}, {0, 0, 1e-3, 0}, {0, 0, 0, 1e-2}}};

  double raw = 0, left = 0, count = 0;
  std::vector<double> logs;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(columns);
  for (const Record& record : records) {
    const double raw_before = raw, count_before = count;
    const Commands commands = Received(record, other);
    std::vector<Commands> moved_commands;
    if (refit) {
      for (const Plant& plant : moved) moved_commands.push_back(Received(record, plant));
    }
    for (std::size_t w = 0; w < record.snapshots.size(); ++w) {
      const Window window(record, w, other, options);
      if (window.size() < 8 * signals) continue;
      const Eigen::VectorXd weight = window.Weights(other, floor_rad);
      const Eigen::VectorXd y = window.Predicted(other, commands, {});
      Eigen::VectorXd change = (window.Logged() - y).cwiseProduct(weight);
      raw += change.squaredNorm();
      count += static_cast<double>((weight.array() > 0).count());
      if (!refit) continue;

      Eigen::MatrixXd global(window.size(), columns);
      for (Eigen::Index j = 0; j < moves; ++j) {
        const auto i = static_cast<std::size_t>(j);
        global.col(j) = (window.Predicted(moved[i], moved_commands[i], {}) - y).cwiseProduct(weight);
      }
      for (int s = 0; s < signals; ++s)
        global.col(moves + s) = window.Offset(s).cwiseProduct(weight) * kOffsetSpread_rad;
      global.col(columns - 1) = window.Rate(y).cwiseProduct(weight) * kDelaySpread_s;
      // Take out what the window's own initial state explains.
      Eigen::MatrixXd local(window.size(), 2 * signals);
      for (int k = 0; k < 2 * signals; ++k) {
        const auto i = static_cast<std::size_t>(k);
        local.col(k) = (window.Predicted(other, commands, nudges[i]) - y).cwiseProduct(weight);
      }
      const Eigen::HouseholderQR<Eigen::MatrixXd> qr(local);
      const Eigen::MatrixXd basis = qr.householderQ() * Eigen::MatrixXd::Identity(local.rows(), local.cols());
      change -= basis * (basis.transpose() * change);
      global -= basis * (basis.transpose() * global);
      left += change.squaredNorm();
      normal += global.transpose() * global;
      right += global.transpose() * change;
    }
    logs.push_back(std::sqrt((raw - raw_before) / std::max(count - count_before, 1.0)));
  }
  Gap gap;
  gap.logs = std::move(logs);
  gap.raw = std::sqrt(raw / std::max(count, 1.0));
  if (!refit) return gap;
  // Priors: what a diagnosis allows itself too.
  for (Eigen::Index j = 0; j < moves; ++j) {
    const Direction& d = directions[static_cast<std::size_t>(j)];
    normal(j, j) += (d.step / d.spread) * (d.step / d.spread);
  }
  for (Eigen::Index j = moves; j < columns; ++j) normal(j, j) += 1;
  const Eigen::VectorXd best = normal.ldlt().solve(right);
  const double rest = left - right.dot(best);  // rounding may take it below zero; a diverged plant makes it NaN
  gap.refit = std::sqrt((rest < 0 ? 0.0 : rest) / std::max(count, 1.0));
  for (Eigen::Index j = 0; j < moves; ++j) gap.moves.push_back(best[j]);
  return gap;
}

Gap FitRival(const std::vector<Record>& records, const std::array<double, 2>& floor_rad,
             const std::vector<Direction>& directions, int iterations, const GapOptions& options, Plant* rival) {
  // The linearised remainder at a point is the gap there, nuisances taken out, parameters not.
  const auto remainder = [&](const Plant& plant) {
    return MeasureGap(records, plant, floor_rad, {}, true, options).refit;
  };
  double now = remainder(*rival);
  Gap best = MeasureGap(records, *rival, floor_rad, directions, true, options);
  for (int i = 0; i < iterations && best.Finite(); ++i) {
    // No parameter moves farther than its spread at once.
    double part = 1;
    for (std::size_t j = 0; j < directions.size(); ++j) {
      part = std::min(part, directions[j].spread / std::max(std::abs(directions[j].step * best.moves[j]), 1e-12));
    }
    bool better = false;
    for (int halving = 0; halving < 4 && !better; ++halving, part /= 3) {
      Plant trial = *rival;
      for (std::size_t j = 0; j < directions.size(); ++j) {
        directions[j].move(&trial, part * directions[j].step * best.moves[j]);
      }
      const double there = remainder(trial);
      if (!std::isfinite(there) || there >= now) continue;
      better = true;
      const bool settled = there > 0.99 * now;
      now = there;
      *rival = trial;
      if (settled) i = iterations;
    }
    if (!better) break;
    best = MeasureGap(records, *rival, floor_rad, directions, true, options);
  }
  best.refit = now;
  return best;
}

}  // namespace gapscope::twin
