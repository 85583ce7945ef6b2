// WriteVerdict of inspect_parts.h: the figures in words.
#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/log/inspect_parts.h"

namespace gapscope {
namespace {

constexpr double kOneAmplitude = 1.5;  // ratio of amplitudes below which there is one
constexpr std::size_t kFewReversals = 4;
constexpr double kSlowEnough = 0.02;  // share of time
constexpr double kRestEnough = 0.02;
constexpr double kOneSided = 0.9;  // share of the moving time in one direction

class Verdict {
 public:
  Verdict(const InspectOptions& options, InspectReport* report) : options_(options), report_(*report) {}

  void Write() {
    JudgeTiming();
    for (const auto& channel : report_.channels) JudgeChannel(channel);
    JudgeRoles();
    for (const auto& command : report_.excitation) JudgeExcitation(command);
    for (const auto& motion : report_.coverage) JudgeCoverage(motion);
    for (const auto& delay : report_.delays) JudgeDelay(delay);
    report_.fit = report_.unfit_because.empty();
    if (report_.verdict.empty())
      report_.verdict.push_back(
          "nothing speaks against this log: range, directions, speeds and frequencies are covered");
  }

 private:
  void Unfit(std::string why) { report_.unfit_because.push_back(std::move(why)); }
  void Say(std::string sentence) { report_.verdict.push_back(std::move(sentence)); }

  void JudgeTiming() {
    if (report_.rows < options_.fewest_rows)
      Unfit(fmt::format("only {} rows, {} are needed", report_.rows, options_.fewest_rows));
    const double lost = report_.rows_in_log > report_.rows
                            ? 1 - static_cast<double>(report_.rows) / static_cast<double>(report_.rows_in_log)
                            : 0;
    if (lost > options_.most_missing) {
      Unfit(fmt::format("{:.1f} % of the rows were dropped by repairs of the time", 100 * lost));
    }
    if (report_.longest_step_s > 0.2 * report_.duration_s) {
      Unfit(fmt::format("one gap of {:.3g} s is more than a fifth of the log", report_.longest_step_s));
    } else if (report_.gaps > 0) {
      Say(fmt::format(
          "{} gaps up to {:.3g} s: what was sent within them is unknown; windows that cross them are less sure",
          report_.gaps, report_.longest_step_s));
    }
    if (report_.jitter_s > 0.1 * report_.median_step_s) {
      Say(fmt::format("irregular stamps (jitter {:.2g} s, {:.0f} % of a step): delays are known no better than that",
                      report_.jitter_s, 100 * report_.jitter_s / report_.median_step_s));
    }
  }

  void JudgeChannel(const ChannelReport& channel) {
    const double range = channel.maximum - channel.minimum;
    if (channel.missing_share > options_.most_missing) {
      const std::string text =
          fmt::format("'{}' has no value in {:.1f} % of the rows", channel.name, 100 * channel.missing_share);
      channel.role == ChannelRole::kCommand || channel.missing_share == 1 ? Unfit(text) : Say(text);
    }
    if (channel.saturation_share > 0.01) {
      Say(fmt::format("'{}' is at its limit in {:.1f} % of the rows: {}", channel.name, 100 * channel.saturation_share,
                      channel.role == ChannelRole::kCommand ? "gains show in the other rows only, limits show well"
                                                            : "its true value there is unknown"));
    }
    if (channel.role == ChannelRole::kMeasured && channel.quantisation_step > 0 && range > 0 &&
        channel.quantisation_step > 0.02 * range) {
      Say(fmt::format("'{}' moves over {:.0f} counts only: small effects drown in its counts of {:.3g} {}",
                      channel.name, range / channel.quantisation_step, channel.quantisation_step, channel.unit));
    }
  }

  void JudgeRoles() {
    std::size_t commands = 0, measured = 0, moving = 0;
    for (const auto& channel : report_.channels) {
      commands += channel.role == ChannelRole::kCommand;
      measured += channel.role == ChannelRole::kMeasured;
      const double range = channel.maximum - channel.minimum;
      moving +=
          channel.role == ChannelRole::kMeasured && range > std::max(3 * channel.quantisation_step, 6 * channel.noise);
    }
    if (measured == 0) Unfit("no measured channel");
    if (measured > 0 && moving == 0) Unfit("no measured channel moves by more than its noise and counts");
    if (commands == 0) Say("no command: free motion only, so inertia and torque constants cannot be told from scale");
    if (commands > 0 && report_.excitation.empty())
      Say("the commands are constant: no gain, delay or lag can be identified, friction and load only");
  }

  void JudgeExcitation(const CommandExcitation& command) {
    const double rate_hz = 1 / report_.median_step_s;
    if (command.bandwidth_95_hz > 0.4 * rate_hz) {
      Say(fmt::format("'{}' has content up to the sample rate: what happens between samples is lost", command.name));
    } else {
      // Up to w T = 0.2 a dead time exp(-i w T) and a lag 1 / (1 + i w T) differ by 2 % in size, less in phase.
      const double alike_s = 0.2 / (2 * std::numbers::pi * std::max(command.bandwidth_95_hz, 1e-9));
      Say(
          fmt::format("no content of '{}' above {:.2g} Hz: dead time and lag below {:.2g} s are indistinguishable; "
                      "resonances above do not show",
                      command.name, command.bandwidth_95_hz, alike_s));
    }
    if (command.half_cycles >= 2 && command.amplitude_ratio < kOneAmplitude) {
      Say(
          fmt::format("one amplitude of '{}': what grows with amplitude (saturation, backlash, dead zones) cannot be "
                      "told from a gain",
                      command.name));
    }
    if (command.half_cycles < 2) {
      Say(fmt::format("'{}' never changes sign about its mean: gains for the two directions cannot be told apart",
                      command.name));
    }
  }

  void JudgeCoverage(const MotionCoverage& motion) {
    if (motion.moving_share == 0) {
      Say(fmt::format("'{}' does not move by more than its noise and counts", motion.name));
      return;
    }
    if (motion.reversals == 0) {
      Say(fmt::format("no reversal of '{}': Coulomb friction and a bias cannot be told apart, backlash does not show",
                      motion.name));
    } else if (motion.reversals < kFewReversals) {
      Say(fmt::format("only {} reversals of '{}': backlash and Coulomb friction are weakly determined",
                      motion.reversals, motion.name));
    }
    if (motion.reversals > 0 && (motion.positive_share > kOneSided || motion.positive_share < 1 - kOneSided)) {
      Say(
          fmt::format("'{}' moves in one direction for {:.0f} % of its moving time: direction-dependent effects are "
                      "weakly determined",
                      motion.name, 100 * std::max(motion.positive_share, 1 - motion.positive_share)));
    }
    if (motion.slow_share < kSlowEnough) {
      Say(fmt::format("no slow motion of '{}': Stribeck friction and stiction do not show", motion.name));
    }
    if (motion.rest_share < kRestEnough) {
      Say(fmt::format("'{}' is never at rest: break-away and the sensor's zero are not seen", motion.name));
    }
  }

  void JudgeDelay(const DelayReport& delay) {
    if (!delay.reliable) return;
    if (delay.delay_s < -report_.median_step_s) {
      Say(fmt::format("'{}' moves {:.3g} ms before the command '{}': are their rows paired rightly?", delay.measured,
                      -1000 * delay.delay_s, delay.command));
    }
    // Of a target and what follows it only: a position may well oppose a voltage.
    if (delay.correlation < 0 && UnitOf(delay.command) == UnitOf(delay.measured)) {
      Say(fmt::format("'{}' moves against '{}': is a sign wrong?", delay.measured, delay.command));
    }
  }

  std::string UnitOf(const std::string& name) const {
    for (const auto& channel : report_.channels) {
      if (channel.name == name) return channel.unit;
    }
    return "";
  }

  const InspectOptions& options_;
  InspectReport& report_;
};

}  // namespace

void WriteVerdict(const InspectOptions& options, InspectReport* report) { Verdict(options, report).Write(); }

}  // namespace gapscope
