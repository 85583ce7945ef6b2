#include "tests/twin/friction.h"

#include <algorithm>
#include <cmath>

namespace gapscope::twin {
namespace {

// Shares of the friction and slip distances over presliding_rad: the stiffest element slips first.
constexpr std::array<double, Bristles::kElements> kShare = {0.4, 0.3, 0.2, 0.1};
constexpr std::array<double, Bristles::kElements> kSlip = {0.3, 0.8, 1.6, 3.0};
constexpr double kNearLimit = 0.05;  // of the limit
constexpr double kCableSlipRad = 0.03;

double Typical(const Dry& dry, double load_n_m) {
  const double slide = std::max(dry.positive_n_m, dry.negative_n_m);
  return std::max(slide + dry.load_coefficient * std::abs(load_n_m), 1e-12);
}

// Where a Maxwell element slips in that direction: its stiffness is that at which the larger direction slips at `slip`.
double Limit(const Dry& dry, int i, double direction, double speed, double load_n_m) {
  return kSlip[i] * dry.presliding_rad / Typical(dry, load_n_m) * SlipTorque(dry, direction, speed, load_n_m);
}

// One Maxwell element after `distance`.
double Element(const Dry& dry, int i, double z, double distance, double speed, double load_n_m) {
  return std::clamp(z + distance, -Limit(dry, i, -1, speed, load_n_m), Limit(dry, i, 1, speed, load_n_m));
}

double LuGre(const Dry& dry, double z, double distance, double speed, double load_n_m) {
  const double direction = distance != 0 ? std::copysign(1.0, distance) : std::copysign(1.0, speed);
  const double end =
      direction * dry.presliding_rad * SlipTorque(dry, direction, speed, load_n_m) / Typical(dry, load_n_m);
  if (end == 0) return 0;
  return end + (z - end) * std::exp(-std::abs(distance / end));
}

}  // namespace

double SlipTorque(const Dry& dry, double direction, double speed, double load_n_m) {
  const double slide = direction >= 0 ? dry.positive_n_m : dry.negative_n_m;
  const double ratio = speed / dry.stribeck_speed_rad_per_s;
  const double hump = dry.breakaway_over_slide > 1 ? (dry.breakaway_over_slide - 1) * std::exp(-ratio * ratio) : 0.0;
  return slide * (1 + hump) + dry.load_coefficient * std::abs(load_n_m);
}

double Bristles::Torque(const Dry& dry, double distance_rad, double speed, double load_n_m, double inertia) const {
  if (!dry.Any()) return 0;
  const double typical = Typical(dry, load_n_m);
  if (dry.law == FrictionLaw::kMaxwellSlip) {
    double torque = 0, stuck = 0;
    for (int i = 0; i < kElements; ++i) {
      const double z = Element(dry, i, deflection_rad_[i], distance_rad, speed, load_n_m);
      torque += kShare[i] * typical * z / (kSlip[i] * dry.presliding_rad);
      // Stuck: well short of its limit in the direction of motion. Near it counts as sliding: the limit itself moves a
      // little with load and speed, and an element that has only to follow it does not stick.
      const double direction = std::copysign(1.0, speed), limit = Limit(dry, i, direction, speed, load_n_m);
      if (limit > 0) stuck += kShare[i] * std::clamp((1 - direction * z / limit) / kNearLimit, 0.0, 1.0);
    }
    // Elements that stick lose a little to viscosity, or a stopped joint would tremble for ever.
    return torque + stuck * 0.5 * std::sqrt(typical / dry.presliding_rad * inertia) * speed;
  }
  const double stiffness = typical / dry.presliding_rad;
  const double z = LuGre(dry, deflection_rad_[0], distance_rad, speed, load_n_m);
  const double slip = SlipTorque(dry, speed, speed, load_n_m);
  const double rate = slip > 0 ? speed - stiffness * std::abs(speed) * z / slip : 0.0;
  return stiffness * z + std::sqrt(stiffness * inertia) * rate;
}

void Bristles::Commit(const Dry& dry, double distance_rad, double speed, double load_n_m) {
  if (!dry.Any()) return;
  if (dry.law == FrictionLaw::kLuGre) {
    deflection_rad_[0] = LuGre(dry, deflection_rad_[0], distance_rad, speed, load_n_m);
    return;
  }
  for (int i = 0; i < kElements; ++i) {
    deflection_rad_[i] = Element(dry, i, deflection_rad_[i], distance_rad, speed, load_n_m);
  }
}

void Bristles::Slide(const Dry& dry, double speed, double load_n_m) {
  deflection_rad_ = {};
  if (speed != 0) Commit(dry, std::copysign(1e3 * dry.presliding_rad, speed), speed, load_n_m);
}

double CableHysteresis::Next(double deflection, double distance) {
  return std::clamp(deflection + distance, -kCableSlipRad, kCableSlipRad);
}

double CableHysteresis::Torque(const Load& load, double distance_rad) const {
  return load.cable_stiffness * load.cable_hysteresis * Next(deflection_rad_, distance_rad) / kCableSlipRad;
}

void CableHysteresis::Commit(const Load&, double distance_rad) {
  deflection_rad_ = Next(deflection_rad_, distance_rad);
}

}  // namespace gapscope::twin
