#include "src/log/inspect.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/log/inspect_parts.h"
#include "src/log/signal_checks.h"

namespace gapscope {
namespace {

ChannelReport Describe(const InspectChannel& channel) {
  ChannelReport report{.name = channel.name, .unit = channel.unit, .role = channel.role};
  const double nan = kNaN;
  std::size_t count = 0;
  double low = nan, high = nan, mean = 0, squares = 0;
  for (const double x : channel.values) {
    if (!std::isfinite(x)) continue;
    ++count;
    low = count == 1 ? x : std::min(low, x);
    high = count == 1 ? x : std::max(high, x);
    // Welford: no overflow of a sum, no cancellation.
    const double before = mean;
    mean += (x - mean) / static_cast<double>(count);
    squares += (x - before) * (x - mean);
  }
  const auto rows = static_cast<double>(channel.values.size());
  report.minimum = low;
  report.maximum = high;
  report.mean = count > 0 ? mean : nan;
  report.deviation = count > 0 ? std::sqrt(squares / static_cast<double>(count)) : nan;
  report.missing_share = 1 - static_cast<double>(count) / rows;
  report.quantisation_step = QuantisationStep(channel.values);
  report.noise = NoiseEstimate(channel.values, report.quantisation_step);
  report.saturation_share = static_cast<double>(FindSaturation(channel.values).count) / rows;
  return report;
}

bool IsConstant(const ChannelReport& report) { return !(report.maximum > report.minimum); }

}  // namespace

bool IsPositionUnit(const std::string& unit) { return unit == "rad" || unit == "m"; }
bool IsSpeedUnit(const std::string& unit) { return unit == "rad/s" || unit == "m/s"; }

UniformSignal ResampleUniform(const std::vector<double>& time_s, const std::vector<double>& values, double step_s,
                              bool hold, std::size_t most) {
  std::vector<double> t, x;
  for (std::size_t k = 0; k < values.size(); ++k) {
    if (!std::isfinite(values[k])) continue;
    t.push_back(time_s[k]);
    x.push_back(values[k]);
  }
  UniformSignal signal;
  if (t.size() < 2) return signal;
  const double duration_s = time_s.back() - time_s.front();
  // A log that is mostly one gap is not worth more than a few points per row.
  most = std::min(most, 4 * values.size() + 1024);
  step_s = std::max(step_s, duration_s / static_cast<double>(most - 1));
  const auto points = static_cast<std::size_t>(std::floor(duration_s / step_s * (1 + 1e-12))) + 1;
  signal.step_s = step_s;
  signal.values.reserve(points);
  std::size_t k = 0;
  for (std::size_t i = 0; i < points; ++i) {
    const double at = time_s.front() + static_cast<double>(i) * step_s;
    // A grid point that differs from a stamp by rounding only is that stamp.
    while (k + 1 < t.size() && t[k + 1] <= at + 1e-6 * step_s) ++k;
    if (hold || k + 1 == t.size() || at <= t[k]) {
      signal.values.push_back(x[k]);
    } else {
      const double share = (at - t[k]) / (t[k + 1] - t[k]);
      signal.values.push_back(x[k] + share * (x[k + 1] - x[k]));
    }
  }
  return signal;
}

InspectReport Inspect(const Timeline& timeline, const std::vector<InspectChannel>& channels,
                      const std::vector<Finding>& findings, std::size_t rows_in_log, const InspectOptions& options) {
  GS_CHECK(timeline.time_s.size() >= 2);
  InspectReport report;
  report.rows = timeline.time_s.size();
  report.rows_in_log = rows_in_log;
  report.duration_s = timeline.time_s.back() - timeline.time_s.front();
  report.rate_hz = static_cast<double>(report.rows - 1) / report.duration_s;
  report.median_step_s = timeline.median_step_s;
  report.shortest_step_s = timeline.shortest_step_s;
  report.longest_step_s = timeline.longest_step_s;
  report.jitter_s = timeline.jitter_s;
  report.time_column = timeline.time_column;
  report.time_unit = timeline.time_unit;
  report.findings = findings;
  for (const auto& finding : timeline.findings) {
    if (finding.kind == "gap") report.gaps = finding.count;
  }

  const double step_s = timeline.median_step_s;
  for (const auto& channel : channels) {
    GS_CHECK(channel.values.size() == report.rows);
    report.channels.push_back(Describe(channel));
  }
  const auto signals = Collect(channels, [&](const InspectChannel& channel) {
    return ResampleUniform(timeline.time_s, channel.values, step_s, channel.role == ChannelRole::kCommand);
  });
  for (std::size_t c = 0; c < channels.size(); ++c) {
    if (IsConstant(report.channels[c])) continue;
    if (channels[c].role == ChannelRole::kMeasured) {
      if (IsPositionUnit(channels[c].unit) || IsSpeedUnit(channels[c].unit)) {
        report.coverage.push_back(MeasureCoverage(channels[c], report.channels[c], timeline.time_s, step_s));
      }
      continue;
    }
    report.excitation.push_back(MeasureExcitation(channels[c], timeline.time_s, step_s));
    for (std::size_t m = 0; m < channels.size(); ++m) {
      if (channels[m].role != ChannelRole::kMeasured || IsConstant(report.channels[m])) continue;
      const double longest_s = std::min(options.longest_delay_s, report.duration_s / 4);
      const BestShift best = FindDelay(signals[c], signals[m], longest_s);
      report.delays.push_back({channels[c].name, channels[m].name, best.shift_s, best.correlation,
                               std::abs(best.correlation) >= 0.5 && !best.at_end});
    }
  }
  WriteVerdict(options, &report);
  return report;
}

}  // namespace gapscope
