// What the results of several commands have in common, as JSON. A result stays a value until its command prints it or
// writes it; text is never parsed back on the way.
#ifndef GAPSCOPE_REPORT_JSON_H_
#define GAPSCOPE_REPORT_JSON_H_

#include <nlohmann/json_fwd.hpp>
#include <vector>

#include "src/compare/comparison.h"
#include "src/report/run.h"

namespace gapscope {

// Whether a result says how long it took: what is compared or kept by content must not.
enum class Timing { kInclude, kLeaveOut };

// Not a number and infinity have no place in JSON: null.
nlohmann::ordered_json JsonNumber(double value);
nlohmann::ordered_json JsonScore(const SignalScore& score);
nlohmann::ordered_json JsonConditions(const std::vector<ConditionShare>& shares);
nlohmann::ordered_json JsonEffects(const std::vector<EffectUse>& effects);  // [{"name": ..., "on": ...}]
nlohmann::ordered_json JsonModel(const RunModel& model);                    // read again by ReadRunModel
nlohmann::ordered_json JsonVersions(const RunInfo& info = {});
const char* OutcomeName(Outcome outcome);  // "completed", "diverged"

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_JSON_H_
