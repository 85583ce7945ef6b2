// Cases in which two or three effects explain the logs equally well because of how the rig was driven. That they do is
// not taken on faith: every member of the group is fitted to the logs, and its distance is in the label.
#include <algorithm>
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/twin/case.h"

namespace gapscope::twin {
namespace {

constexpr double kFarthest = 0.6;  // floors: a rival farther than this is no rival
constexpr int kAttempts = 14;

// One member of a group: how it enters a plant with a strength, and how a fit may move it.
struct Member {
  std::string name, on;
  std::function<void(Plant*, double strength)> put;
  std::vector<Direction> moves;
};

struct Construction {
  std::vector<Rig> rigs;
  std::vector<LogStyle> styles;
  bool position_only = false;
  double lowest_ratio = 3, highest_ratio = 30;
  std::vector<Member> members;
};

Direction Scale(double* (*field)(Plant*)) {
  return {[field](Plant* p, double x) { *field(p) *= std::exp(x); }, 0.05, 1.0};
}
Direction Shift(double* (*field)(Plant*), double step, double spread) {
  return {[field](Plant* p, double x) { *field(p) += x; }, step, spread};
}

Member Delay() {
  return {"command_delay",
          "motor",
          [](Plant* p, double s) { p->drive.command_delay_s = 0.004 * s; },
          {Scale([](Plant* p) { return &p->drive.command_delay_s; })}};
}
Member Lag() {
  return {"actuator_lag", "motor", [](Plant* p, double s) { p->drive.lag_s = 0.004 * s; }, {Scale([](Plant* p) {
            return &p->drive.lag_s;
          })}};
}
Member Late(Rig rig) {
  return {"sensor_delay",
          Names(rig).first_signal,
          [](Plant* p, double s) { p->sensor_delay_s[0] = 0.004 * s; },
          {Scale([](Plant* p) { return &p->sensor_delay_s[0]; })}};
}
Member Bias(Rig rig, double torque) {
  return {"torque_bias",
          Names(rig).first,
          [torque](Plant* p, double s) { p->load.bias_n_m = torque * s; },
          {Shift([](Plant* p) { return &p->load.bias_n_m; }, 0.05 * std::abs(torque), 10 * std::abs(torque))}};
}
Member Cable(Rig rig, double torque, double rest) {
  return {"cable_spring",
          Names(rig).first,
          [torque, rest](Plant* p, double s) {
            p->load.cable_stiffness = std::abs(torque) * s / std::max(std::abs(rest), 0.3);
            p->load.cable_rest_rad = rest;
          },
          {Scale([](Plant* p) { return &p->load.cable_stiffness; }),
           Shift([](Plant* p) { return &p->load.cable_rest_rad; }, 0.02, 1.0)}};
}
// Where the gravity torque equals the cable's: near its top far from rest, near its slope close to rest.
Member Gravity(Rig rig, double torque, double rest, bool far) {
  return {"gravity_offset",
          Names(rig).first,
          [torque, rest, far](Plant* p, double s) {
            p->load.gravity_n_m = std::abs(torque) * s / (far ? 1.0 : 0.3);
            p->load.gravity_rest_rad = far ? std::copysign(std::numbers::pi / 2, rest) : rest;
          },
          {Scale([](Plant* p) { return &p->load.gravity_n_m; }),
           Shift([](Plant* p) { return &p->load.gravity_rest_rad; }, 0.02, 1.0)}};
}
Member DeadZone(double peak) {
  return {"dead_zone",
          "motor",
          [peak](Plant* p, double s) { p->drive.dead_zone = 0.03 * peak * s; },
          {Scale([](Plant* p) { return &p->drive.dead_zone; })}};
}
Member Coulomb(Rig rig, double peak_torque) {
  return {"coulomb_friction",
          Names(rig).first,
          [peak_torque](Plant* p, double s) {
            p->dry[0].positive_n_m = p->dry[0].negative_n_m = 0.03 * peak_torque * s;
            p->dry[0].presliding_rad = 4e-4;
          },
          {{[](Plant* p, double x) {
              p->dry[0].positive_n_m *= std::exp(x);
              p->dry[0].negative_n_m = p->dry[0].positive_n_m;
            },
            0.05, 1.0}}};
}
Member Asymmetry() {
  return {"direction_asymmetry",
          "motor",
          [](Plant* p, double s) { p->drive.asymmetry = 0.02 * s; },
          {Shift([](Plant* p) { return &p->drive.asymmetry; }, 2e-3, 1.0)}};
}

std::vector<LogStyle> Same(LogStyle style, int count) {
  return std::vector<LogStyle>(static_cast<std::size_t>(count), style);
}

// All constructions for a rig; torques are of the order of what the drive does in small motions.
std::vector<Construction> ConstructionsOf(Rig rig, const Plant& plant, Random* random) {
  std::vector<Construction> list;
  const double torque_unit = rig == Rig::kJoint ? 4.0 : rig == Rig::kQube ? 8e-4 : 0.02;
  const double side = random->Sign();
  const double command = rig == Rig::kFlexLink ? 2.0 : 8.0;
  const bool joint = rig == Rig::kJoint;
  LogStyle small;  // tiny travel
  small.shape = random->Chance(0.5) ? Shape::kMultisine : Shape::kChirp;
  small.loop = !joint;
  small.low_hz = joint ? 0.5 : 1.0;
  small.high_hz = 8;
  if (joint) {
    LogStyle plain;
    plain.shape = Shape::kChirp;
    plain.low_hz = 0.2;
    plain.high_hz = 10;
    plain.envelope = {0.4, kNever, 8, kNever, 90};
    LogStyle steps = plain;
    steps.shape = Shape::kSteps;
    list.push_back({{rig}, {plain, steps, plain}, true, 4, 60, {Delay(), Late(rig)}});
  } else {
    small.envelope = {0.06, 0.12, kNever, command, kNever};
    const double rest = side * random->Uniform(1.8, 2.6);
    list.push_back(
        {{rig},
         Same(small, 4),
         false,
         3,
         9,
         {Bias(rig, side * torque_unit), Cable(rig, torque_unit, rest), Gravity(rig, torque_unit, rest, true)}});
    // Slow and smooth: a delay and a lag differ in the square of frequency times time only.
    LogStyle slow;
    slow.shape = Shape::kMultisine;
    slow.low_hz = 0.3;
    slow.high_hz = 1.0;
    slow.envelope = {2.5, 0.3, kNever, command, kNever};
    // Voltage drives are out: the Qube's pendulum swings at 1.7 Hz whatever the input, and the winding's lag has the
    // back-EMF inside.
    if (rig == Rig::kFlexLink) list.push_back({{rig}, Same(slow, 4), false, 3, 8, {Delay(), Lag()}});
  }
  small.envelope = {0.2, 0.25, joint ? 6.0 : kNever, joint ? kNever : command, joint ? 60.0 : kNever};
  const double rest = random->Uniform(-0.15, 0.15);
  list.push_back(
      {{rig}, Same(small, 4), joint, 3, 20, {Cable(rig, torque_unit, rest), Gravity(rig, torque_unit, rest, false)}});
  if (rig == Rig::kFlexJoint) {
    LogStyle slow;
    slow.shape = Shape::kSwept;
    slow.low_hz = 0.15;
    slow.high_hz = 0.3;
    slow.envelope = {2.5, 0.3, kNever, 8, kNever};
    const double stall =
        8 * plant.base.gear * plant.base.efficiency * plant.base.kt_n_m_per_a / plant.base.resistance_ohm;
    list.push_back({{rig}, Same(slow, 4), false, 3, 4.5, {DeadZone(8), Coulomb(rig, stall)}});
  }
  if (rig == Rig::kFlexLink) {
    LogStyle square;
    square.shape = Shape::kSquare;
    square.low_hz = 1.0;
    square.high_hz = 2.5;
    square.envelope = {1.5, 0.4, kNever, 3, kNever};
    list.push_back({{rig}, Same(square, 4), false, 3, 30, {Asymmetry(), Bias(rig, 0.01)}});
  }
  return list;
}

std::vector<LogSpec> MakeLogs(const Plant& plant, const Construction& built, Random* random) {
  constexpr double kRates[] = {200, 250, 500, 1000};
  const double rate = kRates[random->Integer(0, 3)];
  std::vector<LogSpec> logs;
  const bool one_amplitude = built.members[0].name == "direction_asymmetry";
  for (const LogStyle& style : built.styles) {
    LogSpec log = MakeLog(plant, style, std::round(random->Uniform(5, 8)), rate, random);
    if (one_amplitude) {
      log.excitation.growth = 0;  // the command has one size only, in all logs
      if (!logs.empty()) log.amplitude = logs[0].amplitude;
    }
    if (plant.rig == Rig::kJoint && !built.position_only) log.torque_column = true;
    logs.push_back(log);
  }
  return logs;
}

}  // namespace

bool MakeAmbiguous(Random* random, Case* made, std::string* problem) {
  Case best;
  double best_distance = kNever;
  for (int attempt = 0; attempt < kAttempts && best_distance > kFarthest; ++attempt) {
    const auto all = ConstructionsOf(made->rig, made->base, random);
    const Construction& built = all[static_cast<std::size_t>(random->Integer(0, static_cast<int>(all.size()) - 1))];
    Case c = *made;
    c.logs = MakeLogs(c.base, built, random);
    const auto truth = static_cast<std::size_t>(random->Integer(0, static_cast<int>(built.members.size()) - 1));
    const Member& member = built.members[truth];
    const auto plant_at = [&](double strength) {
      Plant plant = c.base;
      member.put(&plant, strength);
      return plant;
    };
    const double target = random->LogUniform(built.lowest_ratio, built.highest_ratio);
    const Search found = FindSeverity(plant_at, c.base, c.logs, c.sensors, target, 0.02, 20);
    if (found.severity <= 0 || found.gap.refit < 0.8 * built.lowest_ratio) continue;
    c.truth = plant_at(found.severity);
    c.gap = found.gap;
    GapOptions options;
    options.step_s = 5e-4;
    const auto records = CoarseRecords(c.truth, c.logs, c.sensors, options);
    double farthest = 0;
    c.group.clear();
    for (std::size_t i = 0; i < built.members.size(); ++i) {
      const Member& rival = built.members[i];
      Case::Member entry{rival.name, rival.on, 0};
      if (i != truth) {
        Plant start = c.base;
        rival.put(&start, found.severity);
        std::vector<Direction> directions = BaseDirections(c.rig);
        directions.insert(directions.end(), rival.moves.begin(), rival.moves.end());
        entry.distance_to_floor = FitRival(records, c.Floor(), directions, 8, options, &start).refit;
        farthest = std::max(farthest, entry.distance_to_floor);
      }
      c.group.push_back(entry);
    }
    if (!(farthest < best_distance)) continue;
    best_distance = farthest;
    EffectLabel label;
    label.choice.name = member.name;
    label.choice.severity = found.severity;
    label.gap = found.gap;
    const Plant& p = c.truth;
    const Load& l = p.load;
    if (member.name == "command_delay") label.parameters = {{"delay_s", p.drive.command_delay_s}};
    if (member.name == "actuator_lag") label.parameters = {{"time_constant_s", p.drive.lag_s}};
    if (member.name == "sensor_delay") label.parameters = {{"delay_s", p.sensor_delay_s[0]}};
    if (member.name == "torque_bias") label.parameters = {{"torque_n_m", l.bias_n_m}};
    if (member.name == "cable_spring") {
      label.parameters = {{"stiffness_n_m_per_rad", l.cable_stiffness}, {"rest_rad", l.cable_rest_rad}};
    }
    if (member.name == "gravity_offset") {
      label.parameters = {{"torque_n_m", l.gravity_n_m}, {"rest_rad", l.gravity_rest_rad}};
    }
    if (member.name == "dead_zone") {
      label.parameters = {{"half_width_" + Names(c.rig).command_suffix, p.drive.dead_zone}};
    }
    if (member.name == "coulomb_friction") label.parameters = {{"friction_n_m", p.dry[0].positive_n_m}};
    if (member.name == "direction_asymmetry") label.parameters = {{"asymmetry", p.drive.asymmetry}};
    label.choice.place = member.on == "motor"                     ? Place::kMotor
                         : member.on == Names(c.rig).first_signal ? Place::kFirstSignal
                                                                  : Place::kFirst;
    c.effects = {label};
    best = c;
  }
  if (best_distance > 2 * kFarthest) {
    *problem = "no construction made its group indistinguishable";
    return false;
  }
  *made = best;
  return true;
}

}  // namespace gapscope::twin
