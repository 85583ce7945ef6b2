#include "tests/twin/arm/effects.h"

#include <algorithm>
#include <cmath>
#include <numbers>
#include <set>

namespace gapscope::twin {
namespace {

constexpr double kRate_hz = 200;                 // of the logs
constexpr double kPayload = 0.2, kTilt = 0.015;  // severity one: of the last body's mass; rad
constexpr double kPayloadPlace_m = 0.06;         // from the body's centre of mass, along each axis
constexpr double kDelay_s = 0.003;               // severity one of delays (../effects.cc)

Values AddPayload(const ArmChoice& c, ArmPlant* plant) {
  Random random(c.shape_seed, 0, c.name);
  const std::size_t last = plant->joints.size() - 1;
  plant->payload_kg = kPayload * c.severity * NominalArm(plant->rig).joints[last].base.mass_kg;
  plant->payload_m = ArmLinks(plant->rig)[last].centre_m;
  for (int axis = 0; axis < 3; ++axis) plant->payload_m[axis] += random.Uniform(-kPayloadPlace_m, kPayloadPlace_m);
  return {{"mass_kg", plant->payload_kg},
          {"x_m", plant->payload_m.x()},
          {"y_m", plant->payload_m.y()},
          {"z_m", plant->payload_m.z()}};
}

// A plane rig feels next to nothing of a tilt about its plane's horizontal: there it is mostly within the plane.
Values AddTilt(const ArmChoice& c, ArmPlant* plant) {
  Random random(c.shape_seed, 0, c.name);
  const double pi = std::numbers::pi;
  const double direction =
      plant->rig == ArmRig::kArm2 ? random.Sign() * pi / 2 + random.Uniform(-0.5, 0.5) : random.Uniform(-pi, pi);
  plant->tilt_x_rad = kTilt * c.severity * std::cos(direction);
  plant->tilt_y_rad = kTilt * c.severity * std::sin(direction);
  return {{"x_rad", plant->tilt_x_rad}, {"y_rad", plant->tilt_y_rad}};
}

// By way of a plant of one joint.
Values AddToJoint(const ArmChoice& c, const Motion& motion, ArmJoint* joint, Values* extra) {
  Plant one = NominalPlant(Rig::kJoint);
  one.drive = joint->drive;
  one.dry[0] = joint->dry;
  one.load = joint->load;
  const Place place = c.place == ArmPlace::kJoint    ? Place::kFirst
                      : c.place == ArmPlace::kSignal ? Place::kFirstSignal
                                                     : Place::kMotor;
  Values values = AddEffect({c.name, place, c.severity, c.shape_seed}, motion, &one, extra);
  joint->drive = one.drive;
  joint->dry = one.dry[0];
  joint->load = one.load;
  if (c.place == ArmPlace::kSignal) joint->sensor_delay_s = one.sensor_delay_s[0];
  if (c.name == "torque_constant_droop") {
    joint->drive.droop_peak_n_m = motion.torque_peak_n_m;
    if (extra) extra->back().second = motion.torque_peak_n_m;
  }
  return values;
}

bool Overlap(const ArmChoice& a, const ArmChoice& b) {
  const auto whole = [](const ArmChoice& c) {
    return c.joint == kAllJoints || c.place == ArmPlace::kBody || c.place == ArmPlace::kModel;
  };
  return whole(a) || whole(b) || a.joint == b.joint;
}

}  // namespace

std::string ArmPlaceName(ArmRig rig, const ArmChoice& choice) {
  if (choice.place == ArmPlace::kModel) return "model";
  if (choice.joint == kAllJoints) return "all";
  const ArmLink& link = ArmLinks(rig)[static_cast<std::size_t>(choice.joint)];
  switch (choice.place) {
    case ArmPlace::kDrive:
      return link.Actuator();
    case ArmPlace::kSignal:
      return link.Signal();
    case ArmPlace::kBody:
      return link.body;
    default:
      return link.joint;
  }
}

std::vector<ArmRange> ArmEffectsOf(ArmRig rig) {
  const auto ranges = EffectsOf(Rig::kJoint);
  const int joints = static_cast<int>(ArmLinks(rig).size());
  std::vector<ArmRange> list;
  const auto add = [&](const char* name, ArmPlace place, int joint) {
    ArmRange range;
    range.choice = {name, place, joint};
    for (const EffectRange& of : ranges) {
      if (of.choice.name == name) range.highest = of.highest;
    }
    // Below one sample a delay is a nuisance of every model.
    if (range.choice.name.ends_with("_delay")) range.lowest = 1.1 / kRate_hz / kDelay_s;
    list.push_back(range);
  };
  for (const char* name : {"command_delay", "actuator_lag"}) add(name, ArmPlace::kDrive, kAllJoints);
  add("sensor_delay", ArmPlace::kSignal, kAllJoints);
  for (int j = 0; j < joints; ++j) {
    for (const char* name : {"command_delay", "actuator_lag", "torque_limit", "torque_constant_droop"}) {
      add(name, ArmPlace::kDrive, j);
    }
    for (const char* name : {"coulomb_friction", "stribeck_friction", "direction_asymmetry", "quadratic_drag",
                             "cable_spring", "gravity_offset"}) {
      add(name, ArmPlace::kJoint, j);
    }
    add("sensor_delay", ArmPlace::kSignal, j);
  }
  add("payload", ArmPlace::kBody, joints - 1);
  list.back().highest = 18;  // 3.6 times the last body's mass
  add("mount_tilt", ArmPlace::kModel, 0);
  list.back().highest = 27;  // 0.4 rad
  return list;
}

bool DrawArmEffect(ArmRig rig, const std::string& wanted, Random* random, ArmRange* drawn) {
  const std::size_t at = wanted.find('@');
  const std::string name = wanted.substr(0, at), on = at == std::string::npos ? "" : wanted.substr(at + 1);
  std::vector<ArmRange> fitting;
  std::vector<std::string> names;
  for (const ArmRange& range : ArmEffectsOf(rig)) {
    const bool wrong = (!name.empty() && range.choice.name != name) ||
                       (!on.empty() && ArmPlaceName(rig, range.choice) != on) || (on.empty() && range.only_asked());
    if (wrong) continue;
    fitting.push_back(range);
    if (std::find(names.begin(), names.end(), range.choice.name) == names.end()) names.push_back(range.choice.name);
  }
  if (fitting.empty()) return false;
  // By name first, then whether on all, then by place: six joints do not make an effect six times as frequent.
  const std::string chosen = names[static_cast<std::size_t>(random->Integer(0, static_cast<int>(names.size()) - 1))];
  std::erase_if(fitting, [&](const ArmRange& r) { return r.choice.name != chosen; });
  const auto on_all = [](const ArmRange& r) { return r.choice.joint == kAllJoints; };
  if (std::any_of(fitting.begin(), fitting.end(), on_all) && random->Chance(0.5)) {
    std::erase_if(fitting, [&](const ArmRange& r) { return !on_all(r); });
  }
  *drawn = fitting[static_cast<std::size_t>(random->Integer(0, static_cast<int>(fitting.size()) - 1))];
  drawn->choice.shape_seed = static_cast<std::uint64_t>(random->Unit() * 0x1.0p53);
  return true;
}

Values AddArmEffect(const ArmChoice& choice, const std::vector<Motion>& motions, ArmPlant* plant, Values* extra) {
  if (choice.place == ArmPlace::kBody) return AddPayload(choice, plant);
  if (choice.place == ArmPlace::kModel) return AddTilt(choice, plant);
  Values values;
  for (int j = 0; j < plant->count(); ++j) {
    if (choice.joint == j || choice.joint == kAllJoints) {
      values = AddToJoint(choice, motions[j], &plant->joints[j], extra);
    }
  }
  return values;
}

bool ArmClash(const ArmChoice& a, const ArmChoice& b) {
  if (!Overlap(a, b)) return false;
  if (a.name == b.name) return true;
  const auto both_in = [&](const std::set<std::string>& group) {
    return group.count(a.name) > 0 && group.count(b.name) > 0;
  };
  return both_in({"coulomb_friction", "stribeck_friction", "direction_asymmetry"}) ||
         both_in({"command_delay", "sensor_delay"}) ||
         both_in({"cable_spring", "gravity_offset", "payload", "mount_tilt"});
}

}  // namespace gapscope::twin
