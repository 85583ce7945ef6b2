// Friction of the driven joint against speed.
//
//   drive(V or A, w) - M a - bias + springs = Tc+ [w > 0] - Tc- [w < 0] + b+ max(w, 0) + b- min(w, 0) (+ k (q - rest))
//
// Everything on the left is the model's or logged (torque.h). While the joint slides a constant torque cannot be told
// from a difference of Tc+ and Tc-. Source: "Quanser Qube 2 - Report", 2.2 (friction ladder).
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"
#include "src/identify/slides.h"

namespace gapscope {
namespace {

// Mean left side in bins of speed, with the standard error by blocks.
PointTable SpeedMap(const Slides& slides, const std::function<double(const Slide&)>& torque) {
  PointTable table{.name = "map", .columns = {"speed_rad_per_s", "torque_n_m", "low", "high", "rows"}, .rows = {}};
  constexpr int kBins = 12;
  for (int b = -kBins; b < kBins; ++b) {
    // Finer bins at low speed.
    const auto edge = [&](int i) {
      return (i < 0 ? -1 : 1) * slides.fastest * std::pow(std::abs(i) / static_cast<double>(kBins), 2);
    };
    const double low = edge(b), high = edge(b + 1);
    Rows rows({"constant"});
    double sum = 0;
    for (const auto& s : slides.rows) {
      if (s.speed < low || s.speed >= high) continue;
      rows.Add(s.log, s.time_s, torque(s), {1});
      sum += s.speed;
    }
    const auto fit = Regress(rows, slides.dt_s);
    if (!fit.ok()) continue;
    table.rows.push_back({sum / static_cast<double>(rows.size()), fit.value().value[0], fit.value().low[0],
                          fit.value().high[0], static_cast<double>(rows.size())});
  }
  return table;
}

// The balance of torques on what friction can be, one row per slide.
struct FrictionColumns {
  const Slides& slides;
  bool pull, free_inertia;

  // With `hump_rad_per_s`: Stribeck's, of that width, as the last column.
  Result<Regression> Fit(std::optional<double> hump_rad_per_s) const {
    std::vector<std::string> columns = {"forward dry friction", "backward dry friction", "forward viscous friction",
                                        "backward viscous friction"};
    if (pull) columns.push_back("angle");
    if (free_inertia) columns.insert(columns.end(), {"own inertia", "other links"});
    if (hump_rad_per_s) columns.push_back("hump at low speed");
    Rows rows(columns);
    for (const auto& s : slides.rows) {
      std::vector<double> x = {s.speed > 0 ? 1.0 : 0.0, s.speed < 0 ? -1.0 : 0.0, std::max(s.speed, 0.0),
                               std::min(s.speed, 0.0)};
      if (pull) x.push_back(s.angle);
      if (free_inertia) x.insert(x.end(), {s.demand - s.others, s.others});
      if (const double vs = hump_rad_per_s.value_or(0); hump_rad_per_s)
        x.push_back((s.speed > 0 ? 1 : -1) * std::exp(-s.speed * s.speed / (vs * vs)));
      rows.Add(s.log, s.time_s, s.drive - s.demand, x);
    }
    return Regress(rows, slides.dt_s);
  }
};

// Mean of two values of a fit, with its own interval.
Estimate MeanOf(const Regression& fit, Eigen::Index i, Eigen::Index j, const char* name, const char* unit) {
  const double value = 0.5 * (fit.value[i] + fit.value[j]);
  const double error = fit.quantile * 0.5 *
                       std::sqrt(std::max(0.0, fit.covariance(i, i) + fit.covariance(j, j) + 2 * fit.covariance(i, j)));
  return {.name = name, .unit = unit, .value = value, .low = value - error, .high = value + error};
}

// Stribeck's hump: one more column, its width scanned; kept when it stands clear of zero.
void AddHump(const FrictionColumns& columns, const Regression& fit, Identification* result) {
  const Slides& slides = columns.slides;
  double best = fit.residual.squaredNorm(), width = 0;
  for (int i = 0; i < 12; ++i) {
    const double vs =
        2 * slides.least * std::pow(std::max(slides.fastest / 4, 3 * slides.least) / (2 * slides.least), i / 11.0);
    const auto trial = columns.Fit(vs);
    if (trial.ok() && trial.value().residual.squaredNorm() < best)
      best = trial.value().residual.squaredNorm(), width = vs;
  }
  // A hump as narrow as the edge of what counts as sliding is that edge: presliding, and rows that noise has let in.
  if (!(width > 4 * slides.least)) return;
  const Regression hump = columns.Fit(width).value();
  const Eigen::Index at = hump.value.size() - 1;
  // Twice the interval: the width was chosen to make it large. And a tenth of the dry friction: presliding bends the
  // first milliradians too.
  if (!(hump.value[at] > 0.05 * std::abs(fit.value[0] + fit.value[1]) &&
        hump.value[at] - 2 * (hump.value[at] - hump.low[at]) > 0))
    return;
  result->values.push_back(ToEstimate(hump, at, "stribeck_rise", "N m"));
  result->values.push_back({.name = "stribeck_speed", .unit = "rad/s", .value = width, .low = kNaN, .high = kNaN});
  result->r2 = hump.r2, result->rmse = hump.rmse;
}

}  // namespace

Result<Identification> IdentifyFriction(const IdentifyInput& input, const IdentifyOptions& asked) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, asked.joint));
  const IdentifyOptions options = ForFreeInertia(input, joint, asked);
  GS_ASSIGN(const Slides slides, LoadSlides(input, joint, options));
  const bool pull = slides.MayPull();
  const FrictionColumns columns{.slides = slides, .pull = pull, .free_inertia = options.free_inertia};
  GS_ASSIGN(const Regression fit, columns.Fit(std::nullopt));
  Identification result{.method = "friction",
                        .relation = "drive - inertia - gravity - springs = +-coulomb + viscous speed" +
                                    std::string(pull ? " + pull angle" : ""),
                        .r2 = fit.r2,
                        .rmse = fit.rmse,
                        .unit = "N m",
                        .rows = fit.rows};
  result.values.push_back(ToEstimate(fit, 0, "coulomb_positive", "N m"));
  result.values.push_back(ToEstimate(fit, 1, "coulomb_negative", "N m"));
  result.values.push_back(ToEstimate(fit, 2, "viscous_positive", "N m s/rad"));
  result.values.push_back(ToEstimate(fit, 3, "viscous_negative", "N m s/rad"));
  result.values.push_back(MeanOf(fit, 0, 1, "coulomb", "N m"));
  result.values.push_back(MeanOf(fit, 2, 3, "viscous", "N m s/rad"));
  if (pull) result.values.push_back(ToEstimate(fit, 4, "pull", "N m/rad"));
  AddHump(columns, fit, &result);
  result.tables.push_back(
      SpeedMap(slides, [&](const Slide& s) { return s.drive - s.demand - (pull ? fit.value[4] * s.angle : 0); }));
  if (result.Find("coulomb_positive")->low > result.Find("coulomb_negative")->high ||
      result.Find("coulomb_negative")->low > result.Find("coulomb_positive")->high) {
    result.remarks.push_back(
        "the two directions differ; while sliding that equals a constant torque beside equal friction");
  }
  if (result.Find("coulomb")->high < 0 || result.Find("viscous")->high < 0)
    result.remarks.push_back(
        "friction below zero: the drive's torque of the model is too small, or an effect is missing");
  RemarkUnloggedTorque(slides, &result);
  return result;
}

}  // namespace gapscope
