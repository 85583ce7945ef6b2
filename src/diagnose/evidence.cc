#include "src/diagnose/evidence.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr double kNever = 10;   // standard errors, where one of two cannot be simulated
constexpr double kLarge = 0.2;  // a gain of this share needs only kFewZ
constexpr double kFewZ = 1.2;
// Half of the held-out cost, which no fit has seen, is no chance even where few blocks show it and the logs that were
// fitted hardly do.
constexpr double kHalf = 0.5, kHalfZ = 1.5;

double Sum(const std::vector<double>& values) {
  double sum = 0;
  for (const double v : values) sum += v;
  return sum;
}

}  // namespace

Evidence Compare(const Candidate& a, const Candidate& b) {
  if (b.held_out_blocks.empty() || b.train_blocks.empty())
    return {.gain = -1, .held_out = -1, .train = -1, .log_ratio = -1, .z = -kNever};
  if (a.held_out_blocks.empty() || a.train_blocks.empty())
    return {.gain = 1, .held_out = 1, .train = 1, .log_ratio = 1, .z = kNever};
  Evidence e;
  const double held_a = Sum(a.held_out_blocks), train_a = Sum(a.train_blocks);
  e.gain = held_a - Sum(b.held_out_blocks);
  e.held_out = held_a > 0 ? e.gain / held_a : 0;
  e.train = train_a > 0 ? 1 - Sum(b.train_blocks) / train_a : 0;
  std::vector<double> ratios;
  const auto add = [&](const std::vector<double>& of_a, const std::vector<double>& of_b, double floor) {
    for (std::size_t i = 0; i < std::min(of_a.size(), of_b.size()); ++i)
      ratios.push_back(std::log((of_a[i] + floor) / (of_b[i] + floor)));
  };
  add(a.train_blocks, b.train_blocks, a.block_floor);
  add(a.held_out_blocks, b.held_out_blocks, a.block_floor);
  e.log_ratio = Sum(ratios);
  const double n = static_cast<double>(ratios.size()), mean = e.log_ratio / n;
  double square = 0;
  for (const double r : ratios) square += (r - mean) * (r - mean);
  const double deviation = std::sqrt(square * n / std::max(1.0, n - 1));
  e.z = deviation > 0     ? std::clamp(e.log_ratio / deviation, -kNever, kNever)
        : e.log_ratio > 0 ? kNever
        : e.log_ratio < 0 ? -kNever
                          : 0;
  return e;
}

double LogMisfit(const Candidate& candidate) {
  if (candidate.held_out_blocks.empty() || candidate.train_blocks.empty()) return kInfinity;
  double sum = 0;
  for (const auto* blocks : {&candidate.train_blocks, &candidate.held_out_blocks}) {
    for (const double cost : *blocks) sum += std::log(cost + candidate.block_floor);
  }
  return sum;
}

double TypicalFloors(const Candidate& candidate) {
  if (candidate.held_out_blocks.empty()) return kInfinity;
  return std::sqrt(Median(candidate.held_out_blocks) / candidate.block_floor);
}

bool Convincing(const Evidence& e, const Limits& limits) {
  if (std::min(e.train, e.held_out) > kLarge) return e.z > kFewZ;
  if (e.train > 0 && e.held_out > kHalf) return e.z > kHalfZ;
  return e.train > 0 && e.held_out > limits.share && e.z > limits.z;
}

}  // namespace gapscope
