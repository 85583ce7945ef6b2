// The report of `inspect` as JSON, schema "gapscope.inspect/1". NaN become null.
#ifndef GAPSCOPE_LOG_INSPECT_JSON_H_
#define GAPSCOPE_LOG_INSPECT_JSON_H_

#include <nlohmann/json_fwd.hpp>

#include "src/log/inspect.h"

namespace gapscope {

// One log's report: an object without the schema; the command puts these into {"schema": ..., "logs": [...]}.
nlohmann::ordered_json ToJson(const InspectReport& report, const std::string& log_path);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_INSPECT_JSON_H_
