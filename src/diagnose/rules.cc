#include "src/diagnose/rules.h"

#include <algorithm>
#include <cmath>

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
    if (measured.signal == on) return TraitsOf(measured.kind).of_actuator ? JointOf(measured.on, model) : measured.on;
  }
  return on;
}

bool IsServoJoint(const std::string& joint, const Model& base) {
  const mjModel& m = base.compiled();
  for (int a = 0; a < m.nactuator; ++a) {
    const char* name =
        m.actuator_trntype[a] == mjTRN_JOINT ? mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * a]) : nullptr;
    if (name && joint == name && FactsOf(m, a).holds_position) return true;
  }
  return false;
}

const Effect& Of(const EffectUse& use, const Model& model) { return EffectOf(use, *model.rig()); }

}  // namespace

bool IsFinding(const EffectUse& use, const Model& base) {
  if (Of(use, base).character == EffectCharacter::kConstantTorque && IsServoJoint(JointOf(use.on, base), base))
    return false;
  // A column that is the only one measured of a system is late with everything else: tried all the same, the verdict
  // then says ambiguous.
  return true;
}

bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model) {
  const bool of_signal = Of(a, model).place == EffectPlace::kSignal || Of(b, model).place == EffectPlace::kSignal;
  if (!of_signal && JointOf(a.on, model) != JointOf(b.on, model)) return false;
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
  return Of(first, model).character == EffectCharacter::kDryFriction &&
         Of(second, model).character == EffectCharacter::kSecondMass;
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
  const std::vector<Contained>& contains = Of(a, *richer.model).contains;
  return std::any_of(contains.begin(), contains.end(),
                     [&](const Contained& c) { return b.effect == c.effect && (c.exactly || !exactly); });
}

bool IsStretched(const PlacedParameter& p, double value) {
  constexpr double kEdge = 1e-3;  // of the range
  const double at = p.low > 0 ? std::log(std::max(value, p.low) / p.low) / std::log(p.high / p.low)
                              : (value - p.low) / (p.high - p.low);
  return (at <= kEdge && p.neutral != p.low) || (at >= 1 - kEdge && p.neutral != p.high);
}

namespace {

std::size_t LateSensors(const Candidate& candidate) {
  return static_cast<std::size_t>(
      std::count_if(candidate.effects.begin(), candidate.effects.end(),
                    [&](const EffectUse& use) { return Of(use, *candidate.model).place == EffectPlace::kSignal; }));
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

bool IsSameDelay(const EffectUse& a, const EffectUse& b, const Model& model) {
  return Of(a, model).same_on_one_signal == b.effect || Of(b, model).same_on_one_signal == a.effect;
}

bool IsSameFriction(const EffectUse& a, const EffectUse& b, const Model& model) {
  return a.on == b.on && (Of(a, model).same_but_constant == b.effect || Of(b, model).same_but_constant == a.effect);
}

bool IsLessLikely(const Candidate& a, const Candidate& b) {
  if (LateSensors(a) == 2 && LateSensors(b) == 1 && b.effects.size() == 2 &&
      IsSameDelay(b.effects.front(), b.effects.back(), *b.model))
    return true;
  if (a.effects.empty() || b.effects.size() != a.effects.size() ||
      Of(a.effects.back(), *a.model).unlikely_beside != b.effects.back().effect ||
      a.effects.back().on != b.effects.back().on)
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
