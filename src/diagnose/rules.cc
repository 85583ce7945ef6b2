#include "src/diagnose/rules.h"

#include <algorithm>
#include <map>

namespace gapscope {
namespace {

// The joint that an actuator, joint or signal belongs to.
std::string JointOf(const std::string& on, const Model& model) {
  const mjModel& m = model.compiled();
  if (const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, on.c_str()); actuator >= 0 && m.actuator_trntype[actuator] == mjTRN_JOINT) {
    const char* name = mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * actuator]);
    return name ? name : "";
  }
  for (const auto& measured : model.experiment().measured) {
    if (measured.signal == on) return measured.kind == SignalKind::kTorque ? JointOf(measured.on, model) : measured.on;
  }
  return on;
}

bool IsServoJoint(const std::string& joint, const Model& model) {
  const mjModel& m = model.compiled();
  for (int a = 0; a < m.nactuator; ++a) {
    const char* name = m.actuator_trntype[a] == mjTRN_JOINT ? mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * a]) : nullptr;
    if (name && joint == name && (m.actuator_biasprm[a * mjNBIAS + 1] != 0 || m.actuator_plugin[a] >= 0)) return true;
  }
  return false;
}

// richer -> simpler effects that it contains, on the same joint.
const std::multimap<std::string, std::string>& Containment() {
  static const std::multimap<std::string, std::string> table = {
      {"stribeck_friction", "coulomb_friction"}, {"direction_asymmetry", "coulomb_friction"}, {"supply_sag", "torque_limit"},
      {"cable_spring", "torque_bias"},           {"gravity_offset", "torque_bias"},           {"direction_asymmetry", "torque_bias"},
      {"cogging", "gravity_offset"},             {"cogging", "cable_spring"},                 {"cogging", "torque_bias"},
  };
  return table;
}

}  // namespace

bool IsFinding(const EffectUse& use, const Model& model) {
  if (use.effect == "torque_bias" && IsServoJoint(JointOf(use.on, model), model)) return false;
  // A column that is the only one measured of a system is late with everything else: tried all the same, the verdict then says ambiguous.
  return true;
}

bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model) {
  if (JointOf(a.on, model) != JointOf(b.on, model) && a.effect != "sensor_delay" && b.effect != "sensor_delay") return false;
  for (const auto& [x, y] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    for (const Effect& effect : Catalogue()) {
      if (effect.name == x->effect && std::find(effect.partners.begin(), effect.partners.end(), y->effect) != effect.partners.end()) return true;
    }
  }
  return false;
}

bool Contains(const Candidate& richer, const Candidate& simpler) {
  if (richer.effects.size() != simpler.effects.size() || richer.effects.empty()) return false;
  for (std::size_t i = 0; i + 1 < richer.effects.size(); ++i) {
    if (richer.effects[i] != simpler.effects[i]) return false;
  }
  const EffectUse &a = richer.effects.back(), &b = simpler.effects.back();
  if (JointOf(a.on, *richer.model) != JointOf(b.on, *richer.model)) return false;
  const auto range = Containment().equal_range(a.effect);
  return std::any_of(range.first, range.second, [&](const auto& entry) { return entry.second == b.effect; });
}

}  // namespace gapscope
