#include "src/cli/html.h"

#include <algorithm>

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

std::vector<ReportPrediction> Predict(const Experiment& experiment, const ReportLogs& logs,
                                      const std::vector<ReportModel>& models, ThreadPool& pool) {
  std::vector<ReportPrediction> predictions;
  for (const auto& model : models) {
    ReportPrediction prediction{.label = model.label, .logs = {}};
    const ReplayOptions options{
        .mode = experiment.replay.mode, .window_s = experiment.replay.window_s, .values = model.values};
    for (const auto* part : {&logs.train, &logs.held_out}) {
      if (part->empty()) continue;
      ReplayResult result = Replay(*model.model, *part, options, pool);
      std::move(result.logs.begin(), result.logs.end(), std::back_inserter(prediction.logs));
    }
    predictions.push_back(std::move(prediction));
  }
  return predictions;
}

}  // namespace gapscope::cli
