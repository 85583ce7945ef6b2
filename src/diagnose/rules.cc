#include "src/diagnose/rules.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <iterator>
#include <string_view>

namespace gapscope {
namespace {

// The joint that an actuator, joint or signal belongs to.
std::string JointOf(const std::string& on, const Model& model) {
  const mjModel& m = model.compiled();
  if (const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, on.c_str());
      actuator >= 0 && m.actuator_trntype[actuator] == mjTRN_JOINT) {
    const char* name = mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * actuator]);
    return name ? name : "";
  }
  for (const auto& measured : model.experiment().measured) {
    if (measured.signal == on) return measured.kind == SignalKind::kTorque ? JointOf(measured.on, model) : measured.on;
  }
  return on;
}

// Whether an actuator's own stiffness holds its joint: native, or a gapscope.motor of the duty or (with a gain) the
// position law.
bool HoldsPosition(const mjModel& m, int actuator) {
  const int instance = m.actuator_plugin[actuator];
  if (instance < 0) return m.actuator_biasprm[actuator * mjNBIAS + 1] != 0;
  const char *law = mj_getPluginConfig(&m, instance, "law"), *name = mj_id2name(&m, mjOBJ_PLUGIN, instance);
  if (law && std::string_view(law) == "duty") return true;
  const int kp = name ? mj_name2id(&m, mjOBJ_NUMERIC, (std::string(name) + ".kp").c_str()) : -1;
  const char* config = mj_getPluginConfig(&m, instance, "kp");
  return (kp >= 0 ? m.numeric_data[m.numeric_adr[kp]] : config ? std::atof(config) : 0) != 0;
}

bool IsServoJoint(const std::string& joint, const Model& base) {
  const mjModel& m = base.compiled();
  for (int a = 0; a < m.nactuator; ++a) {
    const char* name =
        m.actuator_trntype[a] == mjTRN_JOINT ? mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * a]) : nullptr;
    if (name && joint == name && HoldsPosition(m, a)) return true;
  }
  return false;
}

// richer -> simpler effects that it contains, on the same place. Exactly, or only as far as its bounds let it: a cable
// whose rest angle lies far away is nearly a bias, and where the travel is small the logs cannot tell the two.
struct Containment {
  const char *richer, *simpler;
  bool exact;
};
constexpr Containment kContainments[] = {
    {"stribeck_friction", "coulomb_friction", true},
    {"direction_asymmetry", "coulomb_friction", true},
    {"direction_asymmetry", "torque_bias", true},
    {"supply_sag", "torque_limit", true},
    {"cogging", "gravity_offset", true},
    {"cogging", "cable_spring", true},
    {"cogging", "torque_bias", true},
    {"cable_spring", "torque_bias", false},
    {"gravity_offset", "torque_bias", false},
};

}  // namespace

bool IsFinding(const EffectUse& use, const Model& base) {
  if (use.effect == "torque_bias" && IsServoJoint(JointOf(use.on, base), base)) return false;
  // A column that is the only one measured of a system is late with everything else: tried all the same, the verdict
  // then says ambiguous.
  return true;
}

bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model) {
  if (JointOf(a.on, model) != JointOf(b.on, model) && a.effect != "sensor_delay" && b.effect != "sensor_delay")
    return false;
  for (const auto& [x, y] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    for (const Effect& effect : Catalogue()) {
      if (effect.name == x->effect &&
          std::find(effect.partners.begin(), effect.partners.end(), y->effect) != effect.partners.end())
        return true;
    }
  }
  return false;
}

bool IsShape(const EffectUse& second, const EffectUse& first, const Model& model) {
  if (mj_name2id(&model.compiled(), mjOBJ_ACTUATOR, first.on.c_str()) >= 0)
    return false;  // a drive whose gain differs by direction does not stick
  const auto any = [](const std::string& effect, std::initializer_list<const char*> names) {
    return std::find(names.begin(), names.end(), effect) != names.end();
  };
  return any(first.effect, {"coulomb_friction", "stribeck_friction", "load_friction", "direction_asymmetry"}) &&
         any(second.effect, {"joint_compliance", "backlash"});
}

bool Contains(const Candidate& richer, const Candidate& simpler, bool exactly) {
  if (richer.effects.size() != simpler.effects.size()) return false;
  const auto only_of = [](const Candidate& one, const Candidate& other) {
    std::vector<EffectUse> own;
    for (const auto& use : one.effects) {
      if (std::find(other.effects.begin(), other.effects.end(), use) == other.effects.end()) own.push_back(use);
    }
    return own;
  };
  const auto of_richer = only_of(richer, simpler), of_simpler = only_of(simpler, richer);
  if (of_richer.size() != 1 || of_simpler.size() != 1) return false;
  const EffectUse &a = of_richer.front(), &b = of_simpler.front();
  // On the same place: a motor's direction asymmetry is no joint's friction.
  if (a.on != b.on) return false;
  return std::any_of(std::begin(kContainments), std::end(kContainments), [&](const Containment& c) {
    return a.effect == c.richer && b.effect == c.simpler && (c.exact || !exactly);
  });
}

bool IsStretched(const PlacedParameter& p, double value) {
  constexpr double kEdge = 1e-3;  // of the range
  const double at = p.low > 0 ? std::log(std::max(value, p.low) / p.low) / std::log(p.high / p.low)
                              : (value - p.low) / (p.high - p.low);
  return (at <= kEdge && p.neutral != p.low) || (at >= 1 - kEdge && p.neutral != p.high);
}

namespace {

std::size_t LateSensors(const Candidate& candidate) {
  return static_cast<std::size_t>(std::count_if(candidate.effects.begin(), candidate.effects.end(),
                                                [](const EffectUse& use) { return use.effect == "sensor_delay"; }));
}

}  // namespace

bool MayBeRivals(const Candidate& a, const Candidate& b) {
  // Two sensors late are one late command and what one of them is late beyond it: the same motion, told in a less
  // likely way.
  const bool same = a.effects.size() == 2 && b.effects.size() == 2 && LateSensors(a) + LateSensors(b) == 3;
  return !same && !Contains(a, b, true) && !Contains(b, a, true) && !a.at_bound && !b.at_bound;
}

bool IsOneSignal(const std::vector<Recording>& recordings) {
  return std::all_of(recordings.begin(), recordings.end(), [](const Recording& recording) {
    const auto changing =
        std::count_if(recording.commands.begin(), recording.commands.end(), [](const Recording::Command& command) {
          return std::any_of(command.values.begin(), command.values.end(),
                             [&](double value) { return value != command.values.front(); });
        });
    return recording.measured.size() == 1 && changing <= 1;
  });
}

bool IsSameDelay(const EffectUse& a, const EffectUse& b) {
  return (a.effect == "sensor_delay" && b.effect == "command_delay") ||
         (a.effect == "command_delay" && b.effect == "sensor_delay");
}

bool IsSameFriction(const EffectUse& a, const EffectUse& b) {
  return a.on == b.on && ((a.effect == "coulomb_friction" && b.effect == "direction_asymmetry") ||
                          (a.effect == "direction_asymmetry" && b.effect == "coulomb_friction"));
}

bool IsLessLikely(const Candidate& a, const Candidate& b) {
  if (LateSensors(a) == 2 && LateSensors(b) == 1 && b.effects.size() == 2 &&
      (b.effects.front().effect == "command_delay" || b.effects.back().effect == "command_delay"))
    return true;
  if (a.effects.empty() || b.effects.size() != a.effects.size() || a.effects.back().effect != "gravity_offset" ||
      b.effects.back().effect != "cable_spring" || a.effects.back().on != b.effects.back().on)
    return false;
  const mjModel& m = a.model->compiled();
  const int joint = mj_name2id(&m, mjOBJ_JOINT, a.effects.back().on.c_str());
  if (joint < 0) return false;
  const DataPtr data(mj_makeData(&m));
  mj_kinematics(&m, data.get());
  const double* axis = data->xaxis + 3 * joint;
  const double along = axis[0] * m.opt.gravity[0] + axis[1] * m.opt.gravity[1] + axis[2] * m.opt.gravity[2];
  constexpr double kUpright = 0.99;  // cosine
  return std::abs(along) > kUpright * std::hypot(m.opt.gravity[0], m.opt.gravity[1], m.opt.gravity[2]);
}

}  // namespace gapscope
