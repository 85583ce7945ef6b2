#include <fmt/core.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/session.h"
#include "src/core/file.h"
#include "src/draft/draft.h"
#include "src/log/foreign.h"

namespace gapscope::cli {
namespace {

struct InitFlags {
  std::string model, servo, out;
  std::vector<std::string> logs;
  bool quiet = false;
};

// "kp=K,kd=D[,limit=T][,armature=A]".
Result<ServoSaid> ParseServo(const std::string& text) {
  const Error wrong{.what = "not gains of a servo",
                    .where = "--servo",
                    .actual = "'" + text + "'",
                    .allowed =
                        "kp=K,kd=D[,limit=T][,armature=A] in N m/rad, N m s/rad, N m, kg m2, above zero; kd may "
                        "be zero"};
  ServoSaid said;
  bool has_kd = false;
  for (std::size_t at = 0; at <= text.size();) {
    const std::size_t end = std::min(text.find(',', at), text.size());
    const auto pair = ParseAssignment(text.substr(at, end - at), "--servo");
    if (!pair.ok()) return wrong;
    const auto& [key, value] = pair.value();
    if (key == "kp" && value > 0) {
      said.kp = value;
    } else if (key == "kd" && value >= 0) {
      said.kd = value;
      has_kd = true;
    } else if (key == "limit" && value > 0) {
      said.limit = value;
    } else if (key == "armature" && value > 0) {
      said.armature = value;
    } else {
      return wrong;
    }
    at = end + 1;
  }
  if (said.kp == 0 || !has_kd) return wrong;
  return said;
}

// Takes a file away again.
class Removed {
 public:
  explicit Removed(std::string path) : path_(std::move(path)) {}
  ~Removed() {
    std::error_code ignored;
    std::filesystem::remove(path_, ignored);
  }
  Removed(const Removed&) = delete;
  Removed& operator=(const Removed&) = delete;

 private:
  std::string path_;
};

constexpr std::size_t kLookedAt = 8;  // logs, for the gains of servos
constexpr double kTried_s = 1;        // of the first log is replayed

// The first second of a recording.
Recording Beginning(Recording recording) {
  std::size_t rows = 2;
  while (rows < recording.rows() && recording.time_s[rows] < kTried_s) ++rows;
  recording.time_s.resize(rows);
  for (auto& command : recording.commands) command.values.resize(rows);
  for (auto& measured : recording.measured) measured.values.resize(rows);
  return recording;
}

// The draft must hold for every log that was given, and move.
Status Try(const std::string& experiment_path, const std::vector<DraftLog>& read,
           const std::vector<std::string>& logs) {
  GS_ASSIGN(const Experiment experiment, LoadExperiment(experiment_path));
  GS_ASSIGN(const std::shared_ptr<const Model> model, Model::Load(experiment));
  GS_ASSIGN(Recording first, BindLog(experiment, read.front().log));
  for (std::size_t i = 1; i < logs.size(); ++i) {
    const auto loads = i < read.size() ? BindLog(experiment, read[i].log) : LoadRecording(experiment, logs[i]);
    if (!loads.ok()) return loads.error();
  }
  ThreadPool pool(1);
  const ReplayResult replay = Replay(*model, {Beginning(std::move(first))}, {.values = model->Nominal()}, pool);
  if (replay.logs.front().outcome != Outcome::kDiverged) return Ok();
  return Error{.what = "the drafted model diverges",
               .where = logs.front(),
               .actual = fmt::format("after {:.3g} s", replay.logs.front().diverged_at_s),
               .cure = "are units and signs right? Where gains are made up: say them by --servo kp=K,kd=D"};
}

Status TryDraft(const Draft& draft, const std::vector<DraftLog>& logs, const InitFlags& flags) {
  GS_ASSIGN(const std::string path,
            TemporaryBeside((std::filesystem::temp_directory_path() / "gapscope-init").string()));
  const Removed removed(path);
  GS_RETURN_IF_ERROR(WriteFile(path, draft.Yaml(std::filesystem::absolute(flags.model).string())));
  const Status tried = Try(path, logs, flags.logs);
  if (tried.ok()) return Ok();
  Error error = tried.error();
  error.what = "the draft does not replay: " + error.what;
  for (std::string* text : {&error.what, &error.where, &error.actual, &error.cure}) {
    if (const std::size_t at = text->find(path); at != std::string::npos) text->replace(at, path.size(), "the draft");
  }
  return error;
}

Result<int> RunInit(const InitFlags& flags) {
  DraftOptions options;
  if (!flags.servo.empty()) {
    GS_ASSIGN(options.servo, ParseServo(flags.servo));
  }
  std::vector<DraftLog> logs;
  for (const std::string& path : flags.logs) {
    if (logs.size() == kLookedAt) break;
    GS_ASSIGN(Log log, ReadLog(path, {}));
    GS_ASSIGN(Timeline timeline, BuildTimeline(log, {}));
    logs.push_back({std::move(log), std::move(timeline)});
  }
  GS_ASSIGN(const Draft draft, DraftExperiment(flags.model, logs, options));
  GS_RETURN_IF_ERROR(TryDraft(draft, logs, flags));
  // The experiment names the model as seen from its own folder.
  const std::filesystem::path folder =
      flags.out.empty() ? std::filesystem::current_path() : std::filesystem::absolute(flags.out).parent_path();
  std::error_code failed;
  const std::filesystem::path relative =
      std::filesystem::relative(std::filesystem::absolute(flags.model), folder, failed);
  const std::string yaml = draft.Yaml(failed ? flags.model : relative.string());
  if (flags.out.empty()) {
    fmt::print("{}", yaml);
  } else {
    GS_RETURN_IF_ERROR(WriteFile(flags.out, yaml));
  }
  if (flags.quiet) return kDone;
  for (const auto& doubt : draft.unsure) Print(stderr, "unsure: {}\n", doubt);
  Print(stderr, "{} of {} joints measured, {} actuators commanded\n", draft.measured, draft.joints, draft.commanded);
  if (!flags.out.empty())
    Print(stderr, "wrote {}; {} thing{} to check. Next: gapscope replay {} {}\n", flags.out, draft.unsure.size(),
          draft.unsure.size() == 1 ? "" : "s", flags.out, flags.logs.front());
  return kDone;
}

}  // namespace

Command InitCommand() {
  auto flags = std::make_shared<InitFlags>();
  return {.name = "init",
          .what = "Draft an experiment file for a robot of your own",
          .options = {{.flag = "model", .value = &flags->model, .required = true, .help = "MJCF file"},
                      {.flag = "logs",
                       .value = &flags->logs,
                       .stands_for = LogsNamed,
                       .required = true,
                       .help = "Hardware logs; the first one is looked at, for the gains of servos the first eight",
                       .more = "The draft is then tried on all of them. docs/reference/init.md tells how columns are "
                               "paired"},
                      {.flag = "--servo",
                       .value = &flags->servo,
                       .unset = "by regression where the log allows it, else made up and marked",
                       .help = "Gains of the servos that are added to an MJCF without actuators: "
                               "kp=K,kd=D[,limit=T][,armature=A]",
                       .more = "N m/rad, N m s/rad, N m, kg m2; of all of them alike"},
                      {.flag = "--out",
                       .value = &flags->out,
                       .unset = "stdout",
                       .help = "File to write",
                       .more = "Paths in it are as seen from its folder. Nothing is written when the draft does not "
                               "load or replay"},
                      {.flag = "--quiet",
                       .value = &flags->quiet,
                       .help = "Do not list what is unsure",
                       .more = "Otherwise each guess that needs a look is told on stderr"}},
          .example = "gapscope init robot.xml run1.csv --out robot.yaml",
          .run = [flags] { return RunInit(*flags); }};
}

}  // namespace gapscope::cli
