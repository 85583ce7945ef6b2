#include "tests/twin/arm/arm.h"

#include <utility>

namespace gapscope::twin {
namespace {

using Eigen::Vector3d;

const Vector3d kUp(0, 0, 1), kLift(0, -1, 0), kAlong(1, 0, 0);

// A vertical plane, hanging at zero: positive angles turn both links forward and up.
std::vector<ArmLink> Links2() {
  return {{.joint = "shoulder",
           .body = "upper_arm",
           .origin_m = {0, 0, 0},
           .axis = kLift,
           .centre_m = {0, 0, -0.16},
           .gyration_m2 = {0.0115, 0.0115, 0.0008},
           .home_rad = 0.5,
           .reach_rad = 0.9,
           .rated_n_m = 30},
          {.joint = "elbow",
           .body = "forearm",
           .origin_m = {0, 0, -0.34},
           .axis = kLift,
           .centre_m = {0, 0, -0.13},
           .gyration_m2 = {0.0085, 0.0085, 0.0006},
           .home_rad = 0.7,
           .reach_rad = 1.0,
           .rated_n_m = 12}};
}

// Stretched forward along x at zero: a vertical axis, three parallel ones that lift, one that turns the hand, one that
// rolls the flange.
std::vector<ArmLink> Links6() {
  return {{.joint = "pan",
           .body = "turret",
           .origin_m = {0, 0, 0.12},
           .axis = kUp,
           .centre_m = {0, 0.015, 0.03},
           .gyration_m2 = {0.0024, 0.0024, 0.0022},
           .home_rad = 0,
           .reach_rad = 0.8,
           .rated_n_m = 60},
          {.joint = "lift",
           .body = "upper_arm",
           .origin_m = {0, 0.09, 0.06},
           .axis = kLift,
           .centre_m = {0.14, 0, 0},
           .gyration_m2 = {0.0012, 0.0110, 0.0110},
           .home_rad = 0.8,
           .reach_rad = 0.6,
           .rated_n_m = 70},
          {.joint = "elbow",
           .body = "forearm",
           .origin_m = {0.32, -0.05, 0},
           .axis = kLift,
           .centre_m = {0.12, 0, 0},
           .gyration_m2 = {0.0009, 0.0085, 0.0085},
           .home_rad = -1.2,
           .reach_rad = 0.7,
           .rated_n_m = 40},
          {.joint = "wrist1",
           .body = "wrist_housing",
           .origin_m = {0.28, 0.04, 0},
           .axis = kLift,
           .centre_m = {0.015, 0.02, 0},
           .gyration_m2 = {0.0011, 0.0009, 0.0011},
           .home_rad = 0.3,
           .reach_rad = 0.9,
           .rated_n_m = 12},
          {.joint = "wrist2",
           .body = "hand",
           .origin_m = {0.04, 0.05, 0},
           .axis = kUp,
           .centre_m = {0.03, 0, -0.015},
           .gyration_m2 = {0.0009, 0.0011, 0.0011},
           .home_rad = 0,
           .reach_rad = 0.9,
           .rated_n_m = 10},
          {.joint = "wrist3",
           .body = "flange",
           .origin_m = {0.06, 0, -0.03},
           .axis = kAlong,
           .centre_m = {0.045, 0.012, 0},
           .gyration_m2 = {0.0010, 0.0013, 0.0013},
           .home_rad = 0,
           .reach_rad = 1.0,
           .rated_n_m = 8}};
}

// kp, kd, damping, armature, mass.
std::vector<ArmBase> Bases(ArmRig rig) {
  if (rig == ArmRig::kArm2) return {{180, 6, 0.8, 0.08, 1.6}, {60, 1.6, 0.3, 0.03, 1.1}};
  return {{500, 25, 4, 0.25, 2.0},   {700, 30, 4, 0.25, 1.9},   {300, 12, 2, 0.15, 1.4},
          {70, 1.8, 0.4, 0.04, 1.0}, {55, 1.4, 0.4, 0.04, 1.0}, {40, 1.0, 0.3, 0.03, 0.6}};
}

std::vector<ArmParameter> ListParameters(ArmRig rig) {
  std::vector<ArmParameter> list;
  const auto& links = ArmLinks(rig);
  for (int j = 0; j < static_cast<int>(links.size()); ++j) {
    const auto& [joint, body] =
        std::pair(links[static_cast<std::size_t>(j)].joint, links[static_cast<std::size_t>(j)].body);
    list.push_back({joint + ".kp", "N m/rad", j, &ArmBase::kp_n_m_per_rad, kSpread});
    list.push_back({joint + ".kd", "N m s/rad", j, &ArmBase::kd_n_m_s_per_rad, 0});
    list.push_back({joint + ".damping", "N m s/rad", j, &ArmBase::damping_n_m_s_per_rad, kSpread});
    list.push_back({joint + ".armature", "kg m2", j, &ArmBase::armature_kg_m2, kSpread});
    // What only turns about a vertical axis is not weighed by any log.
    list.push_back({body + ".mass", "kg", j, &ArmBase::mass_kg, body == "turret" ? 0 : kSpread});
  }
  return list;
}

}  // namespace

const std::vector<ArmLink>& ArmLinks(ArmRig rig) {
  static const std::vector<ArmLink> two = Links2(), six = Links6();
  return rig == ArmRig::kArm2 ? two : six;
}

const char* ArmRigName(ArmRig rig) { return rig == ArmRig::kArm2 ? "arm2" : "arm6"; }

bool ParseArmRig(std::string_view name, ArmRig* rig) {
  for (const ArmRig candidate : {ArmRig::kArm2, ArmRig::kArm6}) {
    if (name == ArmRigName(candidate)) {
      *rig = candidate;
      return true;
    }
  }
  return false;
}

const std::vector<ArmParameter>& ArmParameters(ArmRig rig) {
  static const std::vector<ArmParameter> two = ListParameters(ArmRig::kArm2), six = ListParameters(ArmRig::kArm6);
  return rig == ArmRig::kArm2 ? two : six;
}

ArmPlant NominalArm(ArmRig rig) {
  ArmPlant plant;
  plant.rig = rig;
  for (const ArmBase& base : Bases(rig)) {
    plant.joints.emplace_back();
    plant.joints.back().base = base;
  }
  return plant;
}

}  // namespace gapscope::twin
