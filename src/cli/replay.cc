#include <fmt/core.h>

#include <nlohmann/json.hpp>
#include <optional>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/profile.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"
#include "src/report/json.h"
#include "src/report/replay_report.h"
#include "src/report/write_run.h"
#include "src/tune/tune.h"

namespace gapscope::cli {
namespace {

struct ReplayFlags {
  CommonFlags common;
  ModelFlags model;
  std::optional<ReplayMode> mode;
  double window_s = 0, time_step_s = 0, fail_above = 0;
  bool nuisances = false;
};

ReplayOptions OptionsOf(const ReplayFlags& flags, const Session& session) {
  ReplayOptions options{.mode = flags.mode.value_or(session.experiment.replay.mode),
                        .window_s = session.experiment.replay.window_s,
                        .time_step_s = flags.time_step_s,
                        .values = session.values};
  if (flags.window_s > 0) options.window_s = flags.window_s;
  return options;
}

// Without a controller nothing is sent.
Result<ClosedLoopResult> ReplayLogs(const Model& model, const Session& session, const ReplayOptions& options,
                                    const std::optional<ControllerSpec>& controller) {
  if (controller) return ReplayClosedLoop(model, session.recordings, *controller, options, *session.pool);
  return ClosedLoopResult{.result = Replay(model, session.recordings, options, *session.pool), .sent = {}};
}

// The other way of looking at the same logs: local error in windows against accumulated error in a free run.
double OtherError(const Session& session, ReplayOptions options, double time_step_s) {
  options.mode = options.mode == ReplayMode::kWindows ? ReplayMode::kFreeRun : ReplayMode::kWindows;
  options.time_step_s = time_step_s;
  return ReplayError(Replay(*session.model, session.recordings, options, *session.pool).logs);
}

// What the effects and values given here are worth: the nominal model's replay beside theirs. Empty: none are given.
Result<std::vector<LogReplay>> ReplayNominal(const Session& session, ReplayOptions options,
                                             const std::optional<ControllerSpec>& controller) {
  GS_ASSIGN(const auto nominal, Model::Build(session.model->rig()));
  options.values = nominal->Nominal();
  if (session.model->effects().empty() && session.values == options.values) return std::vector<LogReplay>{};
  GS_ASSIGN(ClosedLoopResult replayed, ReplayLogs(*nominal, session, options, controller));
  return std::move(replayed.result.logs);
}

Status WriteReplay(const std::string& out, const Session& session, const ReplayRun& run, std::vector<RunTable> sent,
                   std::vector<LogReplay> nominal) {
  RunFiles files{.tables = TraceTables(run.result.logs, session.recordings)};
  std::move(sent.begin(), sent.end(), std::back_inserter(files.tables));
  GS_ASSIGN(files.model_xml, session.model->ToXml(session.values, session.recordings.front().values, session.scales));
  const std::vector<Recording> none;
  ReportSource source = SourceOf(session.experiment, {session.recordings, none});
  source.content = PageOf(run);
  const bool changed = !nominal.empty();
  if (changed) source.predictions.push_back({"nominal", std::move(nominal)});
  source.predictions.push_back({changed ? "with what was added" : "nominal", run.result.logs});
  source.model = session.model.get();
  source.values = session.values;
  source.parameters = session.model->parameters();
  files.report = &source;
  return WriteRun(out, ToJson(run), files);
}

Result<int> RunReplay(const ReplayFlags& flags) {
  StageClock clock(flags.common);
  GS_ASSIGN(const Session session, LoadSession(flags.model, flags.common));
  PrintFindings(session.recordings, flags.common.quiet);
  const ReplayOptions options = OptionsOf(flags, session);
  std::optional<ControllerSpec> controller;
  if (options.mode == ReplayMode::kClosedLoop) {
    if (flags.nuisances)
      return Error{.what = "in a closed loop nothing is fitted",
                   .where = "--nuisances",
                   .cure = "leave it out, or replay in windows"};
    GS_ASSIGN(controller, LoadController(session.experiment));
  }
  std::optional<ProgressLine> line(std::in_place, flags.common);
  const auto enter = [&](const char* stage) {
    clock.Enter(stage);
    line->Show({.stage = stage}, stage);
  };
  enter("replay");
  GS_ASSIGN(ClosedLoopResult replayed, ReplayLogs(*session.model, session, options, controller));
  ReplayResult& result = replayed.result;
  clock.Count(session.recordings.size(), result.steps);
  if (flags.nuisances) {
    enter("nuisances");
    const TuneOptions fit{.window_s = options.window_s, .time_step_s = result.time_step_s};
    result.logs =
        Evaluate(*session.model, session.recordings, {session.values, std::nullopt}, options.mode, fit, *session.pool);
  }
  enter("compare");
  std::optional<LoopStatistics> loop;
  if (controller) loop = LoopStatisticsOf(replayed, session.recordings, *controller);
  Comparison comparison = Compare(*session.model->rig(), result, session.recordings, *session.pool);
  ReplayRun run = ReplayRunOf(*session.model, session.values, std::move(result), std::move(comparison));
  run.info.seed = flags.common.seed;
  enter("replay beside it");  // windows beside a free run, the nominal model beside a changed one
  run.other_error = OtherError(session, options, run.result.time_step_s);
  run.loop = std::move(loop);
  GS_ASSIGN(std::vector<LogReplay> nominal, ReplayNominal(session, options, controller));
  if (!nominal.empty()) run.nominal_error = ReplayError(nominal);
  enter("write");
  if (!flags.common.out.empty()) {
    std::vector<RunTable> sent;
    if (controller) sent = SentTables(run.result.logs, replayed.sent, session.recordings, *controller);
    GS_RETURN_IF_ERROR(WriteReplay(flags.common.out, session, run, std::move(sent), std::move(nominal)));
  }
  line.reset();
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run, ConsoleOf(1)));
  const double error = run.comparison.error;
  if (flags.fail_above > 0 && !(error <= flags.fail_above)) {
    if (!flags.common.quiet)
      Print(stderr, "gapscope: error {:.4g} is above --fail-above {:.4g}\n", error, flags.fail_above);
    return kBelowThreshold;
  }
  return kDone;
}

}  // namespace

Command ReplayCommand() {
  auto flags = std::make_shared<ReplayFlags>();
  const std::vector<Option> own = {
      {.flag = "--mode",
       .value = ChoiceOf(flags->mode),
       .unset = "the experiment's",
       .help = "free_run: from its first row to its last; windows: piece by piece; closed_loop: under the experiment's "
               "controller",
       .more = "Each window starts from a state of its own, taken from the log. In a closed loop the controller is fed "
               "by what the model itself measures"},
      WindowOption(flags->window_s),
      TimeStepOption(flags->time_step_s),
      {.flag = "--nuisances",
       .value = &flags->nuisances,
       .help =
           "Fit what is no finding first: zero offsets, initial states, a command shift below one sample; as tune and "
           "diagnose do",
       .more = "Not in a closed loop, where nothing is fitted"},
      {.flag = "--fail-above",
       .value = &flags->fail_above,
       .range = Above(0, 0),
       .unset = "never",
       .help = "Exit status 1 when the error is above this",
       .more = "The error is the normalised one that is printed: root mean square over signals of RMSE by standard "
               "deviation"}};
  return {.name = "replay",
          .what = "Replay logged commands in simulation: predicted against measured, scores",
          .options = Join({LogOptions(flags->model),
                           own,
                           {FromOption(flags->model.from)},
                           EffectOptions(flags->model),
                           {FolderOption(flags->common, "result.json, report.html, traces and model.xml")},
                           ProfileOptions(flags->common),
                           CommonOptions(flags->common)}),
          .example =
              "gapscope replay models/qube/experiment.yaml log.csv --with cable_spring@arm --set "
              "cable_spring@arm.stiffness_n_m_per_rad=0.0012 --out out",
          .run = [flags] { return RunReplay(*flags); }};
}

}  // namespace gapscope::cli
