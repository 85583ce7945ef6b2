// Since when a robot is another one, and by which of its numbers.
#ifndef GAPSCOPE_REPORT_ROBOT_CHANGES_H_
#define GAPSCOPE_REPORT_ROBOT_CHANGES_H_

#include <span>
#include <string>
#include <vector>

#include "src/report/unit_result.h"

namespace gapscope {

struct RobotChange {
  std::string series;            // a parameter, a statement ("EFFECT@PLACE"), "gap" or "nominal error"
  std::size_t first = 0;         // of the units: the first one after the change
  double before = 0, after = 0;  // means; of a statement its probability
  double chance = 0;             // that a stable robot shows such a step in any of its numbers: at most this
};

// A stable robot is called changed in at most about this share of cases, over all its numbers.
inline constexpr double kFalseChange = 0.01;

// `units`: of one robot, in time. The surest first.
std::vector<RobotChange> ChangesOf(std::span<const UnitResult> units);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_ROBOT_CHANGES_H_
