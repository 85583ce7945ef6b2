#include "replay/replay.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <limits>
#include <memory>

#include "replay/policy.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr TimeStepPolicy kTimeStep;

struct Job {
  std::size_t log;
  Window window;
};

// Error of one log: see ReplayError.
double LogError(const LogReplay& log) {
  if (log.outcome == Outcome::kDiverged) return kInfinity;
  double sum = 0;
  int signals = 0;
  for (const auto& signal : log.signals) {
    if (!signal.scored) continue;
    double error = 0;
    std::size_t rows = 0;
    for (std::size_t k = 0; k < signal.measured.size(); ++k) {
      const double y = signal.measured[k];
      if (!std::isfinite(y) || !std::isfinite(signal.predicted[k])) continue;
      ++rows;
      error += (signal.predicted[k] - y) * (signal.predicted[k] - y);
    }
    const double deviation = MomentsOf(signal.measured).deviation;
    if (rows == 0 || !(deviation > 0)) continue;
    sum += error / static_cast<double>(rows) / (deviation * deviation);
    ++signals;
  }
  return signals == 0 ? kNaN : std::sqrt(sum / signals);
}

// What one worker keeps from window to window.
struct Replayer {
  std::unique_ptr<Simulator> simulator;
  std::size_t last_log = std::numeric_limits<std::size_t>::max();
  bool valid = true;  // the values make a model for the last log
  std::vector<double> predicted, poses;
};

// One replay: what all of its windows share.
struct Replays {
  const Model& model;
  const std::vector<Recording>& recordings;
  const ReplayOptions& options;
  const std::vector<double> values;
  double time_step_s;

  // Simulates a window, and writes it into its log's replay.
  RunResult Run(const Job& job, Replayer& worker, LogReplay* log) const {
    const Recording& recording = recordings[job.log];
    if (!worker.simulator) worker.simulator = std::make_unique<Simulator>(model, time_step_s);
    if (worker.last_log != job.log) {
      worker.valid = worker.simulator->SetParameters(values, recording);
      worker.last_log = job.log;
    }
    const std::size_t signals = recording.measured.size(), nq = static_cast<std::size_t>(model.compiled().nq);
    std::vector<double>& buffer = worker.predicted;
    if (buffer.size() < job.window.rows() * signals) buffer.resize(job.window.rows() * signals);
    RunResult run;
    if (worker.valid) {
      worker.poses.resize(options.keep_poses ? job.window.rows() * nq : 0);
      run = worker.simulator->Run(recording, job.window, InitialStateAt(model, recording, job.window.begin, values),
                                  buffer, worker.poses);
      // Windows share a stamp: the later one begins there, and its own pose is the one that counts.
      const std::size_t last = job.window.end == recording.rows() ? job.window.rows() : job.window.rows() - 1;
      if (options.keep_poses)
        std::copy_n(worker.poses.begin(), last * nq,
                    log->qpos.begin() + static_cast<std::ptrdiff_t>(job.window.begin * nq));
    } else {
      run.outcome = Outcome::kDiverged;
      std::fill(buffer.begin(), buffer.end(), kNaN);
    }
    // A window's first row is its initial state: it says nothing about the model.
    const std::size_t first = job.window.begin == 0 && options.mode == ReplayMode::kFreeRun ? 0 : 1;
    for (std::size_t s = 0; s < signals; ++s) {
      auto& predicted = log->signals[s].predicted;
      for (std::size_t r = first; r < job.window.rows(); ++r) predicted[job.window.begin + r] = buffer[r * signals + s];
    }
    return run;
  }
};

}  // namespace

LogReplay EmptyTraces(const Recording& recording) {
  LogReplay log;
  log.log_path = recording.log_path;
  log.time_s = recording.time_s;
  for (const auto& measured : recording.measured) {
    log.signals.push_back({.signal = measured.spec.signal,
                           .kind = measured.spec.kind,
                           .scored = measured.spec.scored,
                           .resolution = measured.spec.resolution,
                           .measured = measured.values,
                           .predicted = std::vector<double>(recording.rows(), kNaN)});
  }
  return log;
}

std::vector<Window> MakeWindows(const Recording& recording, ReplayMode mode, double window_s) {
  if (mode != ReplayMode::kWindows) return {{0, recording.rows()}};
  std::vector<Window> windows;
  const auto& t = recording.time_s;
  std::size_t begin = 0;
  while (begin + 1 < t.size()) {
    std::size_t end = begin + 1;
    while (end < t.size() && t[end] - t[begin] < window_s - 1e-9) ++end;
    // A stub at the end joins the last window.
    if (t.back() - t[begin] < 0.5 * window_s && !windows.empty()) {
      windows.back().end = t.size();
      break;
    }
    windows.push_back({begin, std::min(end + 1, t.size())});
    begin = end;
  }
  return windows;
}

double ReplayError(const std::vector<LogReplay>& logs) {
  double sum = 0;
  std::size_t count = 0;
  for (const auto& log : logs) {
    const double error = LogError(log);
    if (std::isnan(error)) continue;
    sum += error * error;
    ++count;
  }
  return count == 0 ? kNaN : std::sqrt(sum / static_cast<double>(count));
}

ReplayResult Replay(const Model& model, const std::vector<Recording>& recordings, const ReplayOptions& options,
                    ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  ReplayResult result{.mode = options.mode};
  if (options.time_step_s > 0) {
    result.time_step_s = options.time_step_s;
    result.time_step_error = kNaN;
  } else {
    const TimeStep chosen = ChooseTimeStep(model, recordings, options, pool);
    result.time_step_s = chosen.step_s;
    result.time_step_error = chosen.error_change;
  }
  std::vector<Job> jobs;
  for (std::size_t log = 0; log < recordings.size(); ++log) {
    result.logs.push_back(EmptyTraces(recordings[log]));
    if (options.keep_poses)
      result.logs.back().qpos.assign(recordings[log].rows() * static_cast<std::size_t>(model.compiled().nq), kNaN);
    for (const Window& window : MakeWindows(recordings[log], options.mode, options.window_s))
      jobs.push_back({log, window});
  }
  const Replays replays{.model = model,
                        .recordings = recordings,
                        .options = options,
                        .values = options.values.empty() ? model.Nominal() : options.values,
                        .time_step_s = result.time_step_s};
  std::vector<Replayer> workers(pool.workers());
  std::vector<RunResult> runs(jobs.size());
  pool.ForEach(jobs.size(), [&](std::size_t index, int worker) {
    runs[index] = replays.Run(jobs[index], workers[worker], &result.logs[jobs[index].log]);
  });
  for (std::size_t i = 0; i < jobs.size(); ++i) {
    LogReplay& log = result.logs[jobs[i].log];
    ++log.windows;
    result.steps += runs[i].steps;
    if (runs[i].outcome == Outcome::kDiverged) {
      if (log.diverged_windows++ == 0) log.diverged_at_s = runs[i].diverged_at_s;
      log.outcome = Outcome::kDiverged;
    }
  }
  for (const auto& recording : recordings) result.simulated_s += recording.duration_s();
  result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return result;
}

TimeStep ChooseTimeStep(const Model& model, const std::vector<Recording>& recordings, const ReplayOptions& options,
                        ThreadPool& pool) {
  ReplayOptions trial = options;
  trial.keep_poses = false;
  const auto error_at = [&](double step) {
    trial.time_step_s = step;
    return ReplayError(Replay(model, recordings, trial, pool).logs);
  };
  // One step per sample where that is fine enough: stamps are landed on in any case, so a longer step does not exist.
  double sample = 0;
  for (const auto& recording : recordings) sample = std::max(sample, recording.timeline.median_step_s);
  const double own = model.compiled().opt.timestep;
  TimeStep chosen{.step_s = sample > 0 ? sample : own, .error_change = 0};
  const double finest = std::min(own, chosen.step_s) / (1 << kTimeStep.halvings);
  double error = error_at(chosen.step_s);
  while (true) {
    const double finer = error_at(chosen.step_s / 2);
    chosen.error_change = std::abs(error - finer);
    // What diverges at a slow log's samples may be sound at the model's own step.
    const bool diverges = !std::isfinite(finer) && !std::isfinite(error);
    if (diverges && chosen.step_s <= own) break;
    if (!diverges && chosen.error_change < kTimeStep.error_share * finer) break;
    if (chosen.step_s <= finest * 1.001) break;
    chosen.step_s /= 2;
    error = finer;
  }
  return chosen;
}

ScaleTable EstimateScales(const Model& model, const std::vector<Recording>& recordings) {
  const mjModel& m = model.compiled();
  ScaleTable table;
  Simulator simulator(model, 0);
  const std::vector<double> values = model.Nominal();
  std::vector<Scales> joints(
      m.njnt, {.torque_n_m = 0, .angle_rad = 0, .speed_rad_per_s = 0, .sample_s = 0, .command = 0, .inertia_kg_m2 = 0});
  std::vector<double> buffer, pose(m.nq);
  std::vector<double> steps;
  const auto largest = [](double& value, double candidate) {
    if (std::isfinite(candidate)) value = std::max(value, std::abs(candidate));
  };
  for (const auto& recording : recordings) {
    if (!simulator.SetParameters(values, recording)) continue;
    steps.push_back(recording.timeline.median_step_s);
    mjModel* copy = const_cast<mjModel*>(&simulator.mujoco_model());
    mjData* d = &simulator.data();
    // Follow the measured motion, not a free run that may run off: the torques that the motors would give, and the
    // motion's own inertial torques.
    for (std::size_t row = 0; row < recording.rows(); row += std::max<std::size_t>(1, recording.rows() / 200)) {
      const InitialState state = InitialStateAt(model, recording, row, values);
      mj_resetData(copy, d);
      std::copy(state.qpos.begin(), state.qpos.end(), d->qpos);
      std::copy(state.qvel.begin(), state.qvel.end(), d->qvel);
      for (std::size_t c = 0; c < recording.commands.size(); ++c)
        d->ctrl[model.command_actuators()[c]] = recording.commands[c].values[row];
      mj_forward(copy, d);
      for (int j = 0; j < m.njnt; ++j) {
        if (m.jnt_type[j] != mjJNT_HINGE && m.jnt_type[j] != mjJNT_SLIDE) continue;
        const int dof = m.jnt_dofadr[j];
        largest(joints[j].torque_n_m, d->qfrc_actuator[dof]);
        largest(joints[j].torque_n_m, d->qfrc_passive[dof]);
        largest(joints[j].torque_n_m, d->qfrc_bias[dof]);
        largest(joints[j].angle_rad, d->qpos[m.jnt_qposadr[j]]);
        largest(joints[j].speed_rad_per_s, d->qvel[dof]);
        joints[j].inertia_kg_m2 = DrivenInertia(*copy, j);
      }
    }
  }
  std::sort(steps.begin(), steps.end());
  for (int j = 0; j < m.njnt; ++j) {
    Scales& s = joints[j];
    if (!(s.torque_n_m > 0)) s.torque_n_m = 1;
    if (!(s.angle_rad > 0)) s.angle_rad = 1;
    if (!(s.speed_rad_per_s > 0)) s.speed_rad_per_s = 1;
    if (!steps.empty()) s.sample_s = steps[steps.size() / 2];
    if (const char* name = mj_id2name(&m, mjOBJ_JOINT, j)) table[name] = s;
  }
  for (std::size_t c = 0; c < model.experiment().commands.size(); ++c) {
    const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, model.experiment().commands[c].actuator.c_str());
    if (m.actuator_trntype[actuator] != mjTRN_JOINT) continue;
    Scales s = joints[m.actuator_trnid[2 * actuator]];
    s.command = 0;
    for (const auto& recording : recordings) {
      for (const double value : recording.commands[c].values) largest(s.command, value);
    }
    if (!(s.command > 0)) s.command = 1;
    table[model.experiment().commands[c].actuator] = s;
  }
  return table;
}

}  // namespace gapscope
