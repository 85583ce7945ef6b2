#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <thread>

#include "bench/case.h"
#include "bench/rows.h"

namespace gapscope::bench {
namespace {

constexpr double kDuration_s = 10;
constexpr double kWindow_s = 0.05;
constexpr int kWindows = 1000;

// The bare loop: everything that is not mj_step and the command is prepared before.
class BareLoop {
 public:
  explicit BareLoop(const Case& made) : case_(made), prepared_(*made.model, made.time_step_s) {
    const Recording& recording = made.recordings.front();
    // A Simulator writes the parameters and sets the disable flags; its model is then copied as it is.
    prepared_.SetParameters(made.values, recording);
    model_.reset(mj_copyModel(nullptr, &prepared_.mujoco_model()));
    data_.reset(mj_makeData(model_.get()));
    start_ = InitialStateAt(*made.model, recording, 0, made.values);
    const double interval = recording.time_s[1] - recording.time_s[0];
    steps_per_row_ = std::max(1, static_cast<int>(std::ceil(interval / made.time_step_s - 1e-6)));
    model_->opt.timestep = interval / steps_per_row_;
  }

  std::size_t Run() {
    mjModel* m = model_.get();
    mjData* d = data_.get();
    const Recording& recording = case_.recordings.front();
    mj_resetData(m, d);
    std::copy(start_.qpos.begin(), start_.qpos.end(), d->qpos);
    std::copy(start_.qvel.begin(), start_.qvel.end(), d->qvel);
    const auto& ctrl = case_.model->command_actuators();
    for (std::size_t row = 0; row + 1 < recording.rows(); ++row) {
      for (std::size_t c = 0; c < ctrl.size(); ++c) d->ctrl[ctrl[c]] = recording.commands[c].values[row];
      for (int step = 0; step < steps_per_row_; ++step) mj_step(m, d);
    }
    return (recording.rows() - 1) * static_cast<std::size_t>(steps_per_row_);
  }

 private:
  const Case& case_;
  Simulator prepared_;
  ModelPtr model_;
  DataPtr data_;
  InitialState start_;
  int steps_per_row_ = 1;
};

Result<Row> CompareWithBareLoop(const std::string& name, const Case& made, const ReplayOptions& replay, int repeats) {
  BareLoop bare(made);
  ThreadPool pool(1);
  std::size_t bare_steps = 0, replay_steps = 0;
  const Pairs pairs = TimePairs(
      Clock::kThread, repeats, [&] { replay_steps = Replay(*made.model, made.recordings, replay, pool).steps; },
      [&] { bare_steps = bare.Run(); });
  if (bare_steps != replay_steps) {
    return Error{.what = "the two sides took different numbers of steps",
                 .where = name,
                 .actual = std::to_string(replay_steps),
                 .allowed = std::to_string(bare_steps)};
  }
  Row row{.name = name, .target = 0.97};
  std::vector<double> ratios;
  for (std::size_t i = 0; i < pairs.a_s.size(); ++i) ratios.push_back(pairs.b_s[i] / pairs.a_s[i]);
  Summarise(ratios, row);
  const double steps = static_cast<double>(bare_steps);
  row.detail = fmt::format("{:.0f} k steps/s replayed, {:.0f} k bare", 1e-3 * steps / Quantile(pairs.a_s, 0.5),
                           1e-3 * steps / Quantile(pairs.b_s, 0.5));
  return row;
}

Result<Case> ManyWindows() { return MakeCase("qube", kWindows * kWindow_s); }

ReplayOptions WindowOptions(const Case& made) {
  return {.mode = ReplayMode::kWindows, .window_s = kWindow_s, .time_step_s = made.time_step_s, .values = made.values};
}

}  // namespace

Result<std::vector<Row>> ReplayRows(const BenchOptions& options) {
  std::vector<Row> rows;
  for (const auto& rig : Rigs()) {
    GS_ASSIGN(const Case made, MakeCase(rig, kDuration_s));
    GS_ASSIGN(Row row, CompareWithBareLoop("replay_vs_mj_step." + rig, made,
                                           {.time_step_s = made.time_step_s, .values = made.values}, options.repeats));
    rows.push_back(std::move(row));
  }
  return rows;
}

Result<std::vector<Row>> WindowRows(const BenchOptions& options) {
  GS_ASSIGN(const Case made, ManyWindows());
  const std::size_t windows = MakeWindows(made.recordings.front(), ReplayMode::kWindows, kWindow_s).size();
  if (windows != kWindows)
    return Error{.what = "wrong number of windows",
                 .where = "bench",
                 .actual = std::to_string(windows),
                 .allowed = std::to_string(kWindows)};
  GS_ASSIGN(Row row, CompareWithBareLoop("replay_windows_vs_mj_step.qube", made, WindowOptions(made), options.repeats));
  return std::vector<Row>{row};
}

Result<std::vector<Row>> ScalingRows(const BenchOptions& options) {
  GS_ASSIGN(const Case made, ManyWindows());
  const ReplayOptions replay = WindowOptions(made);
  ThreadPool one(1), two(2);
  const Pairs pairs = TimePairs(
      Clock::kWall, options.repeats, [&] { Replay(*made.model, made.recordings, replay, one); },
      [&] { Replay(*made.model, made.recordings, replay, two); });
  Row row{.name = "scaling_1_to_2.qube", .target = 1.95};
  std::vector<double> ratios;
  for (std::size_t i = 0; i < pairs.a_s.size(); ++i) ratios.push_back(pairs.a_s[i] / pairs.b_s[i]);
  Summarise(ratios, row);
  // Two threads do twice the work of one: the machine's own gain.
  BareLoop first(made), second(made);
  const Pairs machine = TimePairs(
      Clock::kWall, options.repeats, [&] { first.Run(); },
      [&] {
        std::thread other([&] { second.Run(); });
        first.Run();
        other.join();
      });
  std::vector<double> gains;
  for (std::size_t i = 0; i < machine.a_s.size(); ++i) gains.push_back(2 * machine.a_s[i] / machine.b_s[i]);
  row.detail = fmt::format("two threads of bare mj_step gain {:.2f} here ({:.2f} to {:.2f}), {} processors",
                           Quantile(gains, 0.5), Quantile(gains, 0.1), Quantile(gains, 0.9),
                           std::thread::hardware_concurrency());
  return std::vector<Row>{row};
}

}  // namespace gapscope::bench
