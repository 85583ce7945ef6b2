#include "tests/twin/gap.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>

namespace gapscope::twin {
namespace {

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

// What a retuning of `center` may change in a window: along the directions, by an offset of each signal and by a delay.
class Retuning {
 public:
  Retuning(const Plant& center, const std::vector<Direction>& directions)
      : center_(center), moved_(directions.size(), center) {
    for (std::size_t j = 0; j < directions.size(); ++j) {
      directions[j].move(&moved_[j], directions[j].step);
      weight_.push_back((directions[j].step / directions[j].spread) * (directions[j].step / directions[j].spread));
    }
  }
  Eigen::Index count() const { return static_cast<Eigen::Index>(moved_.size()) + SignalCount(center_.rig) + 1; }
  const Commands& commands() const { return commands_; }
  void Receive(const Record& record) {
    commands_ = Received(record, center_);
    moved_commands_.clear();
    for (const Plant& plant : moved_) moved_commands_.push_back(Received(record, plant));
  }

  struct Changes {
    Eigen::MatrixXd global, basis;  // what the window's own initial state explains is out of `global`, and is `basis`
  };
  Changes In(const Window& window, const Eigen::VectorXd& y, const Eigen::VectorXd& weight) const {
    constexpr std::array<std::array<double, 4>, 4> kNudges = {
        {{1e-3, 0, 0, 0}, {0, 1e-2, 0, 0}, {0, 0, 1e-3, 0}, {0, 0, 0, 1e-2}}};
    const int signals = window.signals();
    const auto moves = static_cast<Eigen::Index>(moved_.size());
    Eigen::MatrixXd global(window.size(), count());
    for (Eigen::Index j = 0; j < moves; ++j) {
      const auto i = static_cast<std::size_t>(j);
      global.col(j) = (window.Predicted(moved_[i], moved_commands_[i], {}) - y).cwiseProduct(weight);
    }
    for (int s = 0; s < signals; ++s) global.col(moves + s) = window.Offset(s).cwiseProduct(weight) * kOffsetSpread_rad;
    global.col(count() - 1) = window.Rate(y).cwiseProduct(weight) * kDelaySpread_s;
    Eigen::MatrixXd local(window.size(), 2 * signals);
    for (int k = 0; k < 2 * signals; ++k) {
      const auto i = static_cast<std::size_t>(k);
      local.col(k) = (window.Predicted(center_, commands_, kNudges[i]) - y).cwiseProduct(weight);
    }
    Eigen::MatrixXd basis = BasisOf(local);
    global -= basis * (basis.transpose() * global);
    return {std::move(global), std::move(basis)};
  }

  // Priors: what a diagnosis allows itself too.
  void AddPriors(Eigen::MatrixXd* normal) const {
    const auto moves = static_cast<Eigen::Index>(moved_.size());
    for (Eigen::Index j = 0; j < moves; ++j) (*normal)(j, j) += weight_[static_cast<std::size_t>(j)];
    for (Eigen::Index j = moves; j < normal->cols(); ++j) (*normal)(j, j) += 1;
  }

 private:
  Plant center_;
  std::vector<Plant> moved_;
  std::vector<double> weight_;
  Commands commands_;
  std::vector<Commands> moved_commands_;
};

double Root(double rest, double count) {
  // Rounding may take it below zero; a diverged plant makes it NaN.
  return std::sqrt((rest < 0 ? 0.0 : rest) / std::max(count, 1.0));
}

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

Eigen::MatrixXd BasisOf(const Eigen::MatrixXd& columns) {
  const Eigen::HouseholderQR<Eigen::MatrixXd> qr(columns);
  return qr.householderQ() * Eigen::MatrixXd::Identity(columns.rows(), columns.cols());
}

Leftover::Leftover(Eigen::Index columns, Eigen::Index changes) : normal_(Eigen::MatrixXd::Zero(columns, columns)) {
  NewChanges(changes);
}

void Leftover::NewChanges(Eigen::Index changes) {
  samples_ = 0;
  left_ = Eigen::VectorXd::Zero(changes);
  right_ = Eigen::MatrixXd::Zero(normal_.rows(), changes);
}

void Leftover::AddChanges(const Eigen::MatrixXd& global, const Eigen::MatrixXd& basis, double samples,
                          Eigen::MatrixXd change) {
  change -= basis * (basis.transpose() * change);
  samples_ += samples;
  left_ += change.colwise().squaredNorm().transpose();
  right_ += global.transpose() * change;
}

std::vector<Trace> Leftover::Solve(Eigen::Index beside) const {
  const Eigen::Index alone = normal_.rows() - beside;
  const Eigen::MatrixXd right_alone = right_.bottomRows(alone);
  const Eigen::MatrixXd best = normal_.ldlt().solve(right_);
  const Eigen::MatrixXd best_alone = normal_.bottomRightCorner(alone, alone).ldlt().solve(right_alone);
  std::vector<Trace> list;
  for (Eigen::Index i = 0; i < left_.size(); ++i) {
    list.push_back({Root(left_[i] - right_alone.col(i).dot(best_alone.col(i)), samples_),
                    Root(left_[i] - right_.col(i).dot(best.col(i)), samples_)});
  }
  return list;
}

bool Gap::Finite() const { return std::isfinite(raw) && std::isfinite(refit); }

Gap MeasureGap(const std::vector<Record>& records, const Plant& other, const std::array<double, 2>& floor_rad,
               const std::vector<Direction>& directions, bool refit, const GapOptions& options) {
  Retuning retuning(other, refit ? directions : std::vector<Direction>());
  const Eigen::Index columns = retuning.count();
  double raw = 0, left = 0, count = 0;
  std::vector<double> logs;
  Eigen::MatrixXd normal = Eigen::MatrixXd::Zero(columns, columns);
  Eigen::VectorXd right = Eigen::VectorXd::Zero(columns);
  for (const Record& record : records) {
    const double raw_before = raw, count_before = count;
    retuning.Receive(record);
    for (std::size_t w = 0; w < record.snapshots.size(); ++w) {
      const Window window(record, w, other, options);
      if (window.size() < 8 * window.signals()) continue;
      const Eigen::VectorXd weight = window.Weights(other, floor_rad);
      const Eigen::VectorXd y = window.Predicted(other, retuning.commands(), {});
      Eigen::VectorXd change = (window.Logged() - y).cwiseProduct(weight);
      raw += change.squaredNorm();
      count += static_cast<double>((weight.array() > 0).count());
      if (!refit) continue;
      const auto [global, basis] = retuning.In(window, y, weight);
      change -= basis * (basis.transpose() * change);
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
  retuning.AddPriors(&normal);
  const Eigen::VectorXd best = normal.ldlt().solve(right);
  gap.refit = Root(left - right.dot(best), count);
  for (std::size_t j = 0; j < directions.size(); ++j) gap.moves.push_back(best[static_cast<Eigen::Index>(j)]);
  return gap;
}

std::vector<Trace> MeasureTraces(const std::vector<Record>& records, const Plant& plant,
                                 const std::vector<Plant>& others, const std::array<double, 2>& floor_rad,
                                 const std::vector<Direction>& directions, const std::vector<Direction>& beside,
                                 const GapOptions& options) {
  std::vector<Direction> all = beside;  // first, so that the rest can stand alone
  all.insert(all.end(), directions.begin(), directions.end());
  Retuning retuning(plant, all);
  const auto traces = static_cast<Eigen::Index>(others.size()) + 1;
  Leftover leftover(retuning.count(), traces);
  for (const Record& record : records) {
    retuning.Receive(record);
    for (std::size_t w = 0; w < record.snapshots.size(); ++w) {
      const Window window(record, w, plant, options);
      if (window.size() < 8 * window.signals()) continue;
      const Eigen::VectorXd weight = window.Weights(plant, floor_rad);
      const Eigen::VectorXd y = window.Predicted(plant, retuning.commands(), {});
      Eigen::MatrixXd change(window.size(), traces);
      change.col(traces - 1) = (window.Logged() - y).cwiseProduct(weight);
      for (Eigen::Index i = 0; i + 1 < traces; ++i) {
        const Plant& other = others[static_cast<std::size_t>(i)];
        change.col(i) = (y - window.Predicted(other, Received(record, other), {})).cwiseProduct(weight);
      }
      const auto [global, basis] = retuning.In(window, y, weight);
      leftover.AddColumns(global);
      leftover.AddChanges(global, basis, static_cast<double>((weight.array() > 0).count()), std::move(change));
    }
  }
  retuning.AddPriors(leftover.normal());
  return leftover.Solve(static_cast<Eigen::Index>(beside.size()));
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
