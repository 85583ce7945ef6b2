#include "src/cli/session.h"

#include <fmt/core.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <cstdio>
#include <filesystem>
#include <functional>
#include <optional>
#include <set>

#include "src/core/names.h"

namespace gapscope::cli {

namespace {

// `allowed` of a finite number that `good` accepts; `name` stands in the help.
CLI::Validator Finite(const std::string& allowed, const std::string& name, std::function<bool(double)> good) {
  return CLI::Validator(
      [allowed, good = std::move(good)](std::string& text) {
        double value = 0;
        const auto [end, code] = std::from_chars(text.data(), text.data() + text.size(), value);
        const bool number = code == std::errc() && end == text.data() + text.size() && std::isfinite(value);
        return number && good(value) ? std::string() : "'" + text + "' is not a finite number " + allowed;
      },
      name);
}

}  // namespace

CLI::Validator FinitePositive() {
  return Finite("above zero", "POSITIVE", [](double value) { return value > 0; });
}

CLI::Validator FiniteNonNegative() {
  return Finite("of at least zero", "NONNEGATIVE", [](double value) { return value >= 0; });
}

CLI::Validator FiniteIn(double low, double high) {
  const std::string range = fmt::format("{:g} - {:g}", low, high);
  return Finite("in " + range, "FLOAT in [" + range + "]",
                [low, high](double value) { return value >= low && value <= high; });
}

void AddCommonFlags(CLI::App& command, CommonFlags& flags, bool writes_folder) {
  command.add_flag("--json", flags.json, "Print the result as JSON on stdout, nothing else");
  command.add_flag("--quiet", flags.quiet, "No messages on stderr but errors");
  command.add_option("--jobs", flags.jobs, "Workers; 0: one per processor. The result does not depend on it")
      ->check(CLI::Range(0, 1024));
  command.add_option("--seed", flags.seed, "Seed of everything random");
  if (writes_folder)
    command.add_option("--out", flags.out, "Folder for result.json, report.html, traces and model.xml");
}

namespace {
void AddWhileFlag(CLI::App& command, ModelFlags& flags) {
  command.add_option("--while", flags.while_column,
                     "Use a log's rows until this column falls to zero (\"torque_enable\")");
}
}  // namespace

void AddModelFlags(CLI::App& command, ModelFlags& flags, bool effects) {
  command.add_option("experiment", flags.experiment, "Experiment file (YAML)")->required();
  command.add_option("logs", flags.logs, "Hardware logs")->required();
  if (effects) {
    AddEffectFlags(command, flags);
  } else {
    AddWhileFlag(command, flags);
  }
}

void AddEffectFlags(CLI::App& command, ModelFlags& flags) {
  AddWhileFlag(command, flags);
  command.add_option("--with", flags.with, "Add an effect: EFFECT[@JOINT|ACTUATOR|SIGNAL], of " + Join(EffectNames()))
      ->allow_extra_args(false);
  command.add_option("--set", flags.set, "Override a parameter: NAME=VALUE")->allow_extra_args(false);
  command.add_option("--params", flags.params, "YAML file of parameter values")->allow_extra_args(false);
}

Result<std::vector<Recording>> LoadRecordings(const Experiment& experiment, const std::vector<std::string>& paths,
                                              ThreadPool& pool) {
  std::vector<std::optional<Result<Recording>>> loaded(paths.size());
  pool.ForEach(paths.size(), [&](std::size_t i, int) { loaded[i] = LoadRecording(experiment, paths[i]); });
  std::vector<Recording> recordings;
  for (auto& result : loaded) {
    if (!result->ok()) return result->error();
    recordings.push_back(std::move(*result).value());
  }
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

Status OverrideValues(const Model& model, const std::vector<std::string>& params, const std::vector<std::string>& set,
                      std::vector<double>* values) {
  for (const auto& file : params) {
    GS_ASSIGN(const auto numbers, LoadParameterValues(file));
    for (const auto& [name, value] : numbers) {
      GS_ASSIGN(const int index, model.Find(name, file));
      (*values)[index] = value;
    }
  }
  for (const auto& text : set) {
    GS_ASSIGN(const auto assignment, ParseAssignment(text, "--set"));
    GS_ASSIGN(const int index, model.Find(assignment.first, "--set " + text));
    (*values)[index] = assignment.second;
  }
  return Ok();
}

Result<Session> LoadSession(const ModelFlags& flags, const CommonFlags& common) {
  Session session;
  session.pool = std::make_unique<ThreadPool>(common.jobs > 0 ? common.jobs : DefaultWorkers());
  GS_ASSIGN(session.experiment, LoadExperiment(flags.experiment));
  if (!flags.while_column.empty()) session.experiment.replay.while_column = flags.while_column;
  GS_ASSIGN(session.recordings, LoadRecordings(session.experiment, flags.logs, *session.pool));
  GS_ASSIGN(session.model, Model::Load(session.experiment));
  if (!flags.with.empty()) {
    session.scales = EstimateScales(*session.model, session.recordings);
    GS_ASSIGN(const std::vector<EffectUse> uses, ParseEffects(flags.with, *session.model->rig()));
    GS_ASSIGN(session.model, Model::Build(session.model->rig(), uses, session.scales));
  }
  session.values = session.model->Nominal();
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

void PrintFindings(const std::vector<Recording>& recordings, bool quiet) {
  if (quiet) return;
  for (const auto& recording : recordings) {
    for (const auto& finding : recording.findings) fmt::print(stderr, "{}: {}\n", recording.log_path, finding.text);
  }
}

}  // namespace gapscope::cli
