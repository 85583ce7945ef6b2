// The parts of Inspect, apart for tests: the uniform grid, delays, spectra, coverage, words.
#ifndef GAPSCOPE_LOG_INSPECT_PARTS_H_
#define GAPSCOPE_LOG_INSPECT_PARTS_H_

#include <string>
#include <vector>

#include "src/log/inspect.h"

namespace gapscope {

// Values at start, start + step ...: linear between samples for what was measured, held for commands. NaN are bridged.
// Empty with fewer than two finite values. At most `most` points, and at most about four per value: the step grows if
// need be.
struct UniformSignal {
  double step_s = 0;
  std::vector<double> values;
};
UniformSignal ResampleUniform(const std::vector<double>& time_s, const std::vector<double>& values, double step_s,
                              bool hold, std::size_t most = std::size_t{1} << 21);

// Cross-correlation of two signals on the same grid, means removed, by FFT; shifts within +-longest_s, at most a third
// of the signal. r(shift) = sum x[k] y[k+shift] / sqrt(sum x[k]^2 sum y[k+shift]^2), k over the same middle stretch of
// x for every shift.
struct BestShift {
  double shift_s = 0, correlation = 0;
  bool at_end = false;
};
BestShift FindDelay(const UniformSignal& x, const UniformSignal& y, double longest_s);

CommandExcitation MeasureExcitation(const InspectChannel& command, const std::vector<double>& time_s, double step_s);

// `report` gives counts and noise of the same channel.
MotionCoverage MeasureCoverage(const InspectChannel& channel, const ChannelReport& report,
                               const std::vector<double>& time_s, double step_s);
bool IsPositionUnit(const std::string& unit);
bool IsSpeedUnit(const std::string& unit);

// Fills fit, unfit_because and verdict from the rest.
void WriteVerdict(const InspectOptions& options, InspectReport* report);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_INSPECT_PARTS_H_
