#include "src/fit/prior.h"

#include <algorithm>
#include <cmath>

#include "src/fit/policy.h"

namespace gapscope {
namespace {

// Inverse variances of what is known beforehand. Only meaningful with weights of 1 / noise.
Eigen::VectorXd Knowledge(const SearchSpace& space, const FitLayout& layout, const FitOptions& options,
                          const std::vector<Parameter>& stated) {
  Eigen::VectorXd weight = Eigen::VectorXd::Zero(layout.low.size());
  for (std::size_t i = 0; i < space.coordinates().size() && options.prior_share > 0; ++i) {
    // An effect's parameters are what is asked for.
    const Coordinate& c = space.coordinates()[i];
    const Parameter& p = stated[static_cast<std::size_t>(c.parameter)];
    if (p.owner != Parameter::Owner::kBase) continue;
    const auto k = static_cast<Eigen::Index>(i);
    const double deviation = options.prior_share * (c.ToSearch(p.high) - c.ToSearch(p.low));
    weight[k] = 1 / (deviation * deviation);
  }
  for (const auto& log : layout.signals) {
    for (const auto& signal : log) {
      if (signal.offset >= 0 && options.prior_offset_rad > 0)
        weight[signal.offset] = std::pow(signal.deviation / options.prior_offset_rad, 2);
    }
  }
  for (const Eigen::Index shift : {layout.command_shift, layout.force_shift}) {
    if (shift >= 0 && options.prior_shift_s > 0)
      weight[shift] = std::pow(layout.shift_scale_s / options.prior_shift_s, 2);
  }
  return weight;
}

}  // namespace

Prior MakePrior(const SearchSpace& space, const FitLayout& layout, const FitOptions& options,
                const Eigen::VectorXd& start, std::size_t residuals, const std::vector<Parameter>& stated) {
  // In units of the signals' standard deviations, as without weights.
  const double unit = options.weights.empty() ? 1 : layout.UnitCost();
  const Eigen::VectorXd range = layout.high - layout.low, knowledge = Knowledge(space, layout, options, stated);
  Prior prior{.centre = start,
              .weight = kFitPolicy.anchor * unit * static_cast<double>(residuals) *
                        range.cwiseAbs2().cwiseMax(1e-12).cwiseInverse(),
              .known = knowledge,
              .scale = options.prior_scale};
  prior.weight += options.prior_scale * knowledge;
  for (std::size_t i = 0; i < space.coordinates().size() && !options.prior_centre.empty(); ++i) {
    const auto k = static_cast<Eigen::Index>(i);
    const Coordinate& c = space.coordinates()[i];
    if (knowledge[k] > 0)
      prior.centre[k] = std::clamp(c.ToSearch(options.prior_centre[c.parameter]), layout.low[k], layout.high[k]);
  }
  return prior;
}

}  // namespace gapscope
