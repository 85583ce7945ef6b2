#include "src/report/json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/visible.h"

namespace gapscope {

using nlohmann::ordered_json;

namespace {

// What is no UTF-8 becomes U+FFFD. `indent` -1: on one line.
std::string Dumped(const ordered_json& json, int indent) {
  return json.dump(indent, ' ', false, ordered_json::error_handler_t::replace);
}

}  // namespace

std::string JsonText(const ordered_json& json) { return MadeVisible(Dumped(json, 2)) + "\n"; }

std::string ScriptText(const ordered_json& json) {
  const std::string text = MadeVisible(Dumped(json, -1), "\\\\u");
  std::string safe;
  safe.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] == '<') {
      safe += "\\u003c";
    } else if (text.compare(i, 2, "\\u") == 0) {
      safe += "\\\\";  // a control character: nothing else is written so
    } else {
      safe += text[i];
      if (text[i] == '\\') safe += text[++i];
    }
  }
  return safe;
}

ordered_json JsonNumber(double value) { return std::isfinite(value) ? ordered_json(value) : ordered_json(nullptr); }

ordered_json JsonScore(const SignalScore& s) {
  return {{"rmse", JsonNumber(s.rmse)}, {"mae", JsonNumber(s.mae)},     {"nrmse", JsonNumber(s.nrmse)},
          {"max", JsonNumber(s.max)},   {"lag_s", JsonNumber(s.lag_s)}, {"correlation", JsonNumber(s.correlation)}};
}

ordered_json JsonConditions(const std::vector<ConditionShare>& shares) {
  ordered_json json = ordered_json::array();
  for (const auto& w : shares) {
    json.push_back({{"signal", w.signal},
                    {"condition", w.condition},
                    {"share_of_error", JsonNumber(w.share_of_error)},
                    {"share_of_time", JsonNumber(w.share_of_time)},
                    {"low", JsonNumber(w.low)},
                    {"high", JsonNumber(w.high)}});
  }
  return json;
}

ordered_json JsonEffects(const std::vector<EffectUse>& effects) {
  ordered_json json = ordered_json::array();
  for (const auto& use : effects) json.push_back({{"name", use.effect}, {"on", use.on}});
  return json;
}

ordered_json JsonModel(const RunModel& model) {
  ordered_json json = {{"effects", JsonEffects(model.effects)}, {"values", ordered_json::object()}};
  for (const auto& [name, value] : model.values) json["values"][name] = JsonNumber(value);
  return json;
}

ordered_json JsonVersions(const RunInfo& info) { return {{"gapscope", info.gapscope}, {"mujoco", info.mujoco}}; }

const char* OutcomeName(Outcome outcome) { return outcome == Outcome::kCompleted ? "completed" : "diverged"; }

}  // namespace gapscope
