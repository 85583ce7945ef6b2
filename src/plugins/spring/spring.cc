#include "src/plugins/spring/spring.h"

#include <algorithm>
#include <cmath>
#include <string>

#include "src/plugins/common/refusal.h"
#include "src/plugins/common/register.h"

namespace gapscope::plugins {
std::unique_ptr<Spring> Spring::Create(const mjModel* m, int instance) {
  auto spring = std::make_unique<Spring>();
  const std::string structure = spring->ResolveStructure(m, instance);
  const std::string values = spring->ResolveValues(m, instance);
  if (!structure.empty()) {
    if (Refuse(m, structure)) return nullptr;
  } else if (!values.empty() && IsCompiling(m)) {  // the live values of a finished model are its host's
    Refuse(m, values);
    return nullptr;
  }
  return spring;
}

std::string Spring::ResolveStructure(const mjModel* m, int instance) {
  state_address_ = m->plugin_stateadr[instance];
  if (std::string fault = ResolveJoint(m, instance, &joint_); !fault.empty()) return fault;
  dof_ = m->jnt_dofadr[joint_];
  angle_address_ = m->jnt_qposadr[joint_];
  if (m->jnt_limited[joint_]) middle_ = (m->jnt_range[2 * joint_] + m->jnt_range[2 * joint_ + 1]) / 2;
  return {};
}

std::string Spring::ResolveValues(const mjModel* m, int instance) {
  if (std::string fault = value_.Resolve(m, instance, kSpecs); !fault.empty()) return fault;
  std::array<const char*, kKeyCount> keys;
  std::transform(kSpecs.begin(), kSpecs.end(), keys.begin(), [](const ParameterSpec& spec) { return spec.key; });
  return UnknownNumeric(m, instance, keys.data(), kKeyCount);
}

double Spring::Torque(const mjModel* m, double q) const {
  const double e = q - value_(m, kRest);
  double torque = value_(m, kBias) - (value_(m, kStiffness) + value_(m, kCubic) * e * e) * e;
  if (const double gravity = value_(m, kGravity); gravity != 0) {
    torque -= gravity * std::sin(q - value_(m, kGravityRest));
  }
  const double first = value_(m, kCogging), second = value_(m, kCoggingSecond);
  if (first != 0 || second != 0) {
    const double angle = value_(m, kCoggingPeriods) * q;
    torque += first * std::sin(angle + value_(m, kCoggingPhase));
    if (second != 0) torque += second * std::sin(2 * angle + value_(m, kCoggingSecondPhase));
  }
  if (const double stiffness = value_(m, kStop); stiffness != 0) {
    const double stop = value_(m, kStopAngle), beyond = q - stop;
    torque -= stiffness * (stop >= middle_ ? std::max(beyond, 0.0) : std::min(beyond, 0.0));
  }
  return torque;
}

void Spring::Compute(const mjModel* m, mjData* d, int) const {
  if (dof_ < 0) return;
  const double q = d->qpos[angle_address_];
  double torque = Torque(m, q);
  BristleState& state = StateOf(d);
  const double shift = state.Displacement(q, d->time, m->opt.timestep);
  if (const double height = value_(m, kHysteresis); height != 0) {
    torque -= height * BendBristle(state.bend, shift, value_(m, kHysteresisAngle));
  }
  d->qfrc_passive[dof_] += torque;
}

void Spring::Advance(const mjModel* m, mjData* d) const {
  if (dof_ < 0) return;
  BristleState& state = StateOf(d);
  const double q = d->qpos[angle_address_];
  double bend = state.bend;
  if (value_(m, kHysteresis) != 0) bend = BendBristle(bend, q - state.angle_rad, value_(m, kHysteresisAngle));
  state.Settle(bend, q, d->time);
}

void RegisterSpring() {
  static const std::vector<const char*> attributes = AttributesOf(Spring::kSpecs, {"joint"});
  const mjpPlugin plugin = PluginOf<Spring>(
      Spring::kName, mjPLUGIN_PASSIVE, attributes, +[](const mjModel*, int) { return Spring::kStateSize; });
  mjp_registerPlugin(&plugin);
}

}  // namespace gapscope::plugins
