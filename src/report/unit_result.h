// What a fleet keeps of one unit's result: little enough that many fit into memory, robot by robot.
#ifndef GAPSCOPE_REPORT_UNIT_RESULT_H_
#define GAPSCOPE_REPORT_UNIT_RESULT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/core/statistics.h"

namespace gapscope {

struct UnitResult {
  struct Size {
    std::string name, unit;
    double value = kNaN, low = kNaN, high = kNaN;  // low, high: 95 % interval; NaN: none is stated
  };
  struct Said {
    std::string name;    // "coulomb_friction@arm"
    std::string answer;  // present, absent, unseen
    double probability = kNaN;
  };
  std::string id, time;
  std::string state = "done";  // failed, missing: there is no result, and `error` says why
  std::string error;
  std::string report;   // its page, relative to the fleet's; empty: none
  std::string verdict;  // of a diagnosis
  double probability = kNaN;
  // Errors held out: of the nominal model, of the tuned or diagnosed one. The gap is a diagnosis's alone: the refitted
  // base model's error over the sensors' floor.
  double nominal = kNaN, left = kNaN, gap = kNaN;
  std::vector<Size> sizes;  // of one that the logs do not know the value is NaN
  std::vector<Said> statements;
};

// `json`: gapscope.tune/1 or gapscope.diagnosis/1, without times or with them. Id, time and report are the caller's.
// Error: something else.
Result<UnitResult> ReadUnitResult(const nlohmann::ordered_json& json, const std::string& where);

// The parts of a result that a merge repeats. Error: something else.
Result<nlohmann::ordered_json> MergedParts(const nlohmann::ordered_json& json, const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_UNIT_RESULT_H_
