// Is a log fit for use? Its timing, the quality of each channel, the delays between them, and what the commands excite:
// what can be identified from this log and what cannot. A pure function of values on a timeline.
#ifndef GAPSCOPE_LOG_INSPECT_H_
#define GAPSCOPE_LOG_INSPECT_H_

#include <cstddef>
#include <string>
#include <vector>

#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

enum class ChannelRole { kCommand, kMeasured };

// One signal on the timeline: values.size() == timeline.time_s.size(), NaN where the log has none. `unit` is SI; it
// decides what is an angle or a way ("rad", "m"), a speed ("rad/s", "m/s") or neither.
struct InspectChannel {
  std::string name, unit;
  ChannelRole role = ChannelRole::kMeasured;
  std::vector<double> values;
};

struct ChannelReport {
  std::string name, unit;
  ChannelRole role = ChannelRole::kMeasured;
  double minimum = 0, maximum = 0, mean = 0, deviation = 0;  // NaN: no value at all
  double quantisation_step = 0;                              // 0: none found
  double noise = 0;                                          // standard deviation of white noise, estimated
  double saturation_share = 0;                               // of rows
  double missing_share = 0;                                  // of rows
};

// By how much a measured channel follows a command: the shift of the largest |cross-correlation|, refined by a
// parabola. Of a position this is the lag of the motion, of which the dead time is a part only.
struct DelayReport {
  std::string command, measured;
  double delay_s = 0;      // positive: the measured channel is later
  double correlation = 0;  // at that shift, -1..1
  bool reliable = false;   // |correlation| >= 0.5 and the shift is not at the end of the range searched
};

struct BandShare {
  double low_hz = 0, high_hz = 0;
  double share = 0;  // of the power without the mean
};

// Frequency content and amplitudes of a command.
struct CommandExcitation {
  std::string name;
  std::vector<BandShare> bands;  // decades up to half the sample rate
  double bandwidth_95_hz = 0;    // 95 % of the power lies below
  double peak_hz = 0;
  double range = 0;
  double amplitude_ratio = 0;  // 90th to 10th percentile of the half-cycles' peaks; 1: one amplitude
  std::size_t half_cycles = 0;
};

// Where a measured position or speed goes, for channels in rad, m, rad/s or m/s.
struct MotionCoverage {
  std::string name;
  double range = 0;           // largest minus smallest value
  double speed_max = 0;       // units per second; 99.9th percentile
  std::size_t reversals = 0;  // changes of direction
  double moving_share = 0;    // of time, above the speed that noise and counts feign
  double rest_share = 0;      // 1 - moving_share
  double slow_share = 0;      // of time, moving below 10 % of speed_max
  double positive_share = 0;  // of the moving time
};

struct InspectReport {
  std::size_t rows = 0, rows_in_log = 0;
  double duration_s = 0, rate_hz = 0;
  double median_step_s = 0, shortest_step_s = 0, longest_step_s = 0, jitter_s = 0;
  std::string time_column, time_unit;
  std::size_t gaps = 0;
  std::vector<Finding> findings;  // of reading, timeline and channels, as given
  std::vector<ChannelReport> channels;
  std::vector<DelayReport> delays;
  std::vector<CommandExcitation> excitation;
  std::vector<MotionCoverage> coverage;
  bool fit = true;
  std::vector<std::string> unfit_because;  // empty when fit
  std::vector<std::string> verdict;        // sentences: what this log can and cannot identify
};

struct InspectOptions {
  double longest_delay_s = 0.5;  // range of the search; never more than a quarter of the log
  std::size_t fewest_rows = 50;
  double most_missing = 0.1;  // share of rows of a channel without a value, or of the log's rows lost to repairs
};

// `findings`: all that was found before (reading, timeline, extraction). Every channel must have the timeline's length.
InspectReport Inspect(const Timeline& timeline, const std::vector<InspectChannel>& channels,
                      const std::vector<Finding>& findings, std::size_t rows_in_log,
                      const InspectOptions& options = {});

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_INSPECT_H_
