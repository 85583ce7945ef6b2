// The LuGre model of gapscope.friction: bristle, presliding, sliding, integrators.
#include <cmath>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

constexpr double kBristleInertia = 0.01, kCoulomb = 0.2, kSigma0 = 50, kSigma1 = 0.2;

JointModel Bristle(double step_s, const std::string& integrator, double sigma1 = kSigma1) {
  JointModel joint{.step_s = step_s, .integrator = integrator, .inertia = kBristleInertia};
  joint.config = Config("model", "lugre") + Config("friction_n_m", kCoulomb) + Config("sigma0_n_m_per_rad", kSigma0) +
                 Config("sigma1_n_m_s_per_rad", sigma1);
  joint.actuators = "<motor joint=\"j\"/>";
  return joint;
}

// At imposed speed the bristle follows z = (F/sigma0)(1 - exp(-sigma0 w t / F)), whatever the step.
TEST(FrictionLugreTest, BristleIsExactAtAnyStep) {
  for (const double h : {0.0005, 0.004}) {
    const ModelPtr m = Compile(Bristle(h, "Euler", 0).Xml());
    const DataPtr d(mj_makeData(m.get()));
    constexpr double kSpeed = 0.3;
    for (int i = 0; i < 8; ++i) {
      d->qvel[0] = kSpeed;
      mj_forward(m.get(), d.get());
      const double expected = -kCoulomb * (1 - std::exp(-kSigma0 * d->qpos[0] / kCoulomb));
      EXPECT_NEAR(d->qfrc_passive[0], expected, 1e-12);
      d->ctrl[0] = -d->qfrc_passive[0];  // hold the speed
      mj_step(m.get(), d.get());
    }
  }
}

// Below breakaway the joint is a spring of sigma0; the static deflection of the rate-independent part is -(F/s0) ln(1 -
// T/F).
TEST(FrictionLugreTest, PreslidingBendsAndHolds) {
  for (const char* integrator : {"Euler", "implicitfast", "RK4"}) {
    const ModelPtr m = Compile(Bristle(0.001, integrator).Xml());
    const DataPtr d(mj_makeData(m.get()));
    // A slow, smooth ramp to half of the breakaway torque and a wait.
    while (d->time < 4) {
      d->ctrl[0] = 0.25 * kCoulomb * (1 - std::cos(std::acos(-1.0) * std::min(1.0, d->time / 3)));
      mj_step(m.get(), d.get());
    }
    const double expected = kCoulomb / kSigma0 * std::log(2);
    EXPECT_NEAR(d->qpos[0], expected, 0.01 * expected) << integrator;
    const double held = d->qpos[0];
    while (d->time < 14) mj_step(m.get(), d.get());
    EXPECT_NEAR(d->qpos[0], held, 1e-9) << "drift under load in 10 s";
    // Let go: it springs back part of the way.
    d->ctrl[0] = 0;
    while (d->time < 16) mj_step(m.get(), d.get());
    EXPECT_LT(d->qpos[0], 0.7 * held);
    EXPECT_GT(d->qpos[0], 0.0);
  }
}

TEST(FrictionLugreTest, SlidesAtTheLevel) {
  const ModelPtr m = Compile(Bristle(0.001, "implicitfast").Xml());
  const DataPtr d(mj_makeData(m.get()));
  d->ctrl[0] = 0.5;
  for (int i = 0; i < 500; ++i) mj_step(m.get(), d.get());
  EXPECT_NEAR(d->qacc[0], (0.5 - kCoulomb) / kBristleInertia, 1e-6);
}

// The gearbox's load is that of motor and gravity, never the friction itself, which would feed itself.
TEST(FrictionLugreTest, LoadDoesNotCountOwnTorque) {
  JointModel joint = Bristle(0.001, "Euler");
  joint.config += Config("load", "gearbox") + Config("load_coefficient", 0.5);
  const ModelPtr m = Compile(joint.Xml());
  const DataPtr d(mj_makeData(m.get()));
  d->ctrl[0] = 0.8;
  for (int i = 0; i < 500; ++i) mj_step(m.get(), d.get());
  EXPECT_NEAR(d->qacc[0], (0.8 - kCoulomb - 0.5 * 0.8) / kBristleInertia, 1e-6);
}

// RK4 computes four times a step; the bristle settles once, so that the result converges to a fine Euler run.
TEST(FrictionLugreTest, Rk4SettlesTheBristleOncePerStep) {
  const auto run = [](double h, const char* integrator) {
    const ModelPtr m = Compile(Bristle(h, integrator).Xml());
    const DataPtr d(mj_makeData(m.get()));
    while (d->time < 1 - 1e-9) {
      const double t = d->time;
      d->ctrl[0] = 0.3 * std::sin(12 * t);
      mj_step(m.get(), d.get());
    }
    return d->qpos[0];
  };
  const double fine = run(2e-5, "Euler");
  EXPECT_NEAR(run(2e-4, "RK4"), fine, 0.01 * std::abs(fine));
  EXPECT_NEAR(run(2e-4, "implicitfast"), fine, 0.02 * std::abs(fine));
}

}  // namespace
}  // namespace gapscope::test
