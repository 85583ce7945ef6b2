#include "src/report/unit_result.h"

#include "src/report/diagnose_report.h"
#include "src/report/read_json.h"
#include "src/report/tune_report.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

constexpr char kUnitSchemas[] = "gapscope.tune/1 or gapscope.diagnosis/1";

bool IsTune(const ordered_json& json) { return json.at("schema") == kTuneSchema; }

UnitResult TunedFrom(const ordered_json& json) {
  UnitResult unit{.nominal = NumberFrom(json.at("error").at("nominal")),
                  .left = NumberFrom(json.at("error").at("held_out"))};
  for (const auto& p : json.at("parameters")) {
    UnitResult::Size size{.name = p.at("name"), .unit = p.at("unit")};
    if (p.at("identifiable").get<bool>()) {
      size.value = NumberFrom(p.at("value"));
      size.low = NumberFrom(p.at("low"));
      size.high = NumberFrom(p.at("high"));
    }
    unit.sizes.push_back(std::move(size));
  }
  return unit;
}

UnitResult DiagnosedFrom(const ordered_json& json) {
  const auto& gap = json.at("gap");
  const double floor = NumberFrom(gap.at("floor"));
  UnitResult unit{.verdict = json.at("verdict"),
                  .probability = NumberFrom(json.at("probability")),
                  .nominal = NumberFrom(gap.at("nominal")),
                  .left = NumberFrom(gap.at("final")),
                  .gap = floor > 0 ? NumberFrom(gap.at("refit")) / floor : kNaN};
  for (const auto& [name, value] : json.at("model").at("values").items()) {
    // An effect's sizes come with their intervals below; a scale is of the rig, not of the day.
    if (name.find('@') == std::string::npos) unit.sizes.push_back({.name = name, .value = NumberFrom(value)});
  }
  for (const auto& s : json.at("statements")) {
    const std::string name = s.at("name").get<std::string>() + "@" + s.at("on").get<std::string>();
    unit.statements.push_back({name, s.at("answer"), NumberFrom(s.at("probability"))});
    for (const auto& [key, size] : s.at("parameters").items())
      unit.sizes.push_back({.name = std::string(name).append(".").append(key),
                            .value = NumberFrom(size.at("value")),
                            .low = NumberFrom(size.at("low")),
                            .high = NumberFrom(size.at("high"))});
  }
  return unit;
}

ordered_json PartsOf(const ordered_json& result) {
  if (IsTune(result))
    return {{"termination", result.at("termination")},
            {"error", result.at("error")},
            {"parameters", result.at("parameters")}};
  ordered_json statements = ordered_json::array();
  for (const auto& s : result.at("statements")) {
    ordered_json kept;
    for (const char* key : {"name", "on", "answer", "probability", "parameters", "bound"}) {
      if (s.contains(key)) kept[key] = s[key];
    }
    statements.push_back(std::move(kept));
  }
  return {{"verdict", result.at("verdict")},
          {"probability", result.at("probability")},
          {"gap", result.at("gap")},
          {"values", result.at("model").at("values")},
          {"statements", std::move(statements)}};
}

}  // namespace

Result<UnitResult> ReadUnitResult(const ordered_json& json, const std::string& where) {
  return ReadGuarded([&] { return IsTune(json) ? TunedFrom(json) : DiagnosedFrom(json); }, where, kUnitSchemas);
}

Result<ordered_json> MergedParts(const ordered_json& json, const std::string& where) {
  return ReadGuarded([&] { return PartsOf(json); }, where, kUnitSchemas);
}

}  // namespace gapscope
