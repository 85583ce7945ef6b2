#include "src/cli/session.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <iterator>
#include <optional>
#include <set>

#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/log/foreign.h"
#include "src/model/run_model.h"
#include "src/report/read_run.h"

namespace gapscope::cli {

std::vector<Option> PrintOptions(CommonFlags& flags) {
  return {
      {.flag = "--json",
       .value = &flags.json,
       .help = "Print the result as JSON on stdout, nothing else",
       .more = "Messages go to stderr either way. The JSON names its schema and the versions that made it"},
      {.flag = "--quiet", .value = &flags.quiet, .help = "No messages on stderr but errors"},
      {.flag = "--progress",
       .value = ChoiceOf(flags.progress),
       .help = "How progress and an error are said on stderr: a line for people, or a JSON object a line",
       .more = "json: {\"stage\", \"done\", \"total\", \"best\", \"elapsed_s\"} while it runs, null where it is not "
               "known, and {\"error\": {\"what\", \"where\", \"actual\", \"allowed\", \"cure\"}}. Other lines are "
               "messages for people"}};
}

std::vector<Option> CommonOptions(CommonFlags& flags) {
  return Join({PrintOptions(flags),
               {{.flag = "--jobs",
                 .value = &flags.jobs,
                 .range = Between(0, 1024),
                 .help = "Workers; 0: one per processor",
                 .more = "The result does not depend on it, to the last digit"},
                {.flag = "--seed",
                 .value = &flags.seed,
                 .help = "Seed of everything random",
                 .more = "The same seed and the same files give the same result"}}});
}

Option FolderOption(CommonFlags& flags, const std::string& holds) {
  return {.flag = "--out",
          .value = &flags.out,
          .unset = "nothing is written",
          .help = "Folder for " + holds,
          .more = "It is made where it is missing; files of an earlier run in it are overwritten"};
}

Option ExperimentOption(std::string& path) {
  return {.flag = "experiment",
          .value = &path,
          .required = true,
          .help = "Experiment file (YAML)",
          .more = "It binds logs to a model; docs/reference/experiment.md tells its keys, `gapscope init` drafts one"};
}

Option WhileOption(std::string& column) {
  return {.flag = "--while",
          .value = &column,
          .unset = "the experiment's, else all rows",
          .help = "Use a log's rows until this column falls to zero (\"torque_enable\")"};
}

std::vector<Option> LogOptions(ModelFlags& flags) {
  return {
      ExperimentOption(flags.experiment),
      {.flag = "logs",
       .value = &flags.logs,
       .stands_for = LogsNamed,
       .required = true,
       .help = "Hardware logs",
       .more =
           "CSV or what else docs/reference/experiment.md names; they are read by path and may lie anywhere. A LeRobot "
           "dataset is as many logs as it has episodes, dataset#0:20 twenty of them, dataset#3 one"},
      WhileOption(flags.while_column)};
}

std::vector<Option> ValueOptions(std::vector<std::string>& set, std::vector<std::string>& params) {
  return {{.flag = "--set",
           .value = &set,
           .help = "Override a parameter: NAME=VALUE, more than once",
           .more = "In the parameter's own unit; it is written over --params. A name that does not exist is refused "
                   "with the nearest one that does"},
          {.flag = "--params",
           .value = &params,
           .help = "Parameter values of a YAML file or of an earlier result, more than once",
           .more = "Lines `name: value`, or --out of tune, diagnose or replay, whose effects --with must name; a later "
                   "file is written over an earlier one"}};
}

std::vector<Option> EffectOptions(ModelFlags& flags) {
  return Join(
      {{{.flag = "--with",
         .value = &flags.with,
         .help = "Add an effect: EFFECT[@JOINT|ACTUATOR|SIGNAL|all], more than once, of " +
                 gapscope::Join(EffectNames()) + ", or a candidate of the experiment file",
         .more = "docs/reference/effects.md lists the effects, docs/reference/experiment.md tells of candidates. "
                 "Without a place it goes where it can act, if there is one such place; its parameters are then known "
                 "to --set as EFFECT@PLACE.NAME"}},
       ValueOptions(flags.set, flags.params)});
}

Option FromOption(std::string& from) {
  return {.flag = "--from",
          .value = &from,
          .help = "Start from the model of an earlier result: --out of diagnose, tune or replay",
          .more =
              "Its effects are added and its values taken over; --with adds to them, --params and --set are written "
              "over them"};
}

Option WindowOption(double& window_s) {
  return {.flag = "--window",
          .value = &window_s,
          .unit = "s",
          .range = Above(0, 0),
          .unset = "the experiment's",
          .help = "Length of a window",
          .more =
              "Windows follow each other, each from a state of its own: short ones see local error, long ones what "
              "accumulates"};
}

Option TimeStepOption(double& time_step_s) {
  return {.flag = "--time-step",
          .value = &time_step_s,
          .unit = "s",
          .range = Above(0, 0),
          .unset = "chosen so that halving it changes the error by less than 1 %",
          .help = "Largest simulation step",
          .more = "A step never reaches over a logged row, so steps are parts of the log's sample time"};
}

namespace {

Status CheckOneRig(const std::vector<Recording>& recordings) {
  const Recording* named = nullptr;
  for (const Recording& recording : recordings) {
    if (recording.rig.empty()) continue;
    if (!named) named = &recording;
    if (recording.rig != named->rig)
      return Error{.what = "logs of different rigs",
                   .where = recording.log_path,
                   .actual = "'" + recording.rig + "', while " + named->log_path + " is of '" + named->rig + "'",
                   .allowed = "logs of one rig, which one model can explain",
                   .cure = "give each rig's logs to a run of its own, with its own experiment file"};
  }
  return Ok();
}

}  // namespace

Result<std::vector<Recording>> LoadRecordings(const Experiment& experiment, const std::vector<std::string>& paths,
                                              ThreadPool& pool) {
  std::vector<Result<Recording>> loaded(paths.size(), Error{.what = "not loaded"});
  pool.ForEach(paths.size(), [&](std::size_t i, int) { loaded[i] = LoadRecording(experiment, paths[i]); });
  std::vector<Recording> recordings;
  for (auto& result : loaded) {
    if (!result.ok()) return result.error();
    recordings.push_back(std::move(result).value());
  }
  GS_RETURN_IF_ERROR(CheckOneRig(recordings));
  return recordings;
}

Result<std::pair<std::string, double>> ParseAssignment(const std::string& text, const std::string& flag) {
  const std::size_t equal = text.find('=');
  double value = 0;
  const char* end = text.data() + text.size();
  const auto parsed = equal == std::string::npos ? std::from_chars_result{text.data(), std::errc::invalid_argument}
                                                 : std::from_chars(text.data() + equal + 1, end, value);
  if (parsed.ec != std::errc() || parsed.ptr != end || !std::isfinite(value)) {
    return Error{.what = "not NAME=VALUE",
                 .where = flag,
                 .actual = "'" + text + "'",
                 .allowed = "a parameter's name, '=', a finite number"};
  }
  return std::pair{text.substr(0, equal), value};
}

namespace {

Status SetValue(const Model& model, const std::string& name, double value, const std::string& where,
                std::vector<double>* values) {
  GS_ASSIGN(const int index, model.Find(name, where));
  (*values)[index] = value;
  return Ok();
}

// The values of a result's model, whose effects must be in this one. Rig's sizes are this one's own.
Status TakeValues(const Model& model, const RunModel& held, const std::string& where, std::vector<double>* values) {
  for (const EffectUse& use : held.effects) {
    if (std::ranges::find(model.effects(), use) == model.effects().end())
      return Error{.what = "the result has an effect that this model lacks",
                   .where = "--params " + where,
                   .actual = use.Text(),
                   .cure = "add it: --with " + use.Text()};
  }
  for (const auto& [name, value] : held.values) {
    if (!IsScaleName(name)) GS_RETURN_IF_ERROR(SetValue(model, name, value, where, values));
  }
  return Ok();
}

// Of a YAML file, or of a result.
Status TakeFile(const Model& model, const std::string& path, std::vector<double>* values) {
  std::error_code failure;
  if (path.ends_with(".json") || std::filesystem::is_directory(path, failure)) {
    GS_ASSIGN(const RunModel held, LoadRunModel(path));
    return TakeValues(model, held, path, values);
  }
  GS_ASSIGN(const auto numbers, LoadParameterValues(path));
  for (const auto& [name, value] : numbers) GS_RETURN_IF_ERROR(SetValue(model, name, value, path, values));
  return Ok();
}

}  // namespace

Status OverrideValues(const Model& model, const std::vector<std::string>& params, const std::vector<std::string>& set,
                      std::vector<double>* values) {
  for (const auto& file : params) GS_RETURN_IF_ERROR(TakeFile(model, file, values));
  for (const auto& text : set) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--set"));
    GS_RETURN_IF_ERROR(SetValue(model, assignment.first, assignment.second, "--set " + text, values));
  }
  return Ok();
}

int WorkersOf(const CommonFlags& flags) { return flags.jobs > 0 ? flags.jobs : DefaultWorkers(); }

namespace {

// The effects of an earlier result, then those that are given besides.
std::vector<std::string> EffectsOf(const RunModel& earlier, const std::vector<std::string>& given) {
  const std::vector<std::string> taken = Collect(earlier.effects, &EffectUse::Text);
  std::vector<std::string> all = taken;
  std::ranges::copy_if(given, std::back_inserter(all),
                       [&](const std::string& one) { return std::ranges::find(taken, one) == taken.end(); });
  return all;
}

}  // namespace

Result<Session> LoadSession(const ModelFlags& flags, const CommonFlags& common) {
  RunModel earlier;
  if (!flags.from.empty()) {
    GS_ASSIGN(earlier, LoadRunModel(flags.from));
  }
  Session session;
  session.pool = std::make_unique<ThreadPool>(WorkersOf(common));
  GS_ASSIGN(session.experiment, LoadExperiment(flags.experiment));
  if (!flags.while_column.empty()) session.experiment.replay.while_column = flags.while_column;
  {
    ProgressLine line(common);
    ShowReading(flags.logs, &line);
    GS_ASSIGN(session.recordings, LoadRecordings(session.experiment, flags.logs, *session.pool));
  }
  GS_ASSIGN(session.model, Model::Load(session.experiment));
  PrintLeftOut(*session.model->rig());
  if (const auto with = EffectsOf(earlier, flags.with); !with.empty()) {
    session.scales = EstimateScales(*session.model, session.recordings);
    GS_ASSIGN(const std::vector<EffectUse> uses, ParseEffects(with, *session.model->rig()));
    GS_ASSIGN(session.model, Model::Build(session.model->rig(), uses, session.scales));
  }
  session.values = session.model->Nominal();
  GS_RETURN_IF_ERROR(TakeValues(*session.model, earlier, flags.from, &session.values));
  GS_RETURN_IF_ERROR(OverrideValues(*session.model, flags.params, flags.set, &session.values));
  return session;
}

Result<HeldOutLogs> CombineHeldOut(const std::vector<std::string>& logs, const std::vector<std::string>& hold_out) {
  // One file may be spelled in two ways.
  const auto file = [](const std::string& path) {
    std::error_code failure;
    const auto canonical = std::filesystem::weakly_canonical(path, failure);
    return failure ? std::filesystem::path(path) : canonical;
  };
  HeldOutLogs result{.all = logs};
  std::set<std::filesystem::path> known, held;
  for (const auto& log : logs) known.insert(file(log));
  for (const auto& log : hold_out) {
    held.insert(file(log));
    if (known.insert(file(log)).second) result.all.push_back(log);
  }
  for (std::size_t i = 0; i < result.all.size(); ++i) {
    if (held.contains(file(result.all[i]))) result.held_out.push_back(i);
  }
  if (result.held_out.size() == result.all.size()) {
    return Error{.what = "every log is held out",
                 .where = "--hold-out",
                 .allowed = "at least one log to fit",
                 .cure = "add logs before --hold-out"};
  }
  return result;
}

void PrintLeftOut(const Rig& rig) {
  for (const LeftOutCandidate& candidate : rig.left_out()) Print(stderr, "warning: {}\n", candidate.Text());
}

void PrintFindings(const std::vector<Recording>& recordings, bool quiet) {
  if (quiet) return;
  for (const auto& recording : recordings) {
    for (const auto& finding : recording.findings) Print(stderr, "{}: {}\n", recording.log_path, finding.text);
  }
}

}  // namespace gapscope::cli
