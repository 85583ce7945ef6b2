// Inspected logs for people and programs: a console page, JSON (gapscope.inspect/1).
#ifndef GAPSCOPE_REPORT_INSPECT_REPORT_H_
#define GAPSCOPE_REPORT_INSPECT_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/log/inspect.h"
#include "src/report/run.h"

namespace gapscope {

struct InspectRun {
  struct Log {
    std::string log;  // path
    InspectReport report;
  };
  RunInfo info;
  std::vector<Log> logs;
};

nlohmann::ordered_json ToJson(const InspectRun& run);
std::string ToTable(const InspectRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_INSPECT_REPORT_H_
