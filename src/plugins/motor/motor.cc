#include "src/plugins/motor/motor.h"

#include <algorithm>
#include <cmath>
#include <limits>
#include <string>

#include "src/plugins/common/refusal.h"
#include "src/plugins/common/register.h"
#include "src/plugins/friction/law.h"

namespace gapscope::plugins {
namespace {

// Whether the engine evaluates forces within a step, at times after its start.
bool Staged(const mjModel* m) { return m->opt.integrator == mjINT_RK4; }

bool Disabled(const mjModel* m, int actuator) {
  const int group = m->actuator_group[actuator];
  return m->opt.disableactuator != 0 && group >= 0 && group < 31 && (m->opt.disableactuator & (1 << group)) != 0;
}

}  // namespace

std::unique_ptr<Motor> Motor::Create(const mjModel* m, int instance) {
  auto motor = std::make_unique<Motor>();
  MotorConfig& config = motor->config_;
  const std::string problem = config.Parse(m, instance);
  motor->state_ = m->plugin_stateadr[instance];
  if (!problem.empty()) {
    if (Refuse(m, problem)) return nullptr;
    motor->inert_ = true;
    return motor;
  }
  int input = 0;
  for (int i = 0; i < m->nactuator; ++i) {
    if (m->actuator_plugin[i] == instance) motor->actuator_[input++] = i;
  }
  motor->first_ = motor->actuator_[0];
  motor->output_ = m->actuator_outadr[motor->first_];
  motor->capacity_ = History::Capacity(m->plugin_statenum[instance] - MotorState::kSlots, config.inputs);

  const auto active = [&](std::initializer_list<MotorParameter> parameters) {
    return std::any_of(parameters.begin(), parameters.end(),
                       [&](MotorParameter p) { return !config.live.IsNeutral(p, kMotorSpecs[p].neutral); });
  };
  int activation = m->actuator_actadr[motor->first_];
  if (active({kTimeConstant})) motor->lag_ = activation++;
  if (active({kSecondTimeConstant})) motor->second_lag_ = activation++;
  if (active({kSagFraction})) motor->sag_ = activation++;
  motor->history_ = motor->capacity_ > 0 && active({kCommandDelay, kTorqueDelay});
  motor->dead_zone_ = active({kDeadZone});
  motor->trapeze_ = active({kPeakTorque});
  motor->forcerange_ = m->actuator_forcelimited[motor->first_];
  motor->limits_ = motor->trapeze_ || motor->forcerange_ || !config.motoring.empty() || !config.generating.empty() ||
                   active({kTorqueLimit, kPower, kGeneratingPower}) || motor->sag_ >= 0;
  motor->droop_ = active({kDroopAtPeak});
  motor->asymmetry_ = active({kAsymmetry});
  motor->command_asymmetry_ = active({kCommandAsymmetry});
  motor->softness_ = active({kLimitSoftness});
  motor->efficiency_ = active({kEfficiencyDrive, kEfficiencyBackdrive});
  motor->friction_ = active({kFrictionSlope});
  motor->supply_ = config.law == MotorLaw::kDuty || config.input_of[kSupply] >= 0 || active({kSupplyV});
  motor->enable_ = config.input_of[kEnable] >= 0;
  return motor;
}

void Motor::ReadCommands(const mjModel* m, const mjData* d, double* command) const {
  const bool clamp = !(m->opt.disableflags & mjDSBL_CLAMPCTRL);
  for (int i = 0; i < config_.inputs; ++i) {
    const int address = m->actuator_ctrladr[actuator_[i]];
    command[i] = d->ctrl[address];
    if (clamp && m->actuator_ctrllimited[address]) {
      command[i] = mju_clip(command[i], m->actuator_ctrlrange[2 * address], m->actuator_ctrlrange[2 * address + 1]);
    }
  }
}

double Motor::Winding(const mjModel* m, double voltage, double speed) const {
  const double gear = Parameter(m, kGear);
  return gear * Parameter(m, kKt) * (voltage - Parameter(m, kKe) * gear * speed) / Parameter(m, kResistance);
}

double Motor::Request(const mjModel* m, const double* inputs, Motion seen, double speed, double supply) const {
  double command = inputs[config_.command];
  if (dead_zone_ && config_.dead_zone_on_command) command = DeadZone(command, Parameter(m, kDeadZone));
  if (command_asymmetry_) command *= 1 + (command > 0 ? 1 : -1) * Parameter(m, kCommandAsymmetry);
  double torque = 0;
  switch (config_.law) {
    case MotorLaw::kPosition:
      torque = Parameter(m, kKp) * (command - seen.q) + Parameter(m, kKd) * (Input(inputs, kVelocity, 0) - seen.qdot);
      break;
    case MotorLaw::kTorque:
      torque = Parameter(m, kGain) * command;
      break;
    case MotorLaw::kCurrent:
      torque = Parameter(m, kGear) * Parameter(m, kKt) * command;
      break;
    case MotorLaw::kVoltage:
      torque = Winding(m, supply_ && supply > 0 ? mju_clip(command, -supply, supply) : command, speed);
      break;
    case MotorLaw::kDuty: {
      const double limit = Parameter(m, kDutyLimit);
      const double duty = Parameter(m, kDutyGain) * (command - seen.q) - Parameter(m, kDutyDamping) * seen.qdot;
      torque = Winding(m, mju_clip(duty, -limit, limit) * supply, speed);
      break;
    }
    case MotorLaw::kAffine:
      torque = Parameter(m, kGain) * command +
               (Parameter(m, kBias0) + Parameter(m, kBias1) * seen.q + Parameter(m, kBias2) * seen.qdot);
      break;
  }
  return torque + Input(inputs, kFeedforward, 0);
}

Motor::Limits Motor::LimitsAt(const mjModel* m, double torque, double speed) const {
  const bool motoring = torque * speed > 0;
  const double size = std::abs(speed);
  double limit = kUnlimited;
  if (const double level = Parameter(m, kTorqueLimit); level > 0) limit = level;
  if (const double power = Parameter(m, motoring ? kPower : kGeneratingPower); power > 0 && torque * speed != 0) {
    limit = std::min(limit, PowerLimit(size, power));
  }
  if (trapeze_) {
    if (const double peak = Parameter(m, kPeakTorque); peak > 0) {
      limit = std::min(limit, torque * speed < 0
                                  ? peak * Parameter(m, kGeneratingFactor)
                                  : TrapezeLimit(size, peak, Parameter(m, kRatedSpeed), Parameter(m, kNoLoadSpeed)));
    }
  }
  if (torque * speed < 0 && !config_.generating.empty()) {
    limit = std::min(limit, config_.generating(size));
  } else if (!config_.motoring.empty()) {
    limit = std::min(
        limit, torque * speed < 0 ? config_.motoring.peak() * Parameter(m, kGeneratingFactor) : config_.motoring(size));
  }
  Limits limits{-limit, limit};
  if (forcerange_) {
    limits.low = std::max(limits.low, m->actuator_forcerange[2 * first_]);
    limits.high = std::min(limits.high, m->actuator_forcerange[2 * first_ + 1]);
  }
  return limits;
}

double Motor::Load(const mjModel* m, double torque, const Limits& limits, double supply) const {
  double ceiling = std::abs(torque > 0 ? limits.high : limits.low);
  if (!(ceiling < kUnlimited)) {
    const double stall_v = config_.law == MotorLaw::kDuty      ? Parameter(m, kDutyLimit) * supply
                           : config_.law == MotorLaw::kVoltage ? supply
                                                               : 0;
    ceiling = std::abs(Winding(m, stall_v, 0));
  }
  return ceiling > 0 ? std::min(1.0, std::abs(torque) / ceiling) : 0;
}

Motor::Stage Motor::Open(const mjModel* m, mjData* d) const {
  Stage at{.m = m, .d = d, .slots = d->plugin_state + state_, .staged = Staged(m), .later = false, .prime = false};
  const double opened = at.slots[MotorState::kStepTime];
  // A new step, or the same one again after the host changed something; else a later stage of RK4.
  at.later = at.staged && at.slots[MotorState::kStepOpen] != 0 && d->time > opened &&
             d->time <= opened + m->opt.timestep * (1 + 1e-9);
  if (!at.later) {
    at.slots[MotorState::kStepOpen] = 1;
    at.slots[MotorState::kStepTime] = d->time;
  }
  at.prime = at.slots[MotorState::kPrimed] == 0 && !at.later;
  return at;
}

Motion Motor::Late(const Stage& at, Motion present, const double* command, double* late) const {
  const double step = at.m->opt.timestep, now = at.d->time;
  History history(at.slots + MotorState::kSlots, capacity_, config_.inputs);
  if (!at.later) history.Open(now, present.q, present.qdot, command);
  const double torque_delay = std::min(Parameter(at.m, kTorqueDelay), config_.max_delay_s);
  const double command_delay = std::max(0.0, Parameter(at.m, kCommandDelay)) + std::max(0.0, torque_delay);
  history.MeanCommand(std::min(command_delay, config_.max_delay_s), step, late);
  return history.MotionAt(torque_delay, now, present, step);
}

double Motor::Limited(const Stage& at, double torque, double speed, double supply, double ceiling) const {
  const Limits limits = LimitsAt(at.m, torque, speed);
  torque = softness_
               ? SoftLimit(torque, ceiling * (torque > 0 ? limits.high : -limits.low), Parameter(at.m, kLimitSoftness))
               : mju_clip(torque, limits.low * ceiling, limits.high * ceiling);
  if (sag_ >= 0) {
    const double step = at.m->opt.timestep;
    const Lag lag(std::max(Parameter(at.m, kSagTimeConstant), step), step, at.staged);
    at.d->act_dot[sag_] = lag.Derivative(at.d->act[sag_], Load(at.m, torque, limits, supply));
  }
  return torque;
}

double Motor::Delivered(const mjModel* m, double torque, double speed) const {
  if (droop_)
    torque = Droop(torque, Parameter(m, kDroopAtPeak), Parameter(m, kDroopReference), Parameter(m, kDroopExponent));
  if (asymmetry_) torque *= 1 + (torque > 0 ? 1 : -1) * Parameter(m, kAsymmetry);
  if (efficiency_) torque *= Parameter(m, torque * speed < 0 ? kEfficiencyBackdrive : kEfficiencyDrive);
  if (friction_) {
    const DryFriction law{.breakaway_n_m = Parameter(m, kFrictionHump),
                          .stribeck_speed_rad_per_s = Parameter(m, kFrictionHumpSpeed),
                          .load_coefficient = Parameter(m, kFrictionLoad)};
    const double level = DryLevel(law, speed, 0, torque, torque);
    torque -= mju_clip(Parameter(m, kFrictionSlope) * speed, -level, level);
  }
  return torque;
}

void Motor::Compute(const mjModel* m, mjData* d, int) const {
  if (inert_ || Disabled(m, first_)) return;
  const Stage at = Open(m, d);

  // What is sent now, and what the drive knows of it.
  double command[kRoles], late[kRoles];
  const double* inputs = command;
  ReadCommands(m, d, command);
  const Motion present{d->actuator_length[output_], d->actuator_velocity[output_]};
  const double speed = present.qdot;
  Motion seen = present;
  const double supply_now = supply_ ? Input(command, kSupply, Parameter(m, kSupplyV)) : 0;
  if (history_) {
    seen = Late(at, present, command, late);
    inputs = late;
  }
  const double enable = enable_ ? mju_clip(inputs[config_.input_of[kEnable]], 0, 1) : 1;

  // A step of one lag: its output for `target`.
  const auto lagged = [&](int act, MotorParameter constant, double target, double request) {
    if (at.prime) d->act[act] = target;
    const Lag lag(Parameter(m, constant), m->opt.timestep, at.staged);
    d->act_dot[act] = lag.Derivative(d->act[act], target);
    return lag.Output(d->act[act], request);
  };
  // On a voltage drive the second pole is the amplifier's, before the winding: the back-EMF does not pass it.
  double filtered[kRoles];
  const bool amplifier = second_lag_ >= 0 && (config_.law == MotorLaw::kVoltage ||
                                              (config_.law == MotorLaw::kAffine && Parameter(m, kBias1) == 0));
  if (amplifier) {
    std::copy_n(inputs, config_.inputs, filtered);
    const double sent = inputs[config_.command];
    filtered[config_.command] = lagged(second_lag_, kSecondTimeConstant, sent, sent);
    inputs = filtered;
  }

  // At rest after a reset: no load on the supply yet known, so the law comes first with a full one.
  if (sag_ >= 0 && at.prime) {
    const double wanted = enable * Request(m, inputs, seen, speed, supply_now);
    const double load = Load(m, wanted, LimitsAt(m, wanted, speed), supply_now);
    d->act[sag_] = std::min(load, 1 / (1 + Parameter(m, kSagFraction)));
  }
  const double ceiling = sag_ >= 0 ? 1 - Parameter(m, kSagFraction) * d->act[sag_] : 1;

  // Request, then its lags.
  double torque = Request(m, inputs, seen, speed, supply_now * ceiling);
  for (const auto& [act, constant] : {std::pair{lag_, kTimeConstant}, std::pair{second_lag_, kSecondTimeConstant}}) {
    if (act < 0 || (act == second_lag_ && amplifier)) continue;
    torque = lagged(act, constant, enable * torque, torque);
  }
  torque *= enable;

  // What the drive cannot or does not do, what it estimates, and what it does not know.
  if (dead_zone_ && !config_.dead_zone_on_command) torque = DeadZone(torque, Parameter(m, kDeadZone));
  if (limits_) torque = Limited(at, torque, speed, supply_now, ceiling);
  if (!at.later) at.slots[MotorState::kEstimate] = torque;
  d->actuator_force[output_] = Delivered(m, torque, speed);
}

void Motor::Advance(const mjModel*, mjData* d) const {
  if (inert_) return;
  double* slots = d->plugin_state + state_;
  if (slots[MotorState::kStepOpen] == 0) return;
  slots[MotorState::kStepOpen] = 0;
  slots[MotorState::kPrimed] = 1;
  if (history_) History(slots + MotorState::kSlots, capacity_, config_.inputs).Close();
}

void RegisterMotor() {
  static const std::vector<const char*> attributes =
      AttributesOf(kMotorSpecs, {"law", "inputs", "dead_zone_on", "max_delay_s", "min_timestep_s", "speed_table",
                                 "torque_table", "generating_torque_table", "table_interpolation"});
  const mjpPlugin plugin = PluginOf<Motor>(kMotorName, mjPLUGIN_ACTUATOR, attributes, MotorStateSize);
  mjp_registerPlugin(&plugin);
}

}  // namespace gapscope::plugins
