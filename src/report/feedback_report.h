// A designed state feedback for people and programs: console table, JSON (gapscope.design.feedback/1).
#ifndef GAPSCOPE_REPORT_FEEDBACK_REPORT_H_
#define GAPSCOPE_REPORT_FEEDBACK_REPORT_H_

#include <complex>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/report/run.h"

namespace gapscope {

struct FeedbackRun {
  RunInfo info;
  std::vector<std::string> states;
  std::vector<double> gain;  // by state; command = -(sum of gain x state)
  std::vector<std::complex<double>> open_poles, closed_poles;
};

nlohmann::ordered_json ToJson(const FeedbackRun& run);
std::string ToTable(const FeedbackRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_FEEDBACK_REPORT_H_
