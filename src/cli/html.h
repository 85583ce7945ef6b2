// report.html of a command, by one call.
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

// Replays all logs with each model as the experiment says (mode, window) and writes `folder`/report.html. The missing
// torque is that of the first model, the parameters those of the last.
Status WriteReport(const std::string& folder, const std::string& json, const Experiment& experiment,
                   const ReportLogs& logs, const std::vector<ReportModel>& models, ThreadPool& pool);

// The same with traces that are there already: one list a label, in the order of the logs. `model`, `values` and
// `parameters` as in ReportSource.
Status WriteReport(const std::string& folder, const std::string& json, const Experiment& experiment,
                   const ReportLogs& logs, std::vector<ReportPrediction> predictions, const Model& model,
                   const std::vector<double>& values, const std::vector<Parameter>& parameters);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_HTML_H_
