// Parts of our own results, read back: what read_run.cc and read_diagnosis.cc share. All may throw what nlohmann does
// at a missing key or a wrong kind of value: ReadGuarded turns that into an error.
#ifndef GAPSCOPE_REPORT_READ_JSON_H_
#define GAPSCOPE_REPORT_READ_JSON_H_

#include <cmath>
#include <nlohmann/json.hpp>
#include <string>
#include <utility>

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

// The same of a text; empty: it has none.
inline std::string TextIn(const nlohmann::ordered_json& json, const char* key) {
  return json.contains(key) && json[key].is_string() ? json[key].get<std::string>() : "";
}

// A whole number that fits; nlohmann makes one of any number, and what a number out of range then becomes is undefined.
template <class Whole>
Whole WholeFrom(const nlohmann::ordered_json& json) {
  constexpr double kExact = 9007199254740992;  // 2^53
  const bool fits = json.is_number_unsigned() ? std::in_range<Whole>(json.get<std::uint64_t>())
                    : json.is_number_float()
                        ? std::abs(json.get<double>()) < kExact && std::in_range<Whole>(json.get<std::int64_t>())
                        : json.is_number() && std::in_range<Whole>(json.get<std::int64_t>());
  if (!fits) throw nlohmann::ordered_json::out_of_range::create(401, "not a whole number that fits", &json);
  return json.get<Whole>();
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
