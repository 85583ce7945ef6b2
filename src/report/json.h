// Shared by the JSON reporters.
#ifndef GAPSCOPE_REPORT_JSON_H_
#define GAPSCOPE_REPORT_JSON_H_

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/compare/score.h"
#include "src/report/version.h"

namespace gapscope {

// Not a number and infinity have no place in JSON.
inline nlohmann::ordered_json JsonNumber(double value) { return std::isfinite(value) ? nlohmann::ordered_json(value) : nlohmann::ordered_json(nullptr); }

inline nlohmann::ordered_json JsonScore(const SignalScore& s) {
  return {{"rmse", JsonNumber(s.rmse)}, {"mae", JsonNumber(s.mae)}, {"nrmse", JsonNumber(s.nrmse)}, {"max", JsonNumber(s.max)}, {"lag_s", JsonNumber(s.lag_s)},
          {"correlation", JsonNumber(s.correlation)}};
}

inline nlohmann::ordered_json JsonVersions() { return {{"gapscope", GapscopeVersion()}, {"mujoco", MujocoVersion()}}; }

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_JSON_H_
