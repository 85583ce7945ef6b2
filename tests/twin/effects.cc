#include "tests/twin/effects.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>
#include <set>

#include "tests/twin/random.h"

namespace gapscope::twin {
namespace {

constexpr double kPi = std::numbers::pi;

int Joint(Place place) { return place == Place::kSecond ? 1 : 0; }
int Signal(Place place) { return place == Place::kSecondSignal ? 1 : 0; }

double PeakTorque(Rig rig) {
  switch (rig) {
    case Rig::kJoint:
      return 119.6;  // the seed's motor table
    case Rig::kQube:
      return 0.05;  // stalled at 10 V
    case Rig::kFlexJoint:
      return 1.284;  // stalled at 10 V
    case Rig::kFlexLink:
      break;
  }
  return 1.0015488;  // 3 A
}

std::string DeadZoneName(Rig rig) { return "half_width_" + Names(rig).command_suffix; }

// What an effect's parameters are called and how each is set.
using Setter = std::function<void(Plant*, Place, double)>;
struct Parameter {
  std::string effect, name;
  Setter set;
};

const std::vector<Parameter>& Parameters() {
  static const std::vector<Parameter> list = [] {
    std::vector<Parameter> p;
    const auto add = [&p](const char* effect, const char* name, Setter set) {
      p.push_back({effect, name, std::move(set)});
    };
    add("command_delay", "delay_s", [](Plant* a, Place, double v) { a->drive.command_delay_s = v; });
    add("command_delay", "jitter", [](Plant* a, Place, double v) { a->drive.jitter = v; });
    add("torque_delay", "delay_s", [](Plant* a, Place, double v) { a->drive.torque_delay_s = v; });
    add("actuator_lag", "time_constant_s", [](Plant* a, Place, double v) { a->drive.lag_s = v; });
    add("actuator_lag", "second_pole_s", [](Plant* a, Place, double v) { a->drive.second_lag_s = v; });
    add("torque_limit", "limit_n_m", [](Plant* a, Place, double v) { a->drive.torque_limit_n_m = v; });
    add("torque_limit", "corner", [](Plant* a, Place, double v) { a->drive.corner = v; });
    add("torque_speed_curve", "power_w", [](Plant* a, Place, double v) { a->drive.power_w = v; });
    add("torque_constant_droop", "loss_at_peak", [](Plant* a, Place, double v) {
      a->drive.droop = v;
      a->drive.droop_peak_n_m = PeakTorque(a->rig);
    });
    add("torque_constant_droop", "exponent", [](Plant* a, Place, double v) { a->drive.droop_exponent = v; });
    add("supply_sag", "time_constant_s", [](Plant* a, Place, double v) { a->drive.sag_time_s = v; });
    add("supply_sag", "ceiling", [](Plant* a, Place, double v) { a->drive.sag_ceiling = v; });
    add("supply_sag", "depth", [](Plant* a, Place, double v) { a->drive.sag_depth = v; });
    for (const char* unit : {"half_width_n_m", "half_width_v", "half_width_a"}) {
      add("dead_zone", unit, [](Plant* a, Place, double v) { a->drive.dead_zone = v; });
    }
    add("coulomb_friction", "friction_n_m",
        [](Plant* a, Place at, double v) { a->dry[Joint(at)].positive_n_m = a->dry[Joint(at)].negative_n_m = v; });
    add("stribeck_friction", "friction_n_m",
        [](Plant* a, Place at, double v) { a->dry[Joint(at)].positive_n_m = a->dry[Joint(at)].negative_n_m = v; });
    add("stribeck_friction", "breakaway_n_m", [](Plant* a, Place at, double v) {
      Dry& dry = a->dry[Joint(at)];
      dry.breakaway_over_slide = dry.positive_n_m > 0 ? v / dry.positive_n_m : 1.0;
    });
    add("stribeck_friction", "stribeck_speed_rad_per_s",
        [](Plant* a, Place at, double v) { a->dry[Joint(at)].stribeck_speed_rad_per_s = v; });
    for (const char* name : {"coulomb_friction", "stribeck_friction", "direction_asymmetry", "load_friction"}) {
      add(name, "presliding_rad", [](Plant* a, Place at, double v) { a->dry[Joint(at)].presliding_rad = v; });
      add(name, "lugre", [](Plant* a, Place at, double v) {
        a->dry[Joint(at)].law = v != 0 ? FrictionLaw::kLuGre : FrictionLaw::kMaxwellSlip;
      });
    }
    add("direction_asymmetry", "asymmetry", [](Plant* a, Place, double v) { a->drive.asymmetry = v; });
    add("direction_asymmetry", "friction_positive_n_m",
        [](Plant* a, Place at, double v) { a->dry[Joint(at)].positive_n_m = v; });
    add("direction_asymmetry", "friction_negative_n_m",
        [](Plant* a, Place at, double v) { a->dry[Joint(at)].negative_n_m = v; });
    add("load_friction", "coefficient", [](Plant* a, Place, double v) { a->dry[0].load_coefficient = v; });
    add("quadratic_drag", "drag_n_m_s2_per_rad2",
        [](Plant* a, Place at, double v) { a->dry[Joint(at)].drag_n_m_s2_per_rad2 = v; });
    add("backlash", "gap_rad", [](Plant* a, Place, double v) { a->load.gap_rad = v; });
    add("backlash", "contact_hz", [](Plant* a, Place, double v) { a->load.contact_hz = v; });
    add("joint_compliance", "stiffness_n_m_per_rad", [](Plant* a, Place, double v) { a->load.stiffness = v; });
    for (const char* name : {"backlash", "joint_compliance"}) {
      add(name, "motor_share", [](Plant* a, Place, double v) { a->load.motor_share = v; });
      add(name, "damping_ratio", [](Plant* a, Place, double v) { a->load.transmission_damping_ratio = v; });
    }
    add("cable_spring", "stiffness_n_m_per_rad", [](Plant* a, Place, double v) { a->load.cable_stiffness = v; });
    add("cable_spring", "rest_rad", [](Plant* a, Place, double v) { a->load.cable_rest_rad = v; });
    add("cable_spring", "stiffness_cubic_n_m_per_rad3", [](Plant* a, Place, double v) { a->load.cable_cubic = v; });
    add("cable_spring", "hysteresis_rad", [](Plant* a, Place, double v) { a->load.cable_hysteresis = v; });
    add("gravity_offset", "torque_n_m", [](Plant* a, Place, double v) { a->load.gravity_n_m = v; });
    add("gravity_offset", "rest_rad", [](Plant* a, Place, double v) { a->load.gravity_rest_rad = v; });
    add("torque_bias", "torque_n_m", [](Plant* a, Place, double v) { a->load.bias_n_m = v; });
    add("cogging", "amplitude_n_m", [](Plant* a, Place, double v) { a->load.cogging_n_m = v; });
    add("cogging", "periods_per_rev", [](Plant* a, Place, double v) { a->load.cogging_periods = v; });
    add("cogging", "phase_rad", [](Plant* a, Place, double v) { a->load.cogging_phase_rad = v; });
    add("cogging", "second_share", [](Plant* a, Place, double v) { a->load.cogging_second = v; });
    add("cogging", "second_phase_rad", [](Plant* a, Place, double v) { a->load.cogging_second_phase_rad = v; });
    // K sinh(b a) / b = K a + K b^2 a^3 / 6 + ...
    add("spring_hardening", "cubic_n_m_per_rad3", [](Plant* a, Place, double v) {
      a->load.hardening_per_rad = std::sqrt(std::max(0.0, 6 * v / a->base.link_stiffness_n_m_per_rad));
    });
    add("sensor_delay", "delay_s", [](Plant* a, Place at, double v) { a->sensor_delay_s[Signal(at)] = v; });
    return p;
  }();
  return list;
}

bool SetOne(std::string_view effect, std::string_view name, Place place, double value, Plant* plant) {
  for (const Parameter& p : Parameters()) {
    if (p.effect == effect && p.name == name) {
      p.set(plant, place, value);
      return true;
    }
  }
  return false;
}

struct Limits {
  const char* name;
  double highest;
};

// Which documented parameters an effect has, in the order in which they must be set, and those of the twin alone.
struct Drawn {
  Values documented, extra;
};

void DrawFriction(double presliding, Random* random, Values* extra) {
  extra->push_back({"presliding_rad", presliding * random->LogUniform(0.5, 1.5)});
  extra->push_back({"lugre", random->Chance(0.5) ? 1.0 : 0.0});
}

void DrawSplit(Random* random, Values* extra) {
  extra->push_back({"motor_share", random->Uniform(0.2, 0.8)});
  extra->push_back({"damping_ratio", random->Uniform(0.03, 0.12)});
}

Drawn Draw(const EffectChoice& c, const Motion& m, const Plant& plant) {
  Random random(c.shape_seed, 0, c.name);
  const double s = c.severity;
  const Rig rig = plant.rig;
  const bool second = c.place == Place::kSecond;
  const double torque = second ? m.torque2_rms_n_m : m.torque_rms_n_m;
  const double speed_peak = second ? m.speed2_peak_rad_per_s : m.speed1_peak_rad_per_s;
  const double presliding = rig == Rig::kJoint ? 3e-4 : 6e-4;
  Drawn d;
  Values& v = d.documented;
  const auto is = [&](const char* name) { return c.name == name; };

  if (is("command_delay")) {
    v = {{"delay_s", 0.003 * s}};
    d.extra = {{"jitter", random.Uniform(0.0, 0.05)}};
  } else if (is("torque_delay") || is("sensor_delay")) {
    v = {{"delay_s", 0.003 * s}};
  } else if (is("actuator_lag")) {
    const double share = random.Uniform(0.05, 0.25);  // of the sum, in the faster pole
    v = {{"time_constant_s", 0.004 * s * (1 - share)}};
    d.extra = {{"second_pole_s", 0.004 * s * share}};
  } else if (is("torque_limit")) {
    v = {{"limit_n_m", m.torque_peak_n_m / (1 + 0.5 * s)}};
    d.extra = {{"corner", random.Chance(0.5) ? 0.0 : random.Uniform(10, 30)}};
  } else if (is("torque_speed_curve")) {
    v = {{"power_w", m.power_peak_w / (1 + 0.5 * s)}};
  } else if (is("torque_constant_droop")) {
    v = {{"loss_at_peak", 0.15 * s}};
    d.extra = {{"exponent", random.Uniform(1, 2)}};
  } else if (is("supply_sag")) {
    v = {{"time_constant_s", random.LogUniform(0.1, 1.0)}};
    d.extra = {{"ceiling", m.command_peak * random.Uniform(1.0, 1.1)}, {"depth", 0.5 * s}};
  } else if (is("dead_zone")) {
    v = {{DeadZoneName(rig), 0.04 * s * m.command_peak}};
  } else if (is("coulomb_friction")) {
    v = {{"friction_n_m", 0.1 * s * torque}};
    DrawFriction(presliding, &random, &d.extra);
  } else if (is("stribeck_friction")) {
    const double slide = 0.08 * s * torque;
    v = {{"friction_n_m", slide},
         {"breakaway_n_m", slide * random.Uniform(1.4, 2.2)},
         {"stribeck_speed_rad_per_s", speed_peak * random.LogUniform(0.02, 0.1)}};
    DrawFriction(presliding, &random, &d.extra);
  } else if (is("direction_asymmetry") && c.place == Place::kMotor) {
    v = {{"asymmetry", 0.05 * s * random.Sign()}};
  } else if (is("direction_asymmetry")) {
    const double middle = 0.1 * s * torque, difference = random.Sign() * random.Uniform(0.4, 1.0);
    v = {{"friction_positive_n_m", middle * (1 + difference)}, {"friction_negative_n_m", middle * (1 - difference)}};
    DrawFriction(presliding, &random, &d.extra);
  } else if (is("load_friction")) {
    v = {{"coefficient", 0.08 * s}};
    DrawFriction(presliding, &random, &d.extra);
  } else if (is("quadratic_drag")) {
    v = {{"drag_n_m_s2_per_rad2", 0.2 * s * torque / (speed_peak * speed_peak)}};
  } else if (is("backlash")) {
    v = {{"gap_rad", 0.008 * s}};
    DrawSplit(&random, &d.extra);
    d.extra[1].second = random.Uniform(0.08, 0.3);  // flanks bounce, and stop bouncing
    d.extra.push_back({"contact_hz", random.Uniform(250, 400)});
  } else if (is("joint_compliance")) {
    DrawSplit(&random, &d.extra);
    const double share = d.extra[0].second;
    const double hz = (rig == Rig::kJoint ? 40 : 30) / std::sqrt(s);
    v = {{"stiffness_n_m_per_rad", DrivenInertia(plant) * share * (1 - share) * (2 * kPi * hz) * (2 * kPi * hz)}};
  } else if (is("cable_spring")) {
    v = {{"stiffness_n_m_per_rad", 0.15 * s * torque / m.angle1_peak_rad},
         {"rest_rad", m.angle1_peak_rad * random.Uniform(-0.8, 0.8)}};
    d.extra = {{"hysteresis_rad", random.Uniform(0.0, 0.015)}};
  } else if (is("gravity_offset")) {
    v = {{"torque_n_m", 0.15 * s * torque}, {"rest_rad", random.Uniform(-kPi, kPi)}};
  } else if (is("torque_bias")) {
    v = {{"torque_n_m", 0.08 * s * torque * random.Sign()}};
  } else if (is("cogging")) {
    v = {{"amplitude_n_m", 0.08 * s * torque}, {"periods_per_rev", static_cast<double>(random.Integer(4, 36))}};
    d.extra = {{"phase_rad", random.Uniform(-kPi, kPi)},
               {"second_share", random.Uniform(0.0, 0.25)},
               {"second_phase_rad", random.Uniform(-kPi, kPi)}};
  } else if (is("spring_hardening")) {
    v = {{"cubic_n_m_per_rad3",
          0.3 * s * plant.base.link_stiffness_n_m_per_rad / (m.angle2_peak_rad * m.angle2_peak_rad)}};
  }
  return d;
}

constexpr Limits kHighest[] = {{"command_delay", 15},        {"torque_delay", 4},      {"sensor_delay", 15},
                               {"actuator_lag", 12},         {"torque_limit", 6},      {"torque_speed_curve", 8},
                               {"torque_constant_droop", 5}, {"supply_sag", 4},        {"dead_zone", 6},
                               {"coulomb_friction", 6},      {"stribeck_friction", 6}, {"direction_asymmetry", 6},
                               {"load_friction", 6},         {"quadratic_drag", 15},   {"backlash", 12},
                               {"joint_compliance", 10},     {"cable_spring", 12},     {"gravity_offset", 12},
                               {"torque_bias", 8},           {"cogging", 8},           {"spring_hardening", 10}};

}  // namespace

std::string PlaceName(Rig rig, Place place) {
  const RigNames& names = Names(rig);
  switch (place) {
    case Place::kMotor:
      return "motor";
    case Place::kFirst:
      return names.first;
    case Place::kSecond:
      return names.second;
    case Place::kFirstSignal:
      return names.first_signal;
    case Place::kSecondSignal:
      break;
  }
  return names.second_signal;
}

std::vector<EffectRange> EffectsOf(Rig rig) {
  std::vector<EffectRange> list;
  const auto add = [&list](const char* name, Place place) {
    EffectRange range;
    range.choice.name = name;
    range.choice.place = place;
    for (const Limits& l : kHighest) {
      if (l.name == std::string_view(name)) range.highest = l.highest;
    }
    list.push_back(range);
  };
  const bool joint = rig == Rig::kJoint, flexible = rig == Rig::kFlexJoint || rig == Rig::kFlexLink;
  for (const char* name : {"command_delay", "actuator_lag", "torque_limit", "torque_speed_curve",
                           "torque_constant_droop", "supply_sag", "dead_zone", "direction_asymmetry"}) {
    add(name, Place::kMotor);
  }
  if (joint) add("torque_delay", Place::kMotor);
  for (const char* name :
       {"coulomb_friction", "stribeck_friction", "direction_asymmetry", "load_friction", "quadratic_drag", "backlash",
        "joint_compliance", "cable_spring", "gravity_offset", "cogging"}) {
    add(name, Place::kFirst);
  }
  if (!joint) add("torque_bias", Place::kFirst);  // on a position servo a zero offset, no finding
  // A beam has no dry hinge: the flexible link's second joint takes drag only.
  if (rig == Rig::kQube || rig == Rig::kFlexJoint) {
    for (const char* name : {"coulomb_friction", "stribeck_friction", "direction_asymmetry"}) add(name, Place::kSecond);
  }
  if (!joint) add("quadratic_drag", Place::kSecond);
  if (flexible) add("spring_hardening", Place::kSecond);
  add("sensor_delay", Place::kFirstSignal);
  if (!joint) add("sensor_delay", Place::kSecondSignal);
  return list;
}

Values AddEffect(const EffectChoice& choice, const Motion& motion, Plant* plant, Values* extra) {
  Drawn drawn = Draw(choice, motion, *plant);
  for (const Values* list : {&drawn.documented, &drawn.extra}) {
    for (const auto& [name, value] : *list) SetOne(choice.name, name, choice.place, value, plant);
  }
  if (choice.name == "actuator_lag") drawn.documented[0].second += drawn.extra[0].second;  // the sum of the poles
  if (choice.name == "torque_constant_droop") drawn.extra.push_back({"peak_n_m", PeakTorque(plant->rig)});
  if (extra) *extra = drawn.extra;
  return drawn.documented;
}

bool SetParameter(std::string_view name, double value, Plant* plant) {
  for (const BaseParameter& p : BaseParameters(plant->rig)) {
    if (p.name == name) {
      plant->base.*p.field = value;
      return true;
    }
  }
  const std::size_t dot = name.rfind('.');
  if (dot == std::string_view::npos) return false;
  std::string_view effect = name.substr(0, dot);
  const std::string_view parameter = name.substr(dot + 1);
  std::string_view on;
  if (const std::size_t at = effect.find('@'); at != std::string_view::npos) {
    on = effect.substr(at + 1);
    effect = effect.substr(0, at);
  }
  for (const EffectRange& range : EffectsOf(plant->rig)) {
    const std::string place = PlaceName(plant->rig, range.choice.place);
    if (range.choice.name != effect || (!on.empty() && on != place)) continue;
    if (effect == "direction_asymmetry" && (range.choice.place == Place::kMotor) != (parameter == "asymmetry"))
      continue;
    return SetOne(effect, parameter, range.choice.place, value, plant);
  }
  return false;
}

std::vector<std::string> ParameterNames(Rig rig) {
  std::vector<std::string> names;
  for (const BaseParameter& p : BaseParameters(rig)) names.push_back(p.name);
  for (const EffectRange& range : EffectsOf(rig)) {
    for (const Parameter& p : Parameters()) {
      if (p.effect == range.choice.name) {
        names.push_back(p.effect + "@" + PlaceName(rig, range.choice.place) + "." + p.name);
      }
    }
  }
  return names;
}

bool Clash(Rig rig, const EffectChoice& a, const EffectChoice& b) {
  if (a.name == b.name) return true;
  const auto both_in = [&](const std::set<std::string>& group) {
    return group.count(a.name) > 0 && group.count(b.name) > 0;
  };
  if (both_in({"torque_bias", "cable_spring", "gravity_offset", "direction_asymmetry"})) return true;
  if (rig == Rig::kJoint && both_in({"command_delay", "sensor_delay"})) return true;
  if (both_in({"torque_limit", "torque_speed_curve", "supply_sag"})) return true;
  if (Joint(a.place) != Joint(b.place)) return false;
  // One friction law per joint; and the split's share can be set once only.
  return both_in({"coulomb_friction", "stribeck_friction", "direction_asymmetry", "load_friction"}) ||
         both_in({"backlash", "joint_compliance"});
}

}  // namespace gapscope::twin
