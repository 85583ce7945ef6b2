#include "src/compare/torque_curve.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr double kNothing = 1e-6;  // of what is missing

double SquareSum(const std::vector<double>& values) {
  return std::inner_product(values.begin(), values.end(), values.begin(), 0.0);
}

std::vector<double> Less(const std::vector<double>& a, const std::vector<double>& b) {
  std::vector<double> less(a.size());
  std::transform(a.begin(), a.end(), b.begin(), less.begin(), std::minus<>());
  return less;
}

// The coordinate's rows in its order, cut into bins of about as many rows.
TorqueCurve CurveOver(TorqueCurve::Over over, const ResidualTorque& missing, const std::vector<double>& effect,
                      std::size_t bins) {
  TorqueCurve curve{.joint = missing.joint, .over = over};
  const auto& x = over == TorqueCurve::Over::kAngle ? missing.angle_rad : missing.speed_rad_per_s;
  std::vector<std::size_t> order(x.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  std::stable_sort(order.begin(), order.end(), [&](std::size_t a, std::size_t b) { return x[a] < x[b]; });
  for (std::size_t bin = 0; bin < bins; ++bin) {
    const std::size_t begin = bin * order.size() / bins, end = (bin + 1) * order.size() / bins;
    if (begin == end) continue;
    const auto mean = [&](const auto& of) {
      double sum = 0;
      for (std::size_t k = begin; k < end; ++k) sum += of(order[k]);
      return sum / static_cast<double>(end - begin);
    };
    curve.at.push_back(mean([&](std::size_t row) { return x[row]; }));
    curve.missing_n_m.push_back(mean([&](std::size_t row) { return missing.torque_n_m[row]; }));
    std::vector<double> inside;
    for (std::size_t k = begin; k < end; ++k) inside.push_back(missing.torque_n_m[order[k]]);
    curve.low_n_m.push_back(Quantile(inside, 1.0 / 6));
    curve.high_n_m.push_back(Quantile(std::move(inside), 5.0 / 6));
    curve.effect_n_m.push_back(mean([&](std::size_t row) { return effect[row]; }));
  }
  return curve;
}

}  // namespace

std::optional<TorqueCurve> CompareTorques(const std::vector<ResidualTorque>& without,
                                          const std::vector<ResidualTorque>& with, std::size_t bins) {
  if (without.size() != with.size()) return {};
  const ResidualTorque* missing = nullptr;
  std::vector<double> effect;
  double most = kNothing;
  for (std::size_t j = 0; j < without.size(); ++j) {
    if (without[j].torque_n_m.size() != with[j].torque_n_m.size() || without[j].torque_n_m.empty()) return {};
    std::vector<double> adds = Less(without[j].torque_n_m, with[j].torque_n_m);
    const double share = SquareSum(adds) / std::max(SquareSum(without[j].torque_n_m), 1e-300);
    if (share > most) most = share, missing = &without[j], effect = std::move(adds);
  }
  if (!missing) return {};
  TorqueCurve angle = CurveOver(TorqueCurve::Over::kAngle, *missing, effect, bins),
              speed = CurveOver(TorqueCurve::Over::kSpeed, *missing, effect, bins);
  return MomentsOf(angle.effect_n_m).deviation > MomentsOf(speed.effect_n_m).deviation ? angle : speed;
}

}  // namespace gapscope
