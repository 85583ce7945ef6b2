// A cable on the driven joint: a spring with its own rest angle, beside friction. Source: "Quanser Qube 2 - Report",
// 2.5.
#include <algorithm>
#include <cmath>
#include <functional>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"
#include "src/identify/slides.h"

namespace gapscope {
namespace {

struct CableColumns {
  const Slides& slides;
  bool free_inertia;

  Result<Regression> Fit(const std::function<bool(const Slide&)>& use) const {
    std::vector<std::string> columns = {"angle", "constant", "direction", "speed"};
    if (free_inertia) columns.insert(columns.end(), {"own inertia", "other links"});
    Rows rows(columns);
    for (const auto& s : slides.rows) {
      if (!use(s)) continue;
      std::vector<double> x = {s.angle, 1, s.speed > 0 ? 1.0 : -1.0, s.speed};
      if (free_inertia) x.insert(x.end(), {s.demand - s.others, s.others});
      rows.Add(s.log, s.time_s, s.drive - s.demand, x);
    }
    return Regress(rows, slides.dt_s);
  }
};

// rest = -c / k, by the delta method.
Estimate RestOf(const Regression& f) {
  const double rest = -f.value[1] / f.value[0];
  const Eigen::Vector2d gradient(f.value[1] / (f.value[0] * f.value[0]), -1 / f.value[0]);
  const double error = f.quantile * std::sqrt(std::max(0.0, gradient.dot(f.covariance.topLeftCorner(2, 2) * gradient)));
  return {.name = "rest", .unit = "rad", .value = rest, .low = rest - error, .high = rest + error};
}

// Repeats: logs, or quarters of the only one; the spread of the values over them.
void AddRepeats(const CableColumns& columns, const std::vector<Recording>& recordings, Identification* result) {
  PointTable repeats{
      .name = "repeats",
      .columns = {"repeat", "stiffness", "stiffness_low", "stiffness_high", "rest", "rest_low", "rest_high"},
      .rows = {}};
  const bool one = recordings.size() == 1;
  const int parts = one ? 4 : static_cast<int>(recordings.size());
  const double duration = recordings.front().duration_s();
  std::vector<double> stiffnesses, rests;
  for (int part = 0; part < parts; ++part) {
    const auto own = columns.Fit([&](const Slide& s) {
      return one ? s.time_s >= duration * part / parts && s.time_s < duration * (part + 1) / parts : s.log == part;
    });
    if (!own.ok()) continue;
    const Estimate rest = RestOf(own.value());
    repeats.rows.push_back({static_cast<double>(part), own.value().value[0], own.value().low[0], own.value().high[0],
                            rest.value, rest.low, rest.high});
    stiffnesses.push_back(own.value().value[0]);
    rests.push_back(rest.value);
  }
  if (stiffnesses.size() > 1) {
    const auto add = [&](const char* name, const char* unit, const std::vector<double>& v) {
      const double n = static_cast<double>(v.size()), spread = MomentsOf(v).deviation * std::sqrt(n / (n - 1));
      result->values.push_back({.name = name, .unit = unit, .value = spread, .low = kNaN, .high = kNaN});
    };
    add("stiffness_spread", "N m/rad", stiffnesses);
    add("rest_spread", "rad", rests);
    result->remarks.push_back(std::string("spread: standard deviation over ") +
                              (one ? "quarters of the log" : "the logs"));
  }
  result->tables.push_back(std::move(repeats));
}

}  // namespace

Result<Identification> IdentifyCable(const IdentifyInput& input, const IdentifyOptions& asked) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, asked.joint));
  const IdentifyOptions options = ForFreeInertia(input, joint, asked);
  GS_ASSIGN(const Slides slides, LoadSlides(input, joint, options));
  const CableColumns columns{.slides = slides, .free_inertia = options.free_inertia};
  GS_ASSIGN(const Regression fit, columns.Fit([](const Slide&) { return true; }));
  Identification result{
      .method = "cable",
      .relation =
          "drive - inertia - gravity - springs = stiffness (angle - rest) + coulomb sign(speed) + viscous speed",
      .r2 = fit.r2,
      .rmse = fit.rmse,
      .unit = "N m",
      .rows = fit.rows};
  result.values.push_back(ToEstimate(fit, 0, "stiffness", "N m/rad"));
  result.values.push_back(RestOf(fit));
  result.values.push_back(ToEstimate(fit, 2, "coulomb", "N m"));
  result.values.push_back(ToEstimate(fit, 3, "viscous", "N m s/rad"));
  AddRepeats(columns, input.recordings, &result);
  if (fit.low[0] <= 0) result.remarks.push_back("no spring is seen: its interval holds zero");
  RemarkUnloggedTorque(slides, &result);
  return result;
}

}  // namespace gapscope
