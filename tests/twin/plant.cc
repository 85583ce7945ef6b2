#include "tests/twin/plant.h"

namespace gapscope::twin {
namespace {

std::vector<BaseParameter> MotorModule() {
  return {{"motor.resistance", "ohm", &Base::resistance_ohm, kSpread},
          {"motor.kt", "N m/A", &Base::kt_n_m_per_a, kSpread},
          {"motor.km", "V s/rad", &Base::km_v_s_per_rad, kSpread}};
}

}  // namespace

const std::vector<BaseParameter>& BaseParameters(Rig rig) {
  static const std::vector<BaseParameter> joint = {
      {"motor.kp", "N m/rad", &Base::kp_n_m_per_rad, kSpread},
      {"motor.kd", "N m s/rad", &Base::kd_n_m_s_per_rad, kSpread},
      {"joint.inertia", "kg m2", &Base::inertia_kg_m2, kSpread},
      {"joint.damping", "N m s/rad", &Base::damping_n_m_s_per_rad, kSpread}};
  static const std::vector<BaseParameter> qube = [] {
    auto list = MotorModule();
    list.insert(list.end(), {{"motor.rotor_inertia", "kg m2", &Base::rotor_inertia_kg_m2, 0},
                             {"motor.hub_inertia", "kg m2", &Base::hub_inertia_kg_m2, 0},
                             {"arm.mass", "kg", &Base::arm_mass_kg, kSpread},
                             {"arm.length", "m", &Base::arm_length_m, 0},
                             {"arm.damping", "N m s/rad", &Base::damping_n_m_s_per_rad, kSpread},
                             {"pendulum.mass", "kg", &Base::pendulum_mass_kg, kSpread},
                             {"pendulum.length", "m", &Base::pendulum_length_m, 0.045},
                             {"pendulum.damping", "N m s/rad", &Base::second_damping_n_m_s_per_rad, kSpread}});
    return list;
  }();
  static const std::vector<BaseParameter> flexjoint = [] {
    auto list = MotorModule();
    list.insert(list.end(), {{"motor.gear_ratio", "1", &Base::gear, 0},
                             {"motor.efficiency", "1", &Base::efficiency, 0},
                             {"base.inertia", "kg m2", &Base::inertia_kg_m2, kSpread},
                             {"base.damping", "N m s/rad", &Base::damping_n_m_s_per_rad, kSpread},
                             {"link.inertia", "kg m2", &Base::link_inertia_kg_m2, kSpread},
                             {"link.stiffness", "N m/rad", &Base::link_stiffness_n_m_per_rad, kSpread},
                             {"link.damping", "N m s/rad", &Base::second_damping_n_m_s_per_rad, kSpread}});
    return list;
  }();
  static const std::vector<BaseParameter> flexlink = {
      {"motor.torque_per_ampere", "N m/A", &Base::torque_per_ampere_n_m, kSpread},
      {"hub.inertia", "kg m2", &Base::inertia_kg_m2, kSpread},
      {"hub.damping", "N m s/rad", &Base::damping_n_m_s_per_rad, kSpread},
      {"link.inertia", "kg m2", &Base::link_inertia_kg_m2, kSpread},
      {"link.stiffness", "N m/rad", &Base::link_stiffness_n_m_per_rad, kSpread},
      {"link.damping", "N m s/rad", &Base::second_damping_n_m_s_per_rad, kSpread}};
  switch (rig) {
    case Rig::kJoint:
      return joint;
    case Rig::kQube:
      return qube;
    case Rig::kFlexJoint:
      return flexjoint;
    case Rig::kFlexLink:
      break;
  }
  return flexlink;
}

Base NominalBase(Rig rig) {
  Base base;
  switch (rig) {
    case Rig::kJoint:
      base.kp_n_m_per_rad = 157.1451;
      base.kd_n_m_s_per_rad = 7.0729;
      base.inertia_kg_m2 = 0.159221308;
      base.damping_n_m_s_per_rad = 0.5;
      break;
    case Rig::kQube:
      base.resistance_ohm = 8.4;
      base.kt_n_m_per_a = base.km_v_s_per_rad = 0.042;
      base.rotor_inertia_kg_m2 = 4.0e-6;
      base.hub_inertia_kg_m2 = 0.6e-6;
      base.arm_mass_kg = 0.095;
      base.arm_length_m = 0.085;
      base.pendulum_mass_kg = 0.024;
      base.pendulum_length_m = 0.129;
      base.damping_n_m_s_per_rad = 1.5e-4;
      base.second_damping_n_m_s_per_rad = 3.0e-5;
      break;
    case Rig::kFlexJoint:
      base.resistance_ohm = 2.6;
      base.kt_n_m_per_a = base.km_v_s_per_rad = 0.00768;
      base.gear = 70;
      base.efficiency = 0.621;
      base.inertia_kg_m2 = 0.002087;
      base.damping_n_m_s_per_rad = 0.015;
      base.link_inertia_kg_m2 = 0.003156;
      base.link_stiffness_n_m_per_rad = 1.8426;
      base.second_damping_n_m_s_per_rad = 0.001;
      break;
    case Rig::kFlexLink:
      base.torque_per_ampere_n_m = 0.3338496;
      base.inertia_kg_m2 = 0.002087;
      base.damping_n_m_s_per_rad = 0.015;
      base.link_inertia_kg_m2 = 0.0038;
      base.link_stiffness_n_m_per_rad = 1.0936;
      base.second_damping_n_m_s_per_rad = 0.0015;
      break;
  }
  return base;
}

const char* RigName(Rig rig) {
  switch (rig) {
    case Rig::kJoint:
      return "joint";
    case Rig::kQube:
      return "qube";
    case Rig::kFlexJoint:
      return "flexjoint";
    case Rig::kFlexLink:
      break;
  }
  return "flexlink";
}

bool ParseRig(std::string_view name, Rig* rig) {
  for (const Rig candidate : kRigs) {
    if (name == RigName(candidate)) {
      *rig = candidate;
      return true;
    }
  }
  return false;
}

const RigNames& Names(Rig rig) {
  static const std::array<RigNames, 4> names = {
      RigNames{"joint", "", "position_rad", "", "target_rad", "n_m"},
      RigNames{"arm", "pendulum", "arm_rad", "pendulum_rad", "voltage_v", "v"},
      RigNames{"base", "link", "base_rad", "link_rad", "voltage_v", "v"},
      RigNames{"hub", "deflection", "hub_rad", "deflection_rad", "current_a", "a"}};
  return names[static_cast<std::size_t>(rig)];
}

double DrivenInertia(const Plant& plant) {
  const Base& b = plant.base;
  if (plant.rig != Rig::kQube) return b.inertia_kg_m2;
  return b.rotor_inertia_kg_m2 + b.hub_inertia_kg_m2 + b.arm_mass_kg * b.arm_length_m * b.arm_length_m / 3;
}

}  // namespace gapscope::twin
