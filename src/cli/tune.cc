#include <fmt/core.h>

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>
#include <set>

#include "src/cli/commands.h"
#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"
#include "src/log/foreign.h"
#include "src/report/json.h"
#include "src/report/tune_report.h"
#include "src/report/write_run.h"

namespace gapscope {

template <>
std::span<const EnumName<ObjectiveKind>> EnumNames<ObjectiveKind>() {
  static constexpr EnumName<ObjectiveKind> kNames[] = {
      {ObjectiveKind::kWindows, "windows"}, {ObjectiveKind::kFreeRun, "free_run"}, {ObjectiveKind::kBoth, "both"}};
  return kNames;
}

template <>
std::span<const EnumName<Normalization>> EnumNames<Normalization>() {
  static constexpr EnumName<Normalization> kNames[] = {{Normalization::kDeviation, "deviation"},
                                                       {Normalization::kRootMeanSquare, "rms"}};
  return kNames;
}

}  // namespace gapscope

namespace gapscope::cli {
namespace {

struct TuneFlags {
  CommonFlags common;
  ModelFlags model;
  std::vector<std::string> hold_out, free, freeze, fixed_nuisances;
  std::string optimizer = "lm";
  ObjectiveKind objective = ObjectiveKind::kBoth;
  Normalization normalization = Normalization::kDeviation;
  double window_s = 0, budget_s = 0, time_step_s = 0, huber = 4, tolerance = 1e-4;
  int starts = 2;
  bool resume = false, actuator = false, each_log = false;
};

// The model that --actuator asks for.
Status AddActuatorEffects(const TuneFlags& flags, ModelFlags* model) {
  GS_ASSIGN(const Session base, LoadSession(*model, flags.common));
  for (const EffectUse& use : ActuatorModel(*base.model->rig())) model->with.push_back(use.Text());
  return Ok();
}

// Indices of the parameters that are tuned, and of those that are where the logs know them.
Status ChooseParameters(const TuneFlags& flags, const Session& session, TuneOptions* options) {
  const std::vector<int> usual = session.model->FreeParameters();
  std::set<int> free(usual.begin(), usual.end()), if_known;
  for (std::size_t i = 0; i < session.model->parameters().size(); ++i) {
    if (session.model->parameters()[i].if_known) if_known.insert(static_cast<int>(i));
  }
  for (const auto& name : flags.free) {
    GS_ASSIGN(const int index, session.model->Find(name, "--free"));
    const Parameter& p = session.model->parameters()[index];
    if (!(p.low < p.high))
      return Error{.what = "the parameter '" + name + "' has no bounds to tune in",
                   .where = "--free",
                   .cure = "give it 'bounds' in " + session.experiment.path};
    free.insert(index);
    if_known.erase(index);
  }
  for (const auto& name : flags.freeze) {
    GS_ASSIGN(const int index, session.model->Find(name, "--freeze"));
    free.erase(index);
    if_known.erase(index);
  }
  options->free.assign(free.begin(), free.end());
  options->if_known.assign(if_known.begin(), if_known.end());
  return Ok();
}

Result<TuneOptions> OptionsOf(const TuneFlags& flags, const Session& session) {
  TuneOptions options{.window_s = flags.window_s > 0 ? flags.window_s : session.experiment.replay.window_s,
                      .normalization = flags.normalization,
                      .huber = flags.huber,
                      .time_step_s = flags.time_step_s,
                      .starts = flags.starts,
                      .resume = flags.resume};
  options.solve.optimizer = FindOptimizer(flags.optimizer)->name;
  options.solve.seed = flags.common.seed;
  options.solve.tolerance = flags.tolerance;
  options.objective = flags.objective;
  if (session.experiment.replay.mode == ReplayMode::kWindows && flags.objective == ObjectiveKind::kBoth)
    options.objective = ObjectiveKind::kWindows;
  for (const auto& nuisance : flags.fixed_nuisances) {
    if (nuisance == "offset") options.fit_offsets = false;
    if (nuisance == "shift") options.fit_shift = false;
    if (nuisance == "state") options.fit_states = false;
  }
  GS_RETURN_IF_ERROR(ChooseParameters(flags, session, &options));
  if (flags.budget_s > 0)
    options.solve.deadline.time =
        std::chrono::steady_clock::now() + std::chrono::microseconds(static_cast<long long>(1e6 * flags.budget_s));
  if (!flags.common.out.empty()) options.journal = std::filesystem::path(flags.common.out) / "journal.bin";
  if (flags.resume && flags.common.out.empty())
    return Error{
        .what = "nothing to resume from", .where = "--resume", .cure = "name the interrupted run's folder with --out"};
  return options;
}

void ShowProgress(double budget_s, ProgressLine& line, TuneOptions* options) {
  options->solve.progress = [&line, budget_s](const Progress& p) {
    line.Show({.stage = "fit", .done = static_cast<double>(p.evaluations), .best = p.best},
              fmt::format("cost {:.6g}, {} evaluations, {:.1f} s{}", p.best, p.evaluations, line.elapsed_s(),
                          budget_s > 0 ? fmt::format(" of {:.0f} s", budget_s) : ""));
  };
}

Status WriteTune(const std::string& out, const Session& session, const DataSplit& data, const TuneOptions& options,
                 const TuneSummary& summary, const TuneRun& run) {
  RunFiles files{.tables = TraceTables(summary.held_out, data.held_out)};
  GS_ASSIGN(files.model_xml, session.model->ToXml(summary.values, data.train.front().values, session.scales));
  ReportSource source = SourceOf(session.experiment, {data.train, data.held_out});
  source.content = PageOf(run);
  const auto nominal = [&](const std::vector<Recording>& recordings) {
    return Evaluate(*session.model, recordings, {session.values, StampShift{}}, session.experiment.replay.mode, options,
                    *session.pool);
  };
  source.predictions = {{"nominal", nominal(data.train)}, {"tuned", summary.train}};
  std::vector<LogReplay>&before = source.predictions[0].logs, &after = source.predictions[1].logs;
  std::ranges::move(nominal(data.held_out), std::back_inserter(before));
  after.insert(after.end(), summary.held_out.begin(), summary.held_out.end());
  source.model = session.model.get();
  source.values = session.values;
  source.parameters = session.model->parameters();
  files.report = &source;
  return WriteRun(out, ToJson(run), files);
}

std::vector<TuneRun::LogFit> FitAlone(const Session& session, const DataSplit& data, const TuneSummary& joint,
                                      const TuneOptions& options) {
  TuneOptions silent = options;
  silent.solve.progress = {};
  const LogFits fits = FitEachLog(*session.model, data.train, joint, silent, *session.pool);
  for (const auto& warning : fits.warnings) Print(stderr, "warning: {}\n", warning);
  return PerLogOf(fits, *session.model);
}

Result<int> RunTune(const TuneFlags& flags) {
  StageClock clock(flags.common);
  GS_ASSIGN(const HeldOutLogs logs, CombineHeldOut(flags.model.logs, flags.hold_out));
  ModelFlags model = flags.model;
  model.logs = logs.all;
  if (flags.actuator) GS_RETURN_IF_ERROR(AddActuatorEffects(flags, &model));
  GS_ASSIGN(Session session, LoadSession(model, flags.common));
  PrintFindings(session.recordings, flags.common.quiet);
  GS_ASSIGN(TuneOptions options, OptionsOf(flags, session));
  const DataSplit data = SplitData(std::move(session.recordings), logs.held_out);
  if (flags.each_log && data.train.size() < 2)
    return Error{.what = "how logs differ is not known of one log",
                 .where = "--each-log",
                 .actual = fmt::format("{} fitted", data.train.size()),
                 .allowed = "two logs or more that are not held out",
                 .cure = "give more logs, or leave --each-log out"};
  if (!options.resume) ForgetLogFits(options, data.train.size());
  clock.Enter("tune");
  const auto tuned = [&] {
    ProgressLine line(flags.common, &clock);
    if (line.live()) ShowProgress(flags.budget_s, line, &options);
    options.solve.deadline.stop = CatchInterrupts();
    return Tune(*session.model, data, session.values, options, *session.pool);
  }();
  if (!tuned.ok()) return tuned.error();
  clock.Enter("write");
  clock.Count(tuned.value().replays, 0);
  for (const auto& warning : tuned.value().warnings) Print(stderr, "warning: {}\n", warning);
  TuneRun run = TuneRunOf(tuned.value(), *session.model, flags.common.seed);
  if (flags.each_log) run.per_log = FitAlone(session, data, tuned.value(), options);
  if (!flags.common.out.empty())
    GS_RETURN_IF_ERROR(WriteTune(flags.common.out, session, data, options, tuned.value(), run));
  Print(stdout, "{}", flags.common.json ? JsonText(ToJson(run)) : ToTable(run, ConsoleOf(1)));
  return kDone;
}

}  // namespace

namespace {

// What is fitted and what is not.
std::vector<Option> FreedomOptions(TuneFlags& flags) {
  return {
      {.flag = "--hold-out",
       .value = &flags.hold_out,
       .stands_for = LogsNamed,
       .help = "A log to score on, not to fit; more than once",
       .more = "Without it every third log is held out, of two the second, of one its last 30 % of time; the result "
               "says which"},
      {.flag = "--free",
       .value = &flags.free,
       .help = "Tune this parameter although it is frozen; more than once",
       .more = "It needs bounds in the experiment file"},
      {.flag = "--freeze", .value = &flags.freeze, .help = "Do not tune this parameter; more than once"},
      {.flag = "--fix",
       .value = &flags.fixed_nuisances,
       .words = {"offset", "shift", "state"},
       .help = "Do not fit this nuisance: offset (per log and sensor), shift (of the commands, below a sample), state "
               "(initial); more than once",
       .more = "All three are fitted unless fixed, and are never a finding"},
      {.flag = "--actuator",
       .value = &flags.actuator,
       .help = "Fit an actuator model: adds delay, lag, torque-speed limit and friction where the model has none"},
      {.flag = "--each-log",
       .value = &flags.each_log,
       .help = "Then fit each log alone too, from there: how the parameters differ from log to log",
       .more = "Of the logs that are not held out. `export --draws` takes the differences of four logs or more for "
               "domain randomisation"}};
}

// What is minimised, and by what.
std::vector<Option> SolveOptionsOf(TuneFlags& flags) {
  return {{.flag = "--optimizer", .value = &flags.optimizer, .words = OptimizerNames(), .help = OptimizerHelp()},
          {.flag = "--objective",
           .value = ChoiceOf(flags.objective),
           .help = "What is matched: windows, free runs, or both",
           .more = "both: windows first, then free runs from there. An experiment whose mode is windows is fitted in "
                   "windows alone"},
          {.flag = "--normalize",
           .value = ChoiceOf(flags.normalization),
           .help = "Residuals are divided by each signal's standard deviation, or by its root mean square (rms)"},
          WindowOption(flags.window_s),
          TimeStepOption(flags.time_step_s),
          {.flag = "--tolerance",
           .value = &flags.tolerance,
           .range = Between(1e-9, 0.1),
           .help = "Stop when a step lowers the cost by less than this share"},
          {.flag = "--huber",
           .value = &flags.huber,
           .range = AtLeast(0),
           .help = "Weigh residuals beyond this many standard deviations down; 0: plain squares"},
          {.flag = "--starts",
           .value = &flags.starts,
           .range = Between(1, 1000),
           .help = "Starting points: the nominal values, then random ones",
           .more = "The best end is reported, and whether the ends agree"},
          {.flag = "--budget",
           .value = &flags.budget_s,
           .unit = "s",
           .range = Above(0, 0),
           .unset = "until it has converged",
           .help = "Time for the search; the best so far is reported when it is spent",
           .more = "Intervals and scores come after it: some replays more of every log"},
          {.flag = "--resume",
           .value = &flags.resume,
           .help = "Go on with the interrupted run in --out, to the same result",
           .more = "Each replay of a run is kept in --out/journal.bin, of --each-log in journal.log_N.bin; nothing is "
                   "computed twice"}};
}

}  // namespace

Command TuneCommand() {
  auto flags = std::make_shared<TuneFlags>();
  return {.name = "tune",
          .what = "Fit parameters until replayed trajectories match the hardware; score on logs not seen",
          .options = Join({LogOptions(flags->model),
                           FreedomOptions(*flags),
                           SolveOptionsOf(*flags),
                           {FromOption(flags->model.from)},
                           EffectOptions(flags->model),
                           {FolderOption(flags->common, "result.json, report.html, traces and model.xml")},
                           ProfileOptions(flags->common),
                           CommonOptions(flags->common)}),
          .example =
              "gapscope tune models/qube/experiment.yaml a.csv b.csv --hold-out c.csv --with coulomb_friction@arm "
              "--out tuned",
          .run = [flags] { return RunTune(*flags); }};
}

}  // namespace gapscope::cli
