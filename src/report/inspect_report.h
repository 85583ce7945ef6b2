// An inspected log for people: a console page. (JSON: src/log/inspect_json.h.)
#ifndef GAPSCOPE_REPORT_INSPECT_REPORT_H_
#define GAPSCOPE_REPORT_INSPECT_REPORT_H_

#include <string>

#include "src/log/inspect.h"

namespace gapscope {

std::string InspectTable(const InspectReport& report, const std::string& log_path);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_INSPECT_REPORT_H_
