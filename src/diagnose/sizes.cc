#include "src/diagnose/sizes.h"

#include <algorithm>
#include <cmath>
#include <span>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

// Place of a parameter among the coordinates that are logarithms; -1: it is none of them.
Eigen::Index LogarithmOf(const SearchSpace& space, int parameter) {
  const auto& coordinates = space.coordinates();
  const auto found = std::find_if(coordinates.begin(), coordinates.end(),
                                  [&](const Coordinate& c) { return c.parameter == parameter && c.logarithmic; });
  return found == coordinates.end() ? -1 : found - coordinates.begin();
}

struct Interval {
  double low = 0, high = 0;
};

// The wider of what the residuals' slopes say, as much farther as the policy says (of a logarithm by a factor), and of
// what `left_out` shows: the value's estimates without each part of the logs.
Interval Widest(double value, Interval by_slopes, bool logarithmic, std::span<const double> left_out) {
  const double factor = kDiagnosePolicy.evidence.interval_factor, half = JackknifeHalf(left_out);
  const auto widened = [&](double end) {
    return logarithmic && end / value > 0 ? value * std::pow(end / value, factor) : value + factor * (end - value);
  };
  return {std::min(widened(by_slopes.low), value - half), std::max(widened(by_slopes.high), value + half)};
}

// The base parameter that a size is known best beside. Its deviation is that of ln(size / parameter).
void AddRatio(const Candidate& candidate, const Uncertainty& uncertainty,
              const std::vector<std::vector<double>>& left_out, int parameter, EffectEstimate* size) {
  const SearchSpace& space = candidate.problem->space();
  const Eigen::Index own = LogarithmOf(space, parameter);
  if (own < 0 || !(size->value > 0)) return;
  const Eigen::MatrixXd& c = uncertainty.covariance;
  const double alone = std::sqrt(c(own, own)), wanted = kDiagnosePolicy.evidence.ratio_share * alone;
  double least = wanted;
  for (std::size_t i = 0; i < space.coordinates().size(); ++i) {
    const Coordinate& other = space.coordinates()[i];
    const auto k = static_cast<Eigen::Index>(i);
    if (!other.logarithmic || space.parameter(other).owner != Parameter::Owner::kBase) continue;
    const double deviation = std::sqrt(std::max(0.0, c(own, own) + c(k, k) - 2 * c(own, k)));
    if (!(deviation < least)) continue;
    least = deviation;
    const auto ratio_of = [&](const std::vector<double>& values) {
      return values[static_cast<std::size_t>(parameter)] / values[static_cast<std::size_t>(other.parameter)];
    };
    const double value = ratio_of(candidate.values),
                 factor =
                     std::exp(HalfInterval(c, uncertainty.of_prior, uncertainty.freedom,
                                           Eigen::VectorXd::Unit(c.rows(), own) - Eigen::VectorXd::Unit(c.rows(), k)));
    const Interval interval = Widest(value, {value / factor, value * factor}, true, Collect(left_out, ratio_of));
    size->ratio = {
        .to = space.parameter(other).name, .value = value, .low = std::max(0.0, interval.low), .high = interval.high};
  }
}

// Over a long step the residuals bend: what only a ratio tells would seem to be known by itself. Over a short one they
// are jagged where the motion has blows or sticks: what no fit can find would seem to be known to many digits.
Uncertainty UncertaintyAt(const Candidate& candidate, double step, const Eigen::MatrixXd& beside) {
  const Linearization at =
      Linearize(*candidate.problem, candidate.point, {.step = step, .columns = DifferenceOptions::Columns::kCentral});
  return EstimateUncertainty(*candidate.problem, candidate.point, at, beside);
}

}  // namespace

std::map<EffectUse, std::vector<EffectEstimate>> EstimateSizes(const Workbench& bench, const Candidate& candidate,
                                                               const Eigen::MatrixXd& beside,
                                                               const std::vector<std::vector<double>>& left_out) {
  std::map<EffectUse, std::vector<EffectEstimate>> sizes;
  if (candidate.effects.empty()) return sizes;
  const Uncertainty uncertainty = UncertaintyAt(candidate, kFineStep, beside),
                    over_kinks = UncertaintyAt(candidate, kCoarseStep, beside);
  for (const EffectUse& use : candidate.effects) {
    for (const auto& p : PlacedParameters(use, *bench.rig, bench.scales)) {
      for (std::size_t i = 0; i < uncertainty.tuned.size(); ++i) {
        const TunedParameter &tuned = uncertainty.tuned[i], &coarse = over_kinks.tuned[i];
        if (candidate.model->parameters()[tuned.index].name != p.name) continue;
        const bool logarithmic = LogarithmOf(candidate.problem->space(), tuned.index) >= 0;
        const Interval interval =
            Widest(tuned.value, {std::min(tuned.low, coarse.low), std::max(tuned.high, coarse.high)}, logarithmic,
                   Collect(left_out, [&](const auto& v) { return v[static_cast<std::size_t>(tuned.index)]; }));
        EffectEstimate size{p.key, p.unit, tuned.value, std::clamp(interval.low, p.low, p.high),
                            std::clamp(interval.high, p.low, p.high)};
        if (p.role == ParameterRole::kSize) AddRatio(candidate, uncertainty, left_out, tuned.index, &size);
        sizes[use].push_back(std::move(size));
      }
    }
  }
  return sizes;
}

}  // namespace gapscope
