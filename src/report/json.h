// Shared by the JSON reporters.
#ifndef GAPSCOPE_REPORT_JSON_H_
#define GAPSCOPE_REPORT_JSON_H_

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/compare/conditions.h"
#include "src/compare/score.h"
#include "src/model/model.h"
#include "src/report/version.h"

namespace gapscope {

// Not a number and infinity have no place in JSON.
inline nlohmann::ordered_json JsonNumber(double value) {
  return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr);
}

inline nlohmann::ordered_json JsonScore(const SignalScore& s) {
  return {{"rmse", JsonNumber(s.rmse)}, {"mae", JsonNumber(s.mae)},     {"nrmse", JsonNumber(s.nrmse)},
          {"max", JsonNumber(s.max)},   {"lag_s", JsonNumber(s.lag_s)}, {"correlation", JsonNumber(s.correlation)}};
}

inline nlohmann::ordered_json JsonConditions(const std::vector<ConditionShare>& shares) {
  nlohmann::ordered_json json = nlohmann::ordered_json::array();
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

// What it takes to build the model again: its effects and the values of all its parameters (src/cli/result_model.h
// reads it).
inline nlohmann::ordered_json JsonModel(const Model& model, std::span<const double> values) {
  nlohmann::ordered_json json = {{"effects", nlohmann::ordered_json::array()},
                                 {"values", nlohmann::ordered_json::object()}};
  for (const auto& use : model.effects()) json["effects"].push_back({{"name", use.effect}, {"on", use.on}});
  for (std::size_t i = 0; i < values.size(); ++i) json["values"][model.parameters()[i].name] = JsonNumber(values[i]);
  return json;
}

inline nlohmann::ordered_json JsonVersions() { return {{"gapscope", GapscopeVersion()}, {"mujoco", MujocoVersion()}}; }

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_JSON_H_
