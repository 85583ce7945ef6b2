#include "src/report/json.h"

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/visible.h"

namespace gapscope {

using nlohmann::ordered_json;

std::string JsonText(const ordered_json& json) {
  return MadeVisible(json.dump(2, ' ', false, ordered_json::error_handler_t::replace)) + "\n";
}

std::string ScriptText(const ordered_json& json) {
  const std::string text = MadeVisible(json.dump(-1, ' ', false, ordered_json::error_handler_t::replace), "\\\\u");
  std::string safe;
  safe.reserve(text.size());
  for (std::size_t i = 0; i < text.size(); ++i) {
    const bool control = text.compare(i, 4, "\\u00") == 0 && (i == 0 || text[i - 1] != '\\');
    safe += control ? "\\\\" : text[i] == '<' ? "\\u003c" : std::string(1, text[i]);
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
