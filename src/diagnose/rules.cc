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
    if (measured.signal == on) return model.rig()->JointOfSignal(on);
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

// Of a use on all: each of its places holds a position.
bool AreServoJoints(const EffectUse& use, const Model& base) {
  const std::vector<std::string> places = PlacesOf(use, *base.rig());
  return std::all_of(places.begin(), places.end(),
                     [&](const std::string& on) { return IsServoJoint(JointOf(on, base), base); });
}

const Effect& Of(const EffectUse& use, const Model& model) { return EffectOf(use, *model.rig()); }

// Whether nothing is left out: on all, or on the only place that there is.
bool IsOnEach(const EffectUse& use, const Rig& rig) {
  const std::vector<std::string> all = PlacesOf({use.effect, kOnAll}, rig);
  return !all.empty() && PlacesOf(use, rig).size() == all.size();
}

Clocks ClocksOf(const std::vector<Recording>& recordings) {
  Clocks worst = Clocks::kOne;
  for (const Recording& recording : recordings) {
    std::set<std::string> of_commands, of_measured;
    for (const auto& command : recording.commands) {
      if (command.column) of_commands.insert(command.clock);
    }
    for (const auto& measured : recording.measured) of_measured.insert(measured.clock);
    if (of_commands.contains("synthetic") || of_measured.contains("synthetic")) return Clocks::kMadeUp;
    for (auto* clocks : {&of_commands, &of_measured}) clocks->erase("");  // not known
    if (!of_commands.empty() && !of_measured.empty() && of_commands != of_measured) worst = Clocks::kMixed;
  }
  return worst;
}

// The body whose motion a signal follows; -1: it may be several bodies' or the whole model's.
int BodyOf(const SignalSource& source, const mjModel& m) {
  if (source.joint >= 0) return m.jnt_bodyid[source.joint];
  for (int s = 0; s < m.nsensor; ++s) {
    if (source.sensor < m.sensor_adr[s] || source.sensor >= m.sensor_adr[s] + m.sensor_dim[s]) continue;
    return m.sensor_objtype[s] == mjOBJ_JOINT ? m.jnt_bodyid[m.sensor_objid[s]] : BodyOfSensor(m, s);
  }
  return -1;
}

// Joints that are driven, also by a tendon.
std::vector<char> AreDriven(const mjModel& m) {
  std::vector<char> driven(static_cast<std::size_t>(m.njnt), 0);
  const DataPtr data(mj_makeData(&m));
  mj_forward(&m, data.get());
  for (int out = 0; out < m.nout; ++out) {
    for (int k = 0; k < data->moment_rownnz[out]; ++k)
      driven[static_cast<std::size_t>(m.dof_jntid[data->moment_colind[data->moment_rowadr[out] + k]])] = 1;
  }
  return driven;
}

// Of two joints that an equality ties, one is known by the other; one that is tied to nothing else stands still.
void AddTied(const mjModel& m, std::vector<char>* known) {
  for (int round = 0; round < m.neq; ++round) {
    for (int e = 0; e < m.neq; ++e) {
      if (m.eq_type[e] != mjEQ_JOINT) continue;
      char &first = (*known)[static_cast<std::size_t>(m.eq_obj1id[e])], still = 1;
      char& second = m.eq_obj2id[e] < 0 ? still : (*known)[static_cast<std::size_t>(m.eq_obj2id[e])];
      first = second = static_cast<char>(first || second);
    }
  }
}

// What the catalogue says of an effect in a richer one; null: it does not hold it. On the same place: a motor's
// direction asymmetry is no joint's friction.
const Contained* HeldBy(const EffectUse& richer, const EffectUse& simpler, const Rig& rig) {
  if (richer.on != simpler.on) return nullptr;
  const std::vector<Contained>& contains = EffectOf(richer, rig).contains;
  const auto held = std::ranges::find(contains, simpler.effect, &Contained::effect);
  return held == contains.end() ? nullptr : &*held;
}

}  // namespace

bool IsFinding(const EffectUse& use, const Model& base) {
  if (Of(use, base).character == EffectCharacter::kConstantTorque && AreServoJoints(use, base)) return false;
  // A column that is the only one measured of a system is late with everything else: tried all the same, the verdict
  // then says ambiguous.
  return true;
}

bool Contains(const EffectUse& richer, const EffectUse& simpler, const Rig& rig, bool exactly) {
  if (richer.effect == simpler.effect && richer.on != simpler.on) {
    // One size for all drives is nearly that of one of them, as far as the logs do not show the others.
    const std::vector<std::string> places = PlacesOf(richer, rig);
    return !exactly && places.size() > 1 && std::find(places.begin(), places.end(), simpler.on) != places.end();
  }
  const Contained* held = HeldBy(richer, simpler, rig);
  return held && (held->exactly || !exactly);
}

bool IsUsual(const EffectUse& richer, const EffectUse& simpler, const Rig& rig) {
  const Contained* held = HeldBy(richer, simpler, rig);
  return held && held->usual;
}

std::string CaveatOf(Clocks clocks) {
  switch (clocks) {
    case Clocks::kOne:
      break;
    case Clocks::kMixed:
      return "includes transport, since commands and measurements have different clocks";
    case Clocks::kMadeUp:
      return "may be the recording's own, since the log's stamps are made up from a frame rate";
  }
  return "";
}

LoggedSignals WhatIsLogged(const std::vector<Recording>& recordings) {
  const auto changes = [](const Recording::Command& command) {
    return std::any_of(command.values.begin(), command.values.end(),
                       [&](double value) { return value != command.values.front(); });
  };
  const auto of_force = [](const Recording::Measured& m) {
    return TraitsOf(m.spec.kind).stage == SignalStage::kForces;
  };
  std::set<std::string> signals;
  for (const Recording& recording : recordings) {
    for (const auto& measured : recording.measured) {
      if (measured.spec.scored) signals.insert(measured.spec.signal);
    }
  }
  return {.one = std::all_of(recordings.begin(), recordings.end(),
                             [&](const Recording& r) {
                               return r.measured.size() == 1 &&
                                      std::count_if(r.commands.begin(), r.commands.end(), changes) <= 1;
                             }),
          .torque = std::any_of(
              recordings.begin(), recordings.end(),
              [&](const Recording& r) { return std::any_of(r.measured.begin(), r.measured.end(), of_force); }),
          .signals = std::move(signals),
          .clocks = ClocksOf(recordings)};
}

bool IsOfMissingSensor(const EffectUse& use, const Rig& rig, const LoggedSignals& logged) {
  return EffectOf(use, rig).place == EffectPlace::kSignal && use.on != kOnAll && !logged.signals.contains(use.on);
}

std::set<std::string> JointsOutOfSight(const Model& base, const std::vector<Recording>& recordings) {
  const mjModel& m = base.compiled();
  std::vector<char> followed(static_cast<std::size_t>(m.nbody), 0);  // it or what it carries
  for (const Recording& recording : recordings) {
    for (const auto& measured : recording.measured) {
      int body = BodyOf(base.source(measured.index), m);
      if (body < 0) return {};
      for (; body > 0; body = m.body_parentid[body]) followed[static_cast<std::size_t>(body)] = 1;
    }
  }
  std::vector<char> known = AreDriven(m);
  for (int j = 0; j < m.njnt; ++j) {
    if (followed[static_cast<std::size_t>(m.jnt_bodyid[j])]) known[static_cast<std::size_t>(j)] = 1;
  }
  AddTied(m, &known);
  std::set<std::string> joints;
  for (int j = 0; j < m.njnt; ++j) {
    const char* name = mj_id2name(&m, mjOBJ_JOINT, j);
    if (name && !known[static_cast<std::size_t>(j)]) joints.insert(name);
  }
  return joints;
}

bool AreOneMotion(const EffectUse& a, const EffectUse& b, const Model& model, const LoggedSignals& logged) {
  const Effect &x = Of(a, model), &y = Of(b, model);
  const Rig& rig = *model.rig();
  const bool of_all = IsOnEach(a, rig) && IsOnEach(b, rig) && (a.on == kOnAll || b.on == kOnAll);
  if ((logged.one || of_all) && (x.same_on_one_signal == b.effect || y.same_on_one_signal == a.effect)) return true;
  if (a.on != b.on || (x.same_but_constant != b.effect && y.same_but_constant != a.effect)) return false;
  const std::vector<std::string> places = PlacesOf(a, rig);
  const bool sprung = std::all_of(places.begin(), places.end(), [&](const auto& on) { return rig.HasSpring(on); });
  return sprung || (!logged.torque && AreServoJoints(a, model));
}

bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model) {
  const auto lists = [&](const EffectUse& one, const EffectUse& other) {
    const auto& partners = Of(one, model).partners;
    return std::ranges::find(partners, other.effect) != partners.end();
  };
  return (lists(a, b) || lists(b, a)) && JointOf(a.on, model) == JointOf(b.on, model);
}

bool IsLessLikely(const EffectUse& a, const EffectUse& b, const Model& model) {
  if (Of(a, model).unlikely_beside != b.effect || a.on != b.on) return false;
  const mjModel& m = model.compiled();
  const int joint = mj_name2id(&m, mjOBJ_JOINT, a.on.c_str());
  if (joint < 0) return false;
  const DataPtr data(mj_makeData(&m));
  mj_kinematics(&m, data.get());
  const double* axis = data->xaxis + 3 * joint;
  const double along = axis[0] * m.opt.gravity[0] + axis[1] * m.opt.gravity[1] + axis[2] * m.opt.gravity[2];
  constexpr double kUpright = 0.99;  // cosine
  return std::abs(along) > kUpright * std::hypot(m.opt.gravity[0], m.opt.gravity[1], m.opt.gravity[2]);
}

}  // namespace gapscope
