// What the commands' report.html have in common.
#ifndef GAPSCOPE_CLI_HTML_H_
#define GAPSCOPE_CLI_HTML_H_

#include <memory>
#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/report/html_report.h"

namespace gapscope::cli {

// The program's own command line, as one would type it again.
void SetCommandLine(int argc, char** argv);
const std::string& CommandLine();
// In single quotes where a shell would take it apart.
std::string ShellQuoted(const std::string& word);

// A model whose predictions the report shows.
struct ReportModel {
  std::string label;
  std::shared_ptr<const Model> model;
  std::vector<double> values;
};

// Logs in the order of `train`, then `held_out`.
struct ReportLogs {
  const std::vector<Recording>& train;
  const std::vector<Recording>& held_out;
};

// What a page needs of all commands: command line, experiment, logs. They must outlive it.
ReportSource SourceOf(const Experiment& experiment, const ReportLogs& logs);

// All logs replayed with each model as the experiment says (mode, window), from where they began as far as that can be
// fitted: initial states and zero offsets.
std::vector<ReportPrediction> Predict(const Experiment& experiment, const ReportLogs& logs,
                                      const std::vector<ReportModel>& models, ThreadPool& pool);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_HTML_H_
