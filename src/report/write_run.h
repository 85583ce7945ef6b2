// The one writer of --out: what a run leaves in its folder, each file under a temporary name first and then renamed.
#ifndef GAPSCOPE_REPORT_WRITE_RUN_H_
#define GAPSCOPE_REPORT_WRITE_RUN_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/report/csv.h"

namespace gapscope {

struct ReportSource;  // html_report.h

// traces/LOG.csv of each log, for PlotJuggler: __time, command/ACTUATOR, measured/SIGNAL, predicted/SIGNAL. The tables
// point into the arguments.
std::vector<RunTable> TraceTables(const std::vector<LogReplay>& logs, const std::vector<Recording>& recordings);

// All but the result itself; what is empty is not written.
struct RunFiles {
  std::string model_xml;  // the run's model, as MJCF
  std::vector<RunTable> tables;
  const ReportSource* report = nullptr;
  std::string next_experiment;  // a diagnosis' proposed input, as CSV
};
inline constexpr const char* kNextExperimentFile = "next_experiment.csv";

// Writes `folder`/result.json (the bytes that --json prints), model.xml, the tables, next_experiment.csv and
// report.html. Errors: those of WriteFile; files written before stay.
Status WriteRun(const std::string& folder, const nlohmann::ordered_json& result, const RunFiles& files = {});

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_WRITE_RUN_H_
