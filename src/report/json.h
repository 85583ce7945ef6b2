// What the results of several commands have in common, as JSON. A result stays a value until its command prints it or
// writes it; text is never parsed back on the way.
#ifndef GAPSCOPE_REPORT_JSON_H_
#define GAPSCOPE_REPORT_JSON_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
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
// As it is printed and written, with a line break at the end. What is no UTF-8 becomes U+FFFD; what could hide
// something (MadeVisible) is escaped.
std::string JsonText(const nlohmann::ordered_json& json);
// On one line, as a page's script has it: "</script>" must not end it early, whatever a file is called, and what could
// hide something is read as its escape.
std::string ScriptText(const nlohmann::ordered_json& json);
const char* OutcomeName(Outcome outcome);  // "completed", "diverged"

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_JSON_H_
