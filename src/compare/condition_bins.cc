#include "src/compare/condition_bins.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr double kNearZeroPart = 0.05;  // of the 95th percentile
constexpr std::array<double, 2> kReversalLimits_s = {0.1, 0.3};
constexpr int kAngleBins = 5;
constexpr int kTimeBins = 10;

// Rounds to a multiple of 10^exponent; dividing by a whole power keeps 0.1 and the like exact. Numbers too small for
// that stay as they are.
double RoundToDecimal(double value, int exponent, double (*round)(double)) {
  if (exponent < 0) {
    const double scale = std::pow(10.0, -exponent);
    return std::isfinite(scale) ? round(value * scale) / scale : value;
  }
  const double scale = std::pow(10.0, exponent);
  return round(value / scale) * scale;
}

int Exponent(double value) { return static_cast<int>(std::floor(std::log10(std::abs(value)))); }

double Nearest(double value) { return std::round(value); }
double Up(double value) { return std::ceil(value - 1e-9); }
double Down(double value) { return std::floor(value + 1e-9); }

std::vector<double> SortedMagnitudes(std::span<const double> values, const std::vector<char>& used) {
  std::vector<double> result;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (used[i] && std::isfinite(values[i])) result.push_back(std::abs(values[i]));
  }
  std::sort(result.begin(), result.end());
  return result;
}

// Near zero, then thirds of what is above: limits from 0 to the greatest magnitude, rounded, increasing. A single limit
// (0) when all is zero.
std::vector<double> MagnitudeLimits(const std::vector<double>& sorted) {
  if (sorted.empty() || sorted.back() == 0) return {0};
  const double high = Quantile(sorted, 0.95) > 0 ? Quantile(sorted, 0.95) : sorted.back();
  const double near_zero = RoundToTwoDigits(kNearZeroPart * high);
  std::vector<double> limits = {0, near_zero};
  const std::vector<double> above(std::lower_bound(sorted.begin(), sorted.end(), near_zero), sorted.end());
  const double top = RoundToDecimal(sorted.back(), Exponent(sorted.back()) - 1, Up);
  if (!above.empty()) {
    for (const double part : {1.0 / 3, 2.0 / 3}) {
      const double limit = RoundToTwoDigits(Quantile(above, part));
      if (limit > limits.back() && limit < top) limits.push_back(limit);
    }
  }
  if (top > limits.back()) limits.push_back(top);
  return limits;
}

// Bin i holds limits[i] <= value < limits[i + 1]; what is outside goes to the first or last bin.
int BinOf(double value, const std::vector<double>& limits) {
  const auto above = std::upper_bound(limits.begin() + 1, limits.end() - 1, value);
  return static_cast<int>(above - limits.begin()) - 1;
}

// What ByLimits divides.
struct Divided {
  ConditionFamily family;
  std::span<const double> values;
  bool magnitude;  // is divided, not the value itself
  std::string name, unit;
};

Partition ByLimits(const Divided& divided, const std::vector<char>& used, const std::vector<double>& limits) {
  const auto& [family, values, magnitude, name, unit] = divided;
  Partition partition{.family = family, .names = {}, .bin = std::vector<int>(values.size(), -1)};
  for (std::size_t i = 0; i + 1 < limits.size(); ++i) {
    partition.names.push_back(name + " " + NumberText(limits[i]) + ".." + NumberText(limits[i + 1]) +
                              (unit.empty() ? "" : " " + unit));
  }
  if (partition.names.empty()) return partition;
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!used[i] || !std::isfinite(values[i])) continue;
    partition.bin[i] = BinOf(magnitude ? std::abs(values[i]) : values[i], limits);
  }
  return partition;
}

Partition ByDirection(const ConditionInput& input, const std::vector<char>& used, double standing) {
  Partition partition{.family = ConditionFamily::kDirection,
                      .names = {"direction negative", "direction standing", "direction positive"},
                      .bin = std::vector<int>(input.speed.size(), -1)};
  for (std::size_t i = 0; i < input.speed.size(); ++i) {
    const double speed = input.speed[i];
    if (used[i] && std::isfinite(speed)) partition.bin[i] = speed >= standing ? 2 : speed <= -standing ? 0 : 1;
  }
  return partition;
}

// Time of the last reversal before or at each row; NaN before the first. A reversal is the change of sign before the
// speed passes `standing` the other way.
std::vector<double> LastReversal(const ConditionInput& input, double standing) {
  const std::size_t n = input.speed.size();
  std::vector<double> reversal(n, kNaN);
  int direction = 0;
  std::size_t crossing = 0, previous = n;  // row of the latest change of sign; latest finite row
  double crossing_s = 0, current_s = kNaN;
  for (std::size_t i = 0; i < n; ++i) {
    const double speed = input.speed[i];
    if (std::isfinite(speed)) {
      if (previous < n && (input.speed[previous] < 0) != (speed < 0)) {
        const double part = input.speed[previous] / (input.speed[previous] - speed);
        crossing = i;
        crossing_s = input.time_s[previous] + part * (input.time_s[i] - input.time_s[previous]);
      }
      previous = i;
      if (std::abs(speed) >= standing) {
        const int now = speed > 0 ? 1 : -1;
        if (direction != 0 && now != direction) {
          current_s = crossing_s;
          std::fill(reversal.begin() + static_cast<std::ptrdiff_t>(crossing),
                    reversal.begin() + static_cast<std::ptrdiff_t>(i), current_s);
        }
        direction = now;
      }
    }
    reversal[i] = current_s;
  }
  return reversal;
}

Partition ByReversal(const ConditionInput& input, const std::vector<char>& used, double standing) {
  const std::string first = NumberText(kReversalLimits_s[0]), second = NumberText(kReversalLimits_s[1]);
  Partition partition{.family = ConditionFamily::kReversal,
                      .names = {"0.." + first + " s after reversal", first + ".." + second + " s after reversal",
                                "> " + second + " s after reversal", "before the first reversal"},
                      .bin = std::vector<int>(input.speed.size(), -1)};
  const std::vector<double> reversal = LastReversal(input, standing);
  for (std::size_t i = 0; i < reversal.size(); ++i) {
    if (!used[i] || !std::isfinite(input.speed[i])) continue;
    const double since_s = input.time_s[i] - reversal[i];
    partition.bin[i] = std::isnan(since_s)              ? 3
                       : since_s < kReversalLimits_s[0] ? 0
                       : since_s < kReversalLimits_s[1] ? 1
                                                        : 2;
  }
  return partition;
}

// `count` bins of equal width from low to high, limits rounded to a tenth of the width or finer.
std::vector<double> EqualLimits(double low, double high, int count) {
  if (!(high > low) || !std::isfinite(high - low)) return {low};
  const double width = (high - low) / count;
  const int exponent = Exponent(width) - 1;
  std::vector<double> limits = {RoundToDecimal(low, exponent, Down)};
  for (int i = 1; i < count; ++i) {
    const double limit = RoundToDecimal(low + i * width, exponent, Nearest);
    if (limit > limits.back()) limits.push_back(limit);
  }
  const double top = RoundToDecimal(high, exponent, Up);
  if (top > limits.back()) limits.push_back(top);
  return limits;
}

std::vector<double> AngleLimits(std::span<const double> angle, const std::vector<char>& used) {
  double low = kInfinity, high = -low;
  for (std::size_t i = 0; i < angle.size(); ++i) {
    if (!used[i] || !std::isfinite(angle[i])) continue;
    low = std::min(low, angle[i]);
    high = std::max(high, angle[i]);
  }
  return EqualLimits(low, high, kAngleBins);
}

}  // namespace

std::string NumberText(double value) {
  std::array<char, 32> buffer;
  const auto [end, code] = std::to_chars(buffer.data(), buffer.data() + buffer.size(), value == 0 ? 0.0 : value,
                                         std::chars_format::general, 6);
  return std::string(buffer.data(), end);
}

double RoundToTwoDigits(double value) { return value == 0 ? 0 : RoundToDecimal(value, Exponent(value) - 1, Nearest); }

std::vector<Partition> MakePartitions(const ConditionInput& input, const std::vector<char>& used) {
  std::vector<Partition> partitions;
  const std::vector<double> speed_limits = MagnitudeLimits(SortedMagnitudes(input.speed, used));
  const bool moves = speed_limits.size() > 1;
  if (moves) {
    partitions.push_back(
        ByLimits({ConditionFamily::kSpeed, input.speed, true, "speed", input.speed_unit}, used, speed_limits));
    partitions.push_back(ByDirection(input, used, speed_limits[1]));
  }
  if (!input.command.empty()) {
    const std::vector<double> limits = MagnitudeLimits(SortedMagnitudes(input.command, used));
    partitions.push_back(
        ByLimits({ConditionFamily::kCommand, input.command, true, "|command|", input.command_unit}, used, limits));
  }
  if (moves) partitions.push_back(ByReversal(input, used, speed_limits[1]));
  if (!input.angle.empty()) {
    partitions.push_back(ByLimits({ConditionFamily::kAngle, input.angle, false, "angle", input.angle_unit}, used,
                                  AngleLimits(input.angle, used)));
  }
  if (input.time_s.size() > 1) {
    partitions.push_back(ByLimits({ConditionFamily::kTime, input.time_s, false, "time", "s"}, used,
                                  EqualLimits(input.time_s.front(), input.time_s.back(), kTimeBins)));
  }
  return partitions;
}

}  // namespace gapscope
