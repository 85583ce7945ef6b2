#include <fmt/core.h>

#include <filesystem>
#include <limits>
#include <optional>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/report/closed_loop_report.h"
#include "src/report/replay_report.h"
#include "src/tune/tune.h"

namespace gapscope::cli {
namespace {

struct ReplayFlags {
  CommonFlags common;
  ModelFlags model;
  std::string mode;
  double window_s = 0, time_step_s = 0, fail_above = 0;
  bool nuisances = false;
};

Result<int> RunReplay(const ReplayFlags& flags) {
  GS_ASSIGN(const Session session, LoadSession(flags.model, flags.common));
  PrintFindings(session.recordings, flags.common.quiet);
  ReplayOptions options{.mode = session.experiment.replay.mode,
                        .window_s = session.experiment.replay.window_s,
                        .time_step_s = flags.time_step_s,
                        .values = session.values};
  if (flags.mode == "free_run") options.mode = ReplayMode::kFreeRun;
  if (flags.mode == "windows") options.mode = ReplayMode::kWindows;
  if (flags.mode == "closed_loop") options.mode = ReplayMode::kClosedLoop;
  if (flags.window_s > 0) options.window_s = flags.window_s;
  std::optional<ControllerSpec> controller;
  ClosedLoopResult closed;
  if (options.mode == ReplayMode::kClosedLoop) {
    if (flags.nuisances)
      return Error{.what = "in a closed loop nothing is fitted",
                   .where = "--nuisances",
                   .cure = "leave it out, or replay in windows"};
    GS_ASSIGN(controller, LoadController(session.experiment));
    GS_ASSIGN(closed, ReplayClosedLoop(*session.model, session.recordings, *controller, options, *session.pool));
  }
  ReplayResult result = controller ? closed.result : Replay(*session.model, session.recordings, options, *session.pool);
  if (flags.nuisances) {
    const TuneOptions fit{.window_s = options.window_s, .time_step_s = result.time_step_s};
    result.logs =
        Evaluate(*session.model, session.recordings, session.values, std::nullopt, options.mode, fit, *session.pool);
  }
  const Comparison comparison = Compare(result, session.recordings, *session.pool);
  // The other way of looking at the same logs: local error in windows against accumulated error in a free run.
  ReplayOptions other = options;
  other.mode = options.mode == ReplayMode::kWindows ? ReplayMode::kFreeRun : ReplayMode::kWindows;
  other.time_step_s = result.time_step_s;
  const double other_error = ReplayError(Replay(*session.model, session.recordings, other, *session.pool).logs);
  // What the effects and values given here are worth: the nominal model beside them.
  GS_ASSIGN(const auto nominal, Model::Build(session.experiment));
  const bool changed = !session.model->effects().empty() || session.values != nominal->Nominal();
  std::vector<LogReplay> before;
  if (changed) {
    ReplayOptions nominal_options = options;
    nominal_options.values = nominal->Nominal();
    if (controller) {
      GS_ASSIGN(auto nominal_loop,
                ReplayClosedLoop(*nominal, session.recordings, *controller, nominal_options, *session.pool));
      before = std::move(nominal_loop.result.logs);
    } else {
      before = Replay(*nominal, session.recordings, nominal_options, *session.pool).logs;
    }
  }
  const ReplayReport report{.result = result,
                            .comparison = comparison,
                            .model = *session.model,
                            .values = session.values,
                            .seed = flags.common.seed,
                            .other_error = other_error,
                            .nominal_error = changed ? ReplayError(before) : std::numeric_limits<double>::quiet_NaN()};
  if (!flags.common.out.empty()) {
    const std::filesystem::path out = flags.common.out;
    GS_RETURN_IF_ERROR(WriteFile(out / "result.json", ReplayJson(report) + "\n"));
    GS_RETURN_IF_ERROR(WriteTraces(out / "traces", result, session.recordings));
    GS_ASSIGN(const std::string xml,
              session.model->ToXml(session.values, session.recordings.front().values, session.scales));
    GS_RETURN_IF_ERROR(WriteFile(out / "model.xml", xml));
    std::vector<ReportPrediction> predictions;
    if (changed) predictions.push_back({"nominal", std::move(before)});
    predictions.push_back({changed ? "with what was added" : "nominal", result.logs});
    GS_RETURN_IF_ERROR(WriteReport(out, ReplayJson(report), session.experiment, {session.recordings, {}},
                                   std::move(predictions), *session.model, session.values,
                                   session.model->parameters()));
  }
  const std::string json =
      controller ? WithStatistics(ReplayJson(report), closed, session.recordings, *controller) : ReplayJson(report);
  if (controller && !flags.common.out.empty()) {
    GS_RETURN_IF_ERROR(WriteFile(std::filesystem::path(flags.common.out) / "result.json", json + "\n"));
    GS_RETURN_IF_ERROR(
        WriteSent(std::filesystem::path(flags.common.out) / "closed_loop", closed, session.recordings, *controller));
  }
  if (flags.common.json) {
    fmt::print("{}\n", json);
  } else {
    fmt::print("{}", ReplayTable(report, ConsoleOf(1)));
    if (controller) fmt::print("{}", StatisticsTable(closed, session.recordings, *controller));
  }
  if (flags.fail_above > 0 && !(comparison.error <= flags.fail_above)) {
    if (!flags.common.quiet)
      fmt::print(stderr, "gapscope: error {:.4g} is above --fail-above {:.4g}\n", comparison.error, flags.fail_above);
    return kBelowThreshold;
  }
  return kDone;
}

}  // namespace

void AddReplay(CLI::App& program, Run& run) {
  auto flags = std::make_shared<ReplayFlags>();
  CLI::App* command =
      program.add_subcommand("replay", "Replay logged commands in simulation: predicted against measured, scores");
  AddModelFlags(*command, flags->model, true);
  AddCommonFlags(*command, flags->common, true);
  command->add_option("--mode", flags->mode, "free_run, windows or closed_loop (default: the experiment's)")
      ->check(CLI::IsMember({"free_run", "windows", "closed_loop"}));
  command->add_option("--window", flags->window_s, "Length of a window, s")->check(FinitePositive());
  command
      ->add_option("--time-step", flags->time_step_s,
                   "Largest simulation step, s (default: chosen so that halving it changes the error by < 1 %)")
      ->check(FinitePositive());
  command->add_flag("--nuisances", flags->nuisances,
                    "Fit what is no finding first: zero offsets, initial states, a command shift below one sample; as "
                    "tune and diagnose do");
  command->add_option("--fail-above", flags->fail_above, "Exit status 1 when the error is above this")
      ->check(FinitePositive());
  command->footer(
      "Example: gapscope replay models/qube/experiment.yaml log.csv --with cable_spring@arm --set "
      "cable_spring@arm.stiffness_n_m_per_rad=0.0012 --out out");
  command->callback([flags, &run] { run = [flags] { return RunReplay(*flags); }; });
}

}  // namespace gapscope::cli
