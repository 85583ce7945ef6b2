// A result as one HTML file that opens from disk with no network: src/report/html/ holds page, style and script,
// embedded at build time with dygraphs.
#ifndef GAPSCOPE_REPORT_HTML_REPORT_H_
#define GAPSCOPE_REPORT_HTML_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/compare/torque_curve.h"
#include "src/report/page_content.h"

namespace gapscope {

// What one model predicted.
struct ReportPrediction {
  std::string label;            // "nominal", "tuned"
  std::vector<LogReplay> logs;  // by recording; one without signals was not predicted
};

// What one effect does, beside what is missing without it.
struct EffectCurve {
  std::string title;  // "Coulomb friction on arm"
  TorqueCurve curve;
};

// What a page shows beside the result.
struct ReportSource {
  PageContent content;       // of the same result
  std::string command_line;  // as it was given
  const Experiment* experiment = nullptr;
  std::vector<const Recording*> recordings;
  std::vector<bool> held_out;  // by recording; empty: none
  bool by_windows = false;     // of each recording every third window is held out instead
  std::vector<ReportPrediction> predictions;
  std::vector<EffectCurve> curves;
  // Its missing torque is mapped, and it tells which command drives what. Null: no map.
  const Model* model = nullptr;
  std::vector<double> values;
  // Of the result's model: nominal values, bounds and units that stand beside the fitted values.
  std::vector<Parameter> parameters;
};

// Up to so many signals are drawn in full below each other. Of more a page has small pictures, the worst first, and
// draws in full what is picked.
inline constexpr std::size_t kFewSignals = 4;

// `result`: of replay, tune or diagnose, the value that --json prints. Each trace is thinned by ExtremeRows, so that a
// page's traces are about `most_numbers` numbers in all, 9 bytes each.
std::string ReportHtml(const nlohmann::ordered_json& result, const ReportSource& source,
                       std::size_t most_numbers = 400000);

// Writes `folder`/report.html. A video.mp4 that is already there is shown in it.
Status WriteReportHtml(const std::string& folder, const nlohmann::ordered_json& result, const ReportSource& source);

// Shows `video`, a file beside the report, in a report that was written before. Does nothing, and says false, where
// there is no report.
Result<bool> AttachVideo(const std::string& report_path, const std::string& video);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_HTML_REPORT_H_
