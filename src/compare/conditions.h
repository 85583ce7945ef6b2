// Where the gap lies: how much of a signal's squared error falls in each condition (speed, direction, |command|, time
// since the last reversal, angle, part of the log, frequency band), against how much of the time. Coulomb friction
// shows near zero speed, a torque-speed curve at high speed, a delay at high frequency.
#ifndef GAPSCOPE_COMPARE_CONDITIONS_H_
#define GAPSCOPE_COMPARE_CONDITIONS_H_

#include <cstdint>
#include <span>
#include <string>
#include <vector>

namespace gapscope {

// One signal of one log. Spans are empty or as long as `time_s`; rows where `measured` or `predicted` is not finite are
// left out. Without speed there are no families of speed, direction and reversal; likewise command and angle.
struct ConditionInput {
  std::string signal;
  std::span<const double> time_s;  // strictly increasing
  std::span<const double> measured, predicted;
  std::span<const double> speed;    // of the joint in question, smoothed: noise around zero would count as reversals
  std::span<const double> command;  // of the actuator in question
  std::span<const double> angle;    // of the joint in question
  std::string speed_unit = "rad/s", command_unit, angle_unit = "rad";  // for the names
};

// The conditions of one family split the rows (or the spectrum) between them: their shares add up to one.
enum class ConditionFamily { kSpeed, kDirection, kCommand, kReversal, kAngle, kTime, kFrequency };

struct ConditionShare {
  std::string signal, condition;  // "arm_rad", "speed 0..0.2 rad/s"
  double share_of_error = 0;      // of the family's sum of squared errors; 0..1
  // Of the family's rows; for kFrequency the share of the measured signal's mean square (mean removed) that lies in the
  // band, since a band has no time of its own: an error spread like the signal is one of gain.
  double share_of_time = 0;
  double low = 0, high = 0;  // 90 % interval of share_of_error; NaN below 20 rows
  ConditionFamily family = ConditionFamily::kSpeed;
};

struct ConditionOptions {
  std::uint64_t seed = 0;
  int replicates = 400;  // bootstrap samples, >= 20
};

// Families and their limits (limits are rounded as they are printed, and used so):
//   speed, |command|  four bins of the magnitude: up to 5 % of its 95th percentile, then thirds of the rows above that
//   direction         speed above, below, or within +- the first limit of the speed
//   reversal          0..0.1, 0.1..0.3, > 0.3 s since the speed last changed sign (counted when it then passes the
//                     first limit), and before the first reversal
//   angle             five bins of equal width
//   time              tenths of the log's duration
//   frequency         the error's mean ("constant"), and bands with limits at 1/4, 1/2, 1 and 2 times the signal's
//                     bandwidth, up to which 95 % of its mean square lies. Rows count as the median step apart.
// A row whose speed (command, angle) is not finite is left out of that family. A family with only one condition that
// occurs says nothing and is left out; so is a condition that never occurs.
//
// Every row weighs the same, as in an RMSE. Intervals: circular block bootstrap of rows (Politis and Romano 1992),
// blocks six integrated correlation times (noise.h) of the slowest condition's part in the error long, between 1/200
// and 1/10 of the log; percentiles 5 and 95, widened for the small number of blocks (conditions.cc). They hold for a
// log made anew in the same manner; what happened once is given a wide interval. Where the condition is random and
// seldom changes they cover less than the 90 % they aim at (conditions_test.cc, 1000 logs each: 0.88 with 130
// independent spells of the condition in a log, 0.85 with 25).
//
// Order: by family, then by limits. Empty for fewer than 3 rows or an error of exactly zero. Same input, same bytes.
std::vector<ConditionShare> LocateError(const ConditionInput& input, const ConditionOptions& options = {});

struct TellingOptions {
  double least_share = 0.1;    // of the error
  double least_ratio = 1.3;    // share of error / share of time
  std::size_t per_family = 2;  // rows of one signal and family
  std::size_t limit = 8;       // rows in all
};

// The rows where the error is far above its share of the time: `low` above share_of_time and the limits of `options`
// kept. Sorted by low - share_of_time, greatest first; ties by signal, family, condition.
std::vector<ConditionShare> MostTelling(std::span<const ConditionShare> shares, const TellingOptions& options = {});

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_CONDITIONS_H_
