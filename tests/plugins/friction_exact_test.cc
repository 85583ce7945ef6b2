// gapscope.friction against exact solutions: closed forms between events, events found exactly.
#include <cmath>
#include <functional>
#include <numbers>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

constexpr double kInertia = 0.01, kStiffness = 1.0;
const double kOmega = std::sqrt(kStiffness / kInertia);

// I q'' = -k q - F sgn(q'): half cosines about +-F/k until it stops within F/k.
double DecayExact(double q0, double friction, double t) {
  const double shift = friction / kStiffness, half = std::numbers::pi / kOmega;
  double start = q0, begin = 0;
  while (std::abs(start) > shift) {
    const double centre = start > 0 ? shift : -shift;
    if (t < begin + half) return centre + (start - centre) * std::cos(kOmega * (t - begin));
    start = 2 * centre - start;
    begin += half;
  }
  return start;
}

double DecayError(double step_s, const std::string& integrator) {
  JointModel joint{.step_s = step_s, .integrator = integrator, .inertia = kInertia};
  joint.joint = "stiffness=\"" + Text(kStiffness) + "\"";
  joint.config = Config("friction_n_m", 0.07);
  const ModelPtr m = Compile(joint.Xml());
  const DataPtr d(mj_makeData(m.get()));
  d->qpos[0] = 1;
  double worst = 0;
  while (d->time < 4) {
    mj_step(m.get(), d.get());
    worst = std::max(worst, std::abs(d->qpos[0] - DecayExact(1, 0.07, d->time)));
  }
  EXPECT_LT(std::abs(d->qvel[0]), 1e-5) << "sticks within the dead zone";
  return worst;
}

TEST(FrictionExactTest, SpringDecaysByEqualSwingsAndSticks) {
  // Each turn falls within a step, whose rest the joint stands still: first order in h for every integrator.
  constexpr double kEulerError_rad_per_s = 5, kRk4Error_rad_per_s = 4;
  for (const double h : {0.004, 0.002, 0.001}) {
    const double euler = DecayError(h, "Euler"), rk4 = DecayError(h, "RK4");
    std::printf("decay h %g: Euler %.3g rad, RK4 %.3g rad\n", h, euler, rk4);
    EXPECT_LT(euler, kEulerError_rad_per_s * h);
    EXPECT_LT(rk4, kRk4Error_rad_per_s * h);
  }
}

// A block on a belt of speed v, held by a spring to the ground; seen from the belt, a spring whose end moves at v pulls
// it. Static level S, sliding level F: it sticks until k (v t - q) = S, slides on a sinusoid, and sticks again when q'
// = 0.
class BeltExact {
 public:
  BeltExact(double speed, double sliding, double breakaway) : v_(speed), f_(sliding), s_(breakaway) {}
  // q at time t, in the belt's frame.
  double At(double t) {
    while (true) {
      const double release = (s_ / kStiffness + q_) / v_;
      if (t <= release) return q_;
      // Sliding: e = v t - q - F/k obeys e'' = -w^2 e with e = (S-F)/k, e' = v at release; q' = v - e' = 0 again at
      // `duration`.
      const double e0 = (s_ - f_) / kStiffness, a = e0, b = v_ / kOmega;
      const double duration = 2 / kOmega * (std::numbers::pi - std::atan2(e0 * kOmega, v_));
      const auto place = [&](double since) {
        return v_ * (release + since) - f_ / kStiffness - (a * std::cos(kOmega * since) + b * std::sin(kOmega * since));
      };
      if (t < release + duration) return place(t - release);
      q_ = place(duration);
      ++cycles_;
    }
  }
  int cycles() const { return cycles_; }

 private:
  double v_, f_, s_, q_ = 0;
  int cycles_ = 0;
};

double BeltError(double step_s, const std::string& integrator, int* cycles) {
  constexpr double kSpeed = 0.4, kSliding = 0.2, kBreakaway = 0.5;
  JointModel joint{.step_s = step_s, .integrator = integrator, .inertia = kInertia};
  joint.config = Config("friction_n_m", kSliding) + Config("breakaway_n_m", kBreakaway) +
                 Config("stribeck_speed_rad_per_s", 2e-6) +  // a jump from S to F, as in the closed form
                 Config("row_softness", 0.01);               // at rest well below that speed
  joint.actuators = "<position joint=\"j\" kp=\"" + Text(kStiffness) + "\"/>";
  const ModelPtr m = Compile(joint.Xml());
  const DataPtr d(mj_makeData(m.get()));
  BeltExact exact(kSpeed, kSliding, kBreakaway);
  double worst = 0;
  while (d->time < 10) {
    d->ctrl[0] = kSpeed * (d->time + 0.5 * step_s);  // held over the step: its mean
    mj_step(m.get(), d.get());
    worst = std::max(worst, std::abs(d->qpos[0] - exact.At(d->time)));
  }
  *cycles = exact.cycles();
  return worst;
}

TEST(FrictionExactTest, BlockOnABeltSticksAndSlips) {
  // A release that comes late by T lengthens the slip by 2 v T and so delays the next release by 2 T more. With 1.5
  // steps (half a step until the pull is seen, one until the level has dropped) over 5 cycles: 15 h, at the top slip
  // speed of (S-F) w / k.
  const double kError_rad_per_s = 5 * 2 * 1.5 * 0.3 * kOmega / kStiffness;
  for (const char* integrator : {"Euler", "implicitfast", "RK4"}) {
    for (const double h : {0.004, 0.002, 0.001, 0.0005}) {
      int cycles = 0;
      const double error = BeltError(h, integrator, &cycles);
      std::printf("belt %s h %g: %.3g rad, %d cycles\n", integrator, h, error, cycles);
      EXPECT_EQ(cycles, 5);
      EXPECT_LT(error, kError_rad_per_s * h);
    }
  }
}

// With a Stribeck hump of finite width there is no closed form: the sliding phase by RK4 at 2 us, the stop found
// exactly.
TEST(FrictionExactTest, StribeckToStandstill) {
  constexpr double kCoulomb = 0.1, kBreakaway = 0.2, kSpeed = 0.5, kViscous = 0.005;
  const auto slow = [&](double w) {
    return -(kCoulomb + (kBreakaway - kCoulomb) * std::exp(-w * w / (kSpeed * kSpeed)) + kViscous * w) / kInertia;
  };
  double q = 0, w = 8;
  constexpr double kFine_s = 2e-6;
  while (w > 0) {
    const double a = slow(w), b = slow(w + 0.5 * kFine_s * a), c = slow(w + 0.5 * kFine_s * b),
                 e = slow(w + kFine_s * c);
    const double next = w + kFine_s / 6 * (a + 2 * b + 2 * c + e);
    q += next > 0 ? 0.5 * kFine_s * (w + next) : 0.5 * w * w / -slow(w);
    w = next;
  }
  for (const auto& [integrator, rate] : {std::pair{"Euler", 4.5}, {"implicitfast", 4.5}, {"RK4", 0.1}}) {
    for (const double h : {0.005, 0.002, 0.0005}) {
      JointModel joint{.step_s = h, .integrator = integrator, .inertia = kInertia};
      joint.config = Config("friction_n_m", kCoulomb) + Config("breakaway_n_m", kBreakaway) +
                     Config("stribeck_speed_rad_per_s", kSpeed) + Config("viscous_n_m_s_per_rad", kViscous);
      const ModelPtr m = Compile(joint.Xml());
      const DataPtr d(mj_makeData(m.get()));
      d->qvel[0] = 8;
      while (d->time < 1.5) mj_step(m.get(), d.get());
      std::printf("Stribeck %s h %g: %.3g rad of %.4g\n", integrator, h, d->qpos[0] - q, q);
      EXPECT_LT(std::abs(d->qpos[0] - q), rate * h);
    }
  }
}

}  // namespace
}  // namespace gapscope::test
