// Effects outside the list: from outside, changing with time, in a sensor or a clock, hidden dynamics.
#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/twin/case.h"

namespace gapscope::twin {

std::vector<std::string> OutsideNames() {
  return {"external_torque",    "friction_warm_up", "gain_drift",        "hidden_resonator", "sensor_scale_drift",
          "sensor_wheel_error", "sensor_play",      "time_stamp_bursts", "clock_drift",      "intermittent_hold"};
}

Values AddOutside(const std::string& name, double severity, std::uint64_t shape_seed, const Motion& motion,
                  Plant* plant) {
  Random random(shape_seed, 0, name);
  Outside& o = plant->outside;
  const double turn = 2 * std::numbers::pi, s = severity;
  const int last = SignalCount(plant->rig) - 1;
  if (name == "external_torque") {
    o.torque_n_m = 0.1 * s * motion.torque_rms_n_m;
    o.torque_hz = random.LogUniform(0.7, 6);
    o.torque_phase_rad = random.Uniform(0, turn);
    return {{"torque_n_m", o.torque_n_m}, {"frequency_hz", o.torque_hz}, {"phase_rad", o.torque_phase_rad}};
  }
  if (name == "friction_warm_up") {
    o.warm_up = s;
    o.warm_up_time_s = random.Uniform(1, 4);
    return {{"excess", o.warm_up}, {"time_constant_s", o.warm_up_time_s}};
  }
  if (name == "gain_drift") {
    o.gain_swing = std::min(0.08 * s, 0.7);
    o.gain_hz = random.LogUniform(0.08, 0.5);
    o.gain_phase_rad = random.Uniform(0, turn);
    return {{"swing", o.gain_swing}, {"frequency_hz", o.gain_hz}, {"phase_rad", o.gain_phase_rad}};
  }
  if (name == "hidden_resonator") {
    o.resonator_share = std::min(0.15 * s, 1.0);
    o.resonator_hz = random.Uniform(4, 10);
    o.resonator_damping = random.Uniform(0.01, 0.04);
    return {
        {"inertia_share", o.resonator_share}, {"frequency_hz", o.resonator_hz}, {"damping_ratio", o.resonator_damping}};
  }
  if (name == "sensor_scale_drift") {
    o.scale_drift_per_s = random.Sign() * std::min(0.01 * s, 0.08);
    o.drift_signal = random.Integer(0, last);
    return {{"drift_per_s", o.scale_drift_per_s}, {"signal", static_cast<double>(o.drift_signal)}};
  }
  if (name == "sensor_wheel_error") {
    o.wheel_error_rad = std::min(0.02 * s, 0.3);
    o.wheel_phase_rad = random.Uniform(0, turn);
    return {{"amplitude_rad", o.wheel_error_rad}, {"phase_rad", o.wheel_phase_rad}};
  }
  if (name == "sensor_play") {
    o.play_rad = 0.01 * s;
    o.play_signal = random.Integer(0, last);
    return {{"play_rad", o.play_rad}, {"signal", static_cast<double>(o.play_signal)}};
  }
  if (name == "time_stamp_bursts") {
    o.bad_stamp_bursts = random.Integer(4, 10);
    o.bad_stamp_rows = std::max(1, static_cast<int>(std::lround(8 * s)));
    return {{"bursts", static_cast<double>(o.bad_stamp_bursts)}, {"rows", static_cast<double>(o.bad_stamp_rows)}};
  }
  if (name == "clock_drift") {
    o.clock_drift_per_s = random.Sign() * std::min(0.005 * s, 0.03);
    return {{"drift_per_s", o.clock_drift_per_s}};
  }
  o.hold_per_s = random.Uniform(1, 3);
  o.hold_time_s = std::min(0.03 * s, 0.25);
  return {{"holds_per_s", o.hold_per_s}, {"hold_time_s", o.hold_time_s}};
}

bool DrawOutside(const CaseRequest& request, Random* random, Case* c, std::string* problem) {
  const auto names = OutsideNames();
  if (!request.effect.empty() && std::find(names.begin(), names.end(), request.effect) == names.end()) {
    *problem = "no effect outside the list is called '" + request.effect + "'";
    return false;
  }
  c->outside = request.effect.empty()
                   ? names[static_cast<std::size_t>(random->Integer(0, static_cast<int>(names.size()) - 1))]
                   : request.effect;
  const auto shape = static_cast<std::uint64_t>(random->Unit() * 0x1.0p53);
  c->logs = DrawCampaign(c->base, c->outside == "external_torque" && c->rig != Rig::kJoint, random);
  const Motion motion = MotionOf(c->base, c->logs);
  const auto plant_at = [&](double severity) {
    Plant plant = c->base;
    c->outside_parameters = AddOutside(c->outside, severity, shape, motion, &plant);
    return plant;
  };
  double severity = request.severity;
  bool shows = true;
  if (severity <= 0) {
    const Search found = FindSeverity(plant_at, c->base, c->logs, c->sensors, random->LogUniform(6, 60), 0.02, 10);
    severity = found.severity;
    shows = severity > 0 && found.gap.refit >= 4;
  }
  c->truth = plant_at(severity);
  c->outside_severity = severity;
  return shows;
}

}  // namespace gapscope::twin
