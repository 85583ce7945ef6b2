// Own inertia of the driven joint: drive less what the other links ask for, against the acceleration, beside friction
// and a pull. Source: "Quanser Qube 2 - Report", 2.3 (inertia from step responses).
#include <cmath>
#include <optional>

#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"
#include "src/identify/slides.h"

namespace gapscope {
namespace {

struct InertiaFit {
  Regression fit;
  IdentifyOptions options;  // with its cut-off
  Slides slides;
  double noise_share = 0;  // of the acceleration that the other columns leave
  bool pull = false;
};

// The inertia behind the low pass of `options`.
Result<InertiaFit> FitInertia(const IdentifyInput& input, int joint, const IdentifyOptions& options, Slides slides) {
  const bool pull = slides.MayPull();
  std::vector<std::string> columns = {"acceleration", "speed", "direction", "constant"};
  if (pull) columns.push_back("angle");
  Rows rows(columns);
  for (const auto& s : slides.rows) {
    std::vector<double> x = {s.acceleration, s.speed, s.speed > 0 ? 1.0 : -1.0, 1.0};
    if (pull) x.push_back(s.angle);
    rows.Add(s.log, s.time_s, s.drive - s.others, x);
  }
  GS_ASSIGN(Regression fit, Regress(rows, slides.dt_s));
  const Eigen::MatrixXd x = rows.X();
  const double left = 1 / (static_cast<double>(rows.size()) * (x.transpose() * x).inverse()(0, 0));
  return InertiaFit{.fit = std::move(fit),
                    .options = options,
                    .slides = std::move(slides),
                    .noise_share = NoiseVariance(input, joint, 2, options) / left,
                    .pull = pull};
}

// Noise in the acceleration makes the inertia too small, by its share of what the other columns leave of it: the
// cut-off with the smallest share is taken.
Result<InertiaFit> FitQuietestInertia(const IdentifyInput& input, int joint, const IdentifyOptions& options) {
  std::optional<InertiaFit> chosen;
  for (double cutoff = SmoothLog(input.recordings.front(), options).cutoff_hz(); cutoff > 0.5; cutoff *= 0.8) {
    IdentifyOptions trial = options;
    trial.cutoff_hz = cutoff;
    auto slides = LoadSlides(input, joint, trial);
    if (!slides.ok()) {
      if (!chosen && cutoff * 0.8 <= 0.5) return slides.error();
      continue;
    }
    GS_ASSIGN(InertiaFit own, FitInertia(input, joint, trial, std::move(slides).value()));
    const double share = own.noise_share;
    if (!chosen || share < chosen->noise_share) chosen = std::move(own);
    if (options.cutoff_hz > 0 || share < 1e-4) break;
  }
  if (!chosen) return Error{.what = "no cut-off leaves rows to fit", .where = input.recordings.front().log_path};
  return std::move(*chosen);
}

}  // namespace

Result<Identification> IdentifyInertia(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  GS_ASSIGN(const InertiaFit chosen, FitQuietestInertia(input, joint, options));
  const Regression& fit = chosen.fit;
  const double share = chosen.noise_share;
  Identification result{
      .method = "inertia",
      .relation = "drive - other links = inertia acceleration + viscous speed + coulomb sign(speed) + offset" +
                  std::string(chosen.pull ? " + pull angle" : ""),
      .r2 = fit.r2,
      .rmse = fit.rmse,
      .unit = "N m",
      .rows = fit.rows};
  result.values.push_back(ToEstimate(fit, 0, "inertia", "kg m2"));
  result.values.back().high += std::abs(fit.value[0]) * share / std::max(0.1, 1 - share);
  result.values.push_back(ToEstimate(fit, 1, "viscous", "N m s/rad"));
  result.values.push_back(ToEstimate(fit, 2, "coulomb", "N m"));
  result.values.push_back(ToEstimate(fit, 3, "offset", "N m"));
  if (chosen.pull) result.values.push_back(ToEstimate(fit, 4, "pull", "N m/rad"));
  result.values.push_back({.name = "inertia_nominal",
                           .unit = "kg m2",
                           .value = DrivenInertia(input.model.compiled(), joint),
                           .low = kNaN,
                           .high = kNaN});
  result.remarks.push_back("low pass at " + std::to_string(chosen.options.cutoff_hz).substr(0, 4) + " Hz; noise is " +
                           std::to_string(100 * share).substr(0, 4) +
                           " % of the acceleration that the other columns leave: the interval holds it");
  if (fit.high[0] - fit.low[0] > 0.5 * std::abs(fit.value[0]))
    result.remarks.push_back("the acceleration hardly shows in these logs: steps or a faster input");
  RemarkUnloggedTorque(chosen.slides, &result);
  return result;
}

}  // namespace gapscope
