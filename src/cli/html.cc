#include "src/cli/html.h"

#include <algorithm>
#include <iterator>
#include <optional>

#include "src/tune/tune.h"

namespace gapscope::cli {
namespace {

std::string& Line() {
  static std::string line;
  return line;
}

}  // namespace

std::string ShellQuoted(const std::string& word) {
  const bool plain = !word.empty() && std::all_of(word.begin(), word.end(), [](unsigned char c) {
    return std::isalnum(c) || std::string_view("_-./@=:,+%").find(static_cast<char>(c)) != std::string_view::npos;
  });
  if (plain) return word;
  std::string quoted = "'";
  for (const char c : word) c == '\'' ? quoted += "'\\''" : quoted += c;
  return quoted + "'";
}

void SetCommandLine(int argc, char** argv) {
  Line() = "gapscope";
  for (int i = 1; i < argc; ++i) Line().append(" ").append(ShellQuoted(argv[i]));
}
const std::string& CommandLine() { return Line(); }

ReportSource SourceOf(const Experiment& experiment, const ReportLogs& logs) {
  ReportSource source{.command_line = CommandLine(), .experiment = &experiment};
  for (const auto& recording : logs.train) source.recordings.push_back(&recording), source.held_out.push_back(false);
  for (const auto& recording : logs.held_out) source.recordings.push_back(&recording), source.held_out.push_back(true);
  return source;
}

namespace {

// How each log began is fitted too, as errors have it: of a log that begins in full motion its first samples say too
// little to run on from there. Of long logs, or of many joints, that would take long, and says little of the rest.
std::vector<LogReplay> FromWhereTheyBegan(const ReportModel& model, const std::vector<Recording>& logs,
                                          const ReplayDefaults& replay, ThreadPool& pool) {
  constexpr double kLong_s = 120;  // of one joint
  const auto joints = static_cast<double>(model.model->compiled().nv);
  const bool is_long = std::ranges::any_of(logs, [&](const Recording& r) { return r.duration_s() * joints > kLong_s; });
  if (!is_long)
    return Evaluate(*model.model, logs, {model.values, std::nullopt}, replay.mode, {.window_s = replay.window_s}, pool);
  return Replay(*model.model, logs, {.mode = replay.mode, .window_s = replay.window_s, .values = model.values}, pool)
      .logs;
}

}  // namespace

std::vector<ReportPrediction> Predict(const Experiment& experiment, const ReportLogs& logs,
                                      const std::vector<ReportModel>& models, ThreadPool& pool) {
  std::vector<ReportPrediction> predictions;
  for (const auto& model : models) {
    ReportPrediction prediction{.label = model.label, .logs = {}};
    for (const auto* part : {&logs.train, &logs.held_out}) {
      if (part->empty()) continue;
      std::ranges::move(FromWhereTheyBegan(model, *part, experiment.replay, pool), std::back_inserter(prediction.logs));
    }
    predictions.push_back(std::move(prediction));
  }
  return predictions;
}

}  // namespace gapscope::cli
