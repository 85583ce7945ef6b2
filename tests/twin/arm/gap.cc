#include "tests/twin/arm/gap.h"

#include <algorithm>
#include <cmath>
#include <map>

namespace gapscope::twin {
namespace {

constexpr double kNudge_rad = 1e-3, kNudge_rad_per_s = 1e-2;
constexpr int kNoNudge = -1;

Eigen::Index Count(std::size_t n) { return static_cast<Eigen::Index>(n); }

}  // namespace

std::vector<ArmDirection> ArmBaseDirections(ArmRig rig) {
  std::vector<ArmDirection> list;
  for (const ArmParameter& p : ArmParameters(rig)) {
    if (p.relative_spread == 0) continue;
    const auto move = [joint = p.joint, field = p.field](ArmPlant* plant, double x) {
      plant->joints[joint].base.*field *= std::exp(x);
    };
    list.push_back({move, 0.02, kParameterSpread});
  }
  return list;
}

std::vector<ArmRecord> CoarseArmRecords(const ArmPlant& plant, const std::vector<ArmLog>& logs,
                                        const ArmSensors& sensors, const ArmGapOptions& options) {
  RecordOptions record;
  record.step_s = options.step_s;
  record.snapshot_every_s = options.every_s;
  std::vector<ArmRecord> records;
  for (const ArmLog& log : logs) records.push_back(MakeArmRecord(plant, log, sensors, record));
  return records;
}

ArmRetuning::ArmRetuning(const std::vector<ArmRecord>& records, const ArmPlant& center, const ArmSensors& sensors,
                         const std::vector<ArmDirection>& beside, const ArmGapOptions& options)
    : center_(center),
      options_(options),
      joints_(center.count()),
      floor_rad_(joints_),
      beside_(Count(beside.size())),
      logs_(records.size()),
      columns_(0, 0) {
  for (int j = 0; j < joints_; ++j) floor_rad_[j] = sensors.angle[static_cast<std::size_t>(j)].Floor();
  std::vector<ArmDirection> directions = beside;  // first, so that the rest can stand alone
  const auto base = ArmBaseDirections(center.rig);
  directions.insert(directions.end(), base.begin(), base.end());
  std::vector<ArmPlant> moved(directions.size(), center);
  const Eigen::Index count = Count(moved.size()) + joints_ + 1;
  Eigen::VectorXd prior = Eigen::VectorXd::Ones(count);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    directions[i].move(&moved[i], directions[i].step);
    prior[Count(i)] = std::pow(directions[i].step / directions[i].spread, 2);
  }
  columns_ = Leftover(count, 0);
  for (std::size_t log = 0; log < records.size(); ++log) {
    const ArmRecord& record = records[log];
    std::vector<ArmCommands> commands;
    for (const ArmPlant& plant : moved) commands.push_back(ReceivedByArm(record, plant));
    commands.push_back(ReceivedByArm(record, center));
    for (std::size_t s = 0; s < record.snapshots.size(); ++s) {
      Window window{.record = &record, .log = log, .snapshot = s, .rows = {}, .global = {}, .basis = {}};
      const double begin = record.time_s[record.snapshot_rows[s]];
      double next = begin + options.skipped_s;
      for (std::size_t row = record.snapshot_rows[s]; row < record.time_s.size(); ++row) {
        if (record.time_s[row] > begin + options.window_s + 1e-9) break;
        if (record.time_s[row] + 1e-9 < next) continue;
        window.rows.push_back(row);
        next = record.time_s[row] + options.sample_s;
      }
      if (window.rows.size() < 8 + 2 * static_cast<std::size_t>(joints_)) continue;
      AddColumns(moved, commands, &window);
      columns_.AddColumns(window.global);
      windows_.push_back(std::move(window));
    }
  }
  *columns_.normal() += prior.asDiagonal().toDenseMatrix();
}

// The angles at a window's rows, joints together, over the floors.
Eigen::VectorXd ArmRetuning::Logged(const Window& window) const {
  Eigen::VectorXd y(Count(window.rows.size()) * joints_);
  for (std::size_t i = 0; i < window.rows.size(); ++i) {
    y.segment(Count(i) * joints_, joints_) =
        window.record->angle_rad[window.rows[i]].cwiseQuotient(JointVector(floor_rad_));
  }
  return y;
}

Eigen::VectorXd ArmRetuning::Predicted(const Window& window, const ArmPlant& plant, const ArmCommands& commands,
                                       int nudge) const {
  ArmSimulator simulator = window.record->snapshots[window.snapshot];
  simulator.Become(plant);
  if (nudge != kNoNudge) {
    simulator.Nudge(nudge / 2, nudge % 2 == 0 ? kNudge_rad : 0, nudge % 2 == 0 ? 0 : kNudge_rad_per_s);
  }
  const double h = simulator.step_s(), begin = simulator.time_s();
  JointHistory history;
  history.Push(simulator.q());
  Eigen::VectorXd y(Count(window.rows.size()) * joints_);
  for (std::size_t i = 0; i < window.rows.size(); ++i) {
    const double t = window.record->time_s[window.rows[i]];
    while (simulator.time_s() + h / 2 < t) {
      simulator.Step(commands);
      history.Push(simulator.q());
    }
    for (int j = 0; j < joints_; ++j) {
      y[Count(i) * joints_ + j] = history.At(j, (t - plant.joints[j].sensor_delay_s - begin) / h) / floor_rad_[j];
    }
  }
  return y;
}

// Change of each sample over one row: the column of a small delay.
Eigen::VectorXd ArmRetuning::Rate(const Window& window, const Eigen::VectorXd& y) const {
  Eigen::VectorXd rate = Eigen::VectorXd::Zero(y.size());
  const auto& time_s = window.record->time_s;
  for (std::size_t i = 1; i + 1 < window.rows.size(); ++i) {
    rate.segment(Count(i) * joints_, joints_) =
        (y.segment(Count(i + 1) * joints_, joints_) - y.segment(Count(i - 1) * joints_, joints_)) /
        (time_s[window.rows[i + 1]] - time_s[window.rows[i - 1]]);
  }
  return rate;
}

void ArmRetuning::AddColumns(const std::vector<ArmPlant>& moved, const std::vector<ArmCommands>& commands,
                             Window* window) const {
  const Eigen::VectorXd y = Predicted(*window, center_, commands.back(), kNoNudge);
  const Eigen::Index moves = Count(moved.size());
  Eigen::MatrixXd global = Eigen::MatrixXd::Zero(y.size(), moves + joints_ + 1);
  for (std::size_t i = 0; i < moved.size(); ++i) {
    global.col(Count(i)) = Predicted(*window, moved[i], commands[i], kNoNudge) - y;
  }
  for (int j = 0; j < joints_; ++j) {
    for (Eigen::Index i = j; i < y.size(); i += joints_) global(i, moves + j) = kOffsetSpread_rad / floor_rad_[j];
  }
  global.col(moves + joints_) = Rate(*window, y) * kDelaySpread_s;
  Eigen::MatrixXd local(y.size(), 2 * joints_);
  for (int k = 0; k < 2 * joints_; ++k) local.col(k) = Predicted(*window, center_, commands.back(), k) - y;
  window->basis = BasisOf(local);
  window->global = global - window->basis * (window->basis.transpose() * global);
}

std::vector<ArmTrace> ArmRetuning::Measure(const std::vector<Pair>& pairs) const {
  const Eigen::Index count = Count(pairs.size());
  Leftover leftover = columns_;
  leftover.NewChanges(count);
  std::vector<ArmTrace> traces(pairs.size());
  for (ArmTrace& trace : traces) trace.gap.logs.assign(logs_, 0);
  std::vector<double> samples(logs_, 0);
  for (const Window& window : windows_) {
    std::map<const ArmPlant*, Eigen::VectorXd> known = {{nullptr, Logged(window)}};
    const auto at = [&](const ArmPlant* plant) -> const Eigen::VectorXd& {
      if (known.count(plant) == 0) {
        known[plant] = Predicted(window, *plant, ReceivedByArm(*window.record, *plant), kNoNudge);
      }
      return known[plant];
    };
    Eigen::MatrixXd change(window.global.rows(), count);
    for (std::size_t i = 0; i < pairs.size(); ++i) {
      change.col(Count(i)) = at(pairs[i].with) - at(pairs[i].without);
      traces[i].gap.logs[window.log] += change.col(Count(i)).squaredNorm();
    }
    samples[window.log] += static_cast<double>(change.rows());
    leftover.AddChanges(window.global, window.basis, static_cast<double>(change.rows()), change);
  }
  const std::vector<Trace> solved = leftover.Solve(beside_);
  for (std::size_t i = 0; i < pairs.size(); ++i) {
    Gap& gap = traces[i].gap;
    double all = 0, of = 0;
    for (std::size_t log = 0; log < logs_; ++log) {
      all += gap.logs[log];
      of += samples[log];
      gap.logs[log] = std::sqrt(gap.logs[log] / std::max(samples[log], 1.0));
    }
    gap.raw = std::sqrt(all / std::max(of, 1.0));
    gap.refit = solved[i].refit;
    traces[i].beside = solved[i].beside;
  }
  return traces;
}

}  // namespace gapscope::twin
