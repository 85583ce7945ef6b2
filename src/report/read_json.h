// Parts of our own results, read back: what read_run.cc and read_diagnosis.cc share. All may throw what nlohmann does
// at a missing key or a wrong kind of value: ReadGuarded turns that into an error.
#ifndef GAPSCOPE_REPORT_READ_JSON_H_
#define GAPSCOPE_REPORT_READ_JSON_H_

#include <nlohmann/json.hpp>
#include <string>

#include "src/core/result.h"
#include "src/core/statistics.h"
#include "src/model/run_model.h"

namespace gapscope {

// Null stands for a number that does not exist.
inline double NumberFrom(const nlohmann::ordered_json& json) { return json.is_null() ? kNaN : json.get<double>(); }

// An entry of an object; NaN: it has none that is a number.
inline double NumberIn(const nlohmann::ordered_json& json, const char* key) {
  return json.contains(key) && json[key].is_number() ? json[key].get<double>() : kNaN;
}

// As JsonModel wrote it.
RunModel RunModelFrom(const nlohmann::ordered_json& json);
// The model of a whole result, with the experiment that the result names.
RunModel ResultModelFrom(const nlohmann::ordered_json& result);

template <class Read>
auto ReadGuarded(const Read& read, const std::string& where, const char* allowed) -> Result<decltype(read())> {
  try {
    return read();
  } catch (const nlohmann::ordered_json::exception& e) {
    return Error{.what = "not a result that can be read", .where = where, .actual = e.what(), .allowed = allowed};
  }
}

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_READ_JSON_H_
