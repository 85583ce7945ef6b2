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
    const double square = MeanSquareError(signal), deviation = MomentsOf(signal.measured).deviation;
    if (std::isnan(square) || !(deviation > 0)) continue;
    sum += square / (deviation * deviation);
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

double MeanSquareError(const SignalTrace& signal) {
  double sum = 0;
  std::size_t rows = 0;
  for (std::size_t k = 0; k < signal.measured.size(); ++k) {
    const double y = signal.measured[k];
    if (!std::isfinite(y) || !std::isfinite(signal.predicted[k])) continue;
    ++rows;
    sum += (signal.predicted[k] - y) * (signal.predicted[k] - y);
  }
  return rows == 0 ? kNaN : sum / static_cast<double>(rows);
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
    if (!diverges && chosen.error_change < options.step_error_share * finer) break;
    if (chosen.step_s <= finest * 1.001) break;
    chosen.step_s /= 2;
    error = finer;
  }
  return chosen;
}

}  // namespace gapscope
