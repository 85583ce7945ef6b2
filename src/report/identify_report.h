// An identification for people and programs: console table, JSON (gapscope.identify.METHOD/1), points as CSV.
#ifndef GAPSCOPE_REPORT_IDENTIFY_REPORT_H_
#define GAPSCOPE_REPORT_IDENTIFY_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/identify/identification.h"
#include "src/report/run.h"

namespace gapscope {

struct IdentifyRun {
  RunInfo info;
  Identification result;
  std::vector<std::string> logs;  // paths
};

nlohmann::ordered_json ToJson(const IdentifyRun& run);
std::string ToTable(const IdentifyRun& run);

// A point table's columns, one vector each.
std::vector<std::vector<double>> ColumnsOf(const PointTable& table);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_IDENTIFY_REPORT_H_
