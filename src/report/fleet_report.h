// fleet.html: many robots' units on one page that opens from disk. The data are a line of compact JSON a robot, drawn
// by src/report/html/fleet.js, so that thousands of units open at once.
#ifndef GAPSCOPE_REPORT_FLEET_REPORT_H_
#define GAPSCOPE_REPORT_FLEET_REPORT_H_

#include <map>
#include <span>
#include <string>
#include <vector>

#include "src/report/robot_changes.h"
#include "src/report/unit_result.h"

namespace gapscope {

class FleetPage {
 public:
  // `time`: the column in whose order a robot's units stand.
  FleetPage(std::string what, std::string experiment, std::string time);

  // `units` in time.
  void AddRobot(const std::string& name, std::span<const UnitResult> units, std::span<const RobotChange> changes);

  // Robots that changed first, the surest change before others, then by their error, the largest first.
  // `times`: of all robots, in order.
  std::string Html(const std::vector<std::string>& times) const;

 private:
  struct Robot {
    double chance = 0, error = 0;
    std::string json;
  };
  std::size_t SeriesIndex(const std::string& name, const std::string& unit);

  std::string what_, experiment_, time_;
  std::vector<Robot> robots_;
  std::map<std::string, std::size_t> series_;
  std::vector<std::string> series_names_, series_units_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_FLEET_REPORT_H_
