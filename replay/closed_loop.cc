#include "replay/closed_loop.h"

#include <algorithm>
#include <chrono>
#include <cmath>
#include <memory>
#include <optional>

#include "replay/policy.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

// What becomes of one log.
struct LoopTraces {
  LogReplay* log;
  std::vector<double>* sent;
  std::size_t* steps;
};

// The row whose command acts `at`, none after `row`.
std::size_t RowHeld(const Recording& recording, std::size_t row, double at) {
  while (row > 0 && recording.time_s[row] > at + 1e-12) --row;
  return row;
}

// One log. False after a divergence; what was sent and predictions are NaN from there on.
bool RunLoop(const Model& model, const Recording& recording, Controller& controller, const ReplayOptions& options,
             LoopTraces out) {
  const auto& [log, sent, steps] = out;
  const std::vector<double> values = options.values.empty() ? model.Nominal() : options.values;
  Simulator simulator(model, options.time_step_s);
  sent->assign(recording.rows(), kNaN);
  if (!simulator.SetParameters(values, recording)) return false;
  mjModel* m = const_cast<mjModel*>(&simulator.mujoco_model());
  mjData* d = &simulator.data();
  const double max_step = options.time_step_s > 0 ? options.time_step_s : model.compiled().opt.timestep;
  const InitialState start = InitialStateAt(model, recording, 0, values);
  mj_resetData(m, d);
  std::copy(start.qpos.begin(), start.qpos.end(), d->qpos);
  std::copy(start.qvel.begin(), start.qvel.end(), d->qvel);
  controller.Reset(model.experiment().replay.start_s > 0 ? Controller::Start::kSettled : Controller::Start::kZero);
  std::vector<double> readings(recording.measured.size());
  for (std::size_t row = 0; row < recording.rows(); ++row) {
    for (std::size_t s = 0; s < readings.size(); ++s) {
      const auto& measured = recording.measured[s];
      const SignalSource& source = model.source(measured.index);
      double value = source.kind == SignalKind::kPosition   ? d->qpos[source.qpos]
                     : source.kind == SignalKind::kVelocity ? d->qvel[source.dof]
                                                            : kNaN;
      if (source.offset >= 0) value += values[source.offset];
      log->signals[s].predicted[row] = value;
      const double count = measured.spec.resolution;
      readings[s] = count > 0 ? count * std::round(value / count) : value;
    }
    (*sent)[row] = controller.Step(row, readings);
    if (row + 1 == recording.rows()) break;
    const double now = recording.time_s[row], interval = recording.time_s[row + 1] - now;
    const int count = std::max(1, static_cast<int>(std::ceil(interval / max_step - 1e-6)));
    m->opt.timestep = interval / count;
    for (int step = 0; step < count; ++step) {
      // A late command is the one that was sent last, the delay ago; before the first one, the log's own.
      for (std::size_t c = 0; c < recording.commands.size(); ++c) {
        const int delay = model.command_delays()[c];
        const double at = now + step * m->opt.timestep - (delay >= 0 ? values[delay] : 0);
        const std::vector<double>& column = c == controller.command() ? *sent : recording.commands[c].values;
        d->ctrl[model.command_actuators()[c]] =
            at < recording.time_s[0] ? recording.commands[c].values[0] : column[RowHeld(recording, row, at)];
      }
      mj_step(m, d);
    }
    *steps += static_cast<std::size_t>(count);
    bool sane = d->warning[mjWARN_BADQACC].number == 0 && d->warning[mjWARN_BADCTRL].number == 0;
    for (int i = 0; i < m->nq; ++i) sane = sane && std::abs(d->qpos[i]) < kRunaway;
    if (!sane) {
      log->diverged_at_s = now;
      return false;
    }
  }
  return true;
}

}  // namespace

MotionStatistics StatisticsOf(const std::vector<double>& time_s, const std::vector<double>& values) {
  MotionStatistics out{.mean = kNaN, .deviation = kNaN, .low = kNaN, .high = kNaN, .crossings_hz = kNaN};
  std::vector<double> finite;
  for (const double v : values) {
    if (std::isfinite(v)) finite.push_back(v);
  }
  if (finite.size() < 2) return out;
  const Moments moments = MomentsOf(finite);
  out.mean = moments.mean, out.deviation = moments.deviation;
  std::sort(finite.begin(), finite.end());
  out.low = finite[static_cast<std::size_t>(0.025 * static_cast<double>(finite.size() - 1))];
  out.high = finite[static_cast<std::size_t>(0.975 * static_cast<double>(finite.size() - 1))];
  const double band = 0.25 * out.deviation;
  int side = 0, crossings = 0;
  for (const double v : values) {
    if (!std::isfinite(v)) continue;
    const int now = v > out.mean + band ? 1 : v < out.mean - band ? -1 : side;
    crossings += side < 0 && now > 0 ? 1 : 0;
    side = now;
  }
  out.crossings_hz = crossings / (time_s.back() - time_s.front());
  return out;
}

Result<ClosedLoopResult> ReplayClosedLoop(const Model& model, const std::vector<Recording>& recordings,
                                          const ControllerSpec& spec, const ReplayOptions& options, ThreadPool& pool) {
  const auto begin = std::chrono::steady_clock::now();
  for (const SignalSource& source : model.sources()) {
    if (source.delay < 0 && source.cutoff < 0) continue;
    const std::string& signal =
        model.experiment().measured[static_cast<std::size_t>(&source - model.sources().data())].signal;
    return Error{
        .what =
            "a late or filtered sensor cannot be replayed in closed loop: the controller would see the joint itself",
        .where = model.experiment().path,
        .actual = "'" + signal + "'",
        .cure = "replay in free_run or windows, or leave sensor_delay and 'filter:' out"};
  }
  ClosedLoopResult closed;
  closed.result.mode = ReplayMode::kClosedLoop;
  closed.result.time_step_s = options.time_step_s > 0 ? options.time_step_s : model.compiled().opt.timestep;
  closed.result.time_step_error = kNaN;
  closed.sent.resize(recordings.size());
  std::vector<Controller> controllers;
  for (const auto& recording : recordings) {
    GS_ASSIGN(Controller controller, Controller::Make(spec, model.experiment(), recording));
    controllers.push_back(std::move(controller));
    closed.result.logs.push_back(EmptyTraces(recording));
    closed.result.simulated_s += recording.duration_s();
  }
  std::vector<std::size_t> steps(recordings.size(), 0);
  pool.ForEach(recordings.size(), [&](std::size_t i, int) {
    LogReplay& log = closed.result.logs[i];
    log.windows = 1;
    if (RunLoop(model, recordings[i], controllers[i], options, {&log, &closed.sent[i], &steps[i]})) return;
    log.outcome = Outcome::kDiverged;
    log.diverged_windows = 1;
  });
  for (const std::size_t n : steps) closed.result.steps += n;
  closed.result.wall_s = std::chrono::duration<double>(std::chrono::steady_clock::now() - begin).count();
  return closed;
}

}  // namespace gapscope
