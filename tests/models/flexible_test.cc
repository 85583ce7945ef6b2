// Flexible joint and flexible links: MuJoCo against
//   J1 th'' + J2 (th'' + al'') + B1 th' = tau,   J2 (th'' + al'') + B2 al' + K al = 0,   tau = gain u - back th'
// and against the matrices A and B of the rotary flexible joint's report (2.1.3).
#include <gtest/gtest.h>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

struct FlexibleConstants {
  double gain, back, j1, b1, j2, k, b2, limit = 1e9;

  std::array<double, 4> operator()(const std::array<double, 4>& x, const std::vector<double>& u) const {
    const double command = std::fmin(std::fmax(u[0], -limit), limit);
    const double spring = k * x[1] + b2 * x[3];
    const double base = (gain * command - back * x[2] - b1 * x[2] + spring) / j1;
    return {x[2], x[3], base, -spring / j2 - base};
  }
};

struct FlexibleCase {
  const char* rig;
  const char* first;
  const char* second;
  FlexibleConstants p;
  double amplitude;
};

// Contract and source values, written out again here.
const std::vector<FlexibleCase>& FlexibleCases() {
  static const std::vector<FlexibleCase> cases = {
      {"flexjoint",
       "base",
       "link",
       {0.621 * 0.00768 * 70 / 2.6, 0.621 * 0.00768 * 0.00768 * 70 * 70 / 2.6, 0.002087, 0.015, 0.003156, 1.8426,
        0.001},
       5},
      {"flexlink", "hub", "deflection", {0.3338496, 0, 0.002087, 0.015, 0.0038, 1.0936, 0.0015}, 0.6},
      {"flexlink_2dsfl", "hub", "deflection", {8.925, 0, 0.0635, 4.0, 0.1704, 39.96, 0, 0.94}, 1.4}};
  return cases;
}

TEST(FlexibleModelTest, FollowsTheEquations) {
  constexpr double kFlexibleStep_s = 2e-5, kFlexible_rad = 1e-6;
  for (const auto& c : FlexibleCases()) {
    const ModelPtr m = LoadRig(c.rig);
    ASSERT_NE(m, nullptr);
    ASSERT_EQ(JointDof(*m, c.first), 0);
    ASSERT_EQ(JointDof(*m, c.second), 1);
    const double h = m->opt.timestep;
    const auto command = [&](int k) { return std::vector<double>{ChirpAndSteps(k * h, c.amplitude, 0.2, 8, 2)}; };
    const Motion motion = Drive(*m, {0.1, -0.05}, static_cast<int>(std::lround(2 / h)), command);
    EXPECT_LT(LargestDifference<4>(*m, motion, {0.1, -0.05}, kFlexibleStep_s, c.p, command), kFlexible_rad) << c.rig;
  }
}

// The report's A and B, its state (th, th', al, al') reordered to (th, al, th', al').
TEST(FlexibleModelTest, LinearisedMatricesOfTheReport) {
  for (const auto& c : FlexibleCases()) {
    const ModelPtr m = LoadRig(c.rig);
    ASSERT_NE(m, nullptr);
    const auto& p = c.p;
    const double damping = (p.back + p.b1) / p.j1, both = (p.j1 + p.j2) / (p.j1 * p.j2);
    const std::array<double, 16> a = {0, 0,           1,        0,            //
                                      0, 0,           0,        1,            //
                                      0, p.k / p.j1,  -damping, p.b2 / p.j1,  //
                                      0, -p.k * both, damping,  -p.b2 * both};
    const std::array<double, 4> b = {0, 0, p.gain / p.j1, -p.gain / p.j1};
    const Linear linear = Linearise(*m, {0, 0});
    for (int i = 0; i < 16; ++i)
      EXPECT_NEAR(linear.a[i], a[i], 1e-7 * std::abs(a[i]) + 1e-7) << c.rig << " A[" << i << "]";
    for (int i = 0; i < 4; ++i)
      EXPECT_NEAR(linear.b[i], b[i], 1e-7 * std::abs(b[i]) + 1e-9) << c.rig << " B[" << i << "]";
  }
}

// The rig's nominal values: 2.70 Hz with the hub clamped; the seed's resonance of 3.84568 Hz.
TEST(FlexibleModelTest, ClampedFrequencies) {
  const auto hertz = [](const FlexibleConstants& p) { return std::sqrt(p.k / p.j2) / (2 * 3.14159265358979323846); };
  EXPECT_NEAR(hertz(FlexibleCases()[0].p), 3.84568, 5e-4);
  EXPECT_NEAR(hertz(FlexibleCases()[1].p), 2.70, 5e-3);
}

TEST(FlexibleModelTest, EnergyIsKeptWithoutDampingAndCommand) {
  for (const auto& c : FlexibleCases()) {
    const ModelPtr m = LoadRig(c.rig);
    ASSERT_NE(m, nullptr);
    mju_zero(m->dof_damping, m->nv);
    m->actuator_biasprm[2] = 0;
    DataPtr d(mj_makeData(m.get()));
    d->qpos[1] = 0.2;
    const double before = c.p.k * 0.2 * 0.2 / 2;
    for (int k = 0; k < 1000; ++k) mj_step(m.get(), d.get());
    const double tip = d->qvel[0] + d->qvel[1];
    const double after =
        c.p.j1 * d->qvel[0] * d->qvel[0] / 2 + c.p.j2 * tip * tip / 2 + c.p.k * d->qpos[1] * d->qpos[1] / 2;
    EXPECT_NEAR(after, before, 1e-4 * before) << c.rig;
  }
}

// Positive commands accelerate the driven joint positive; the link lags behind.
TEST(FlexibleModelTest, Signs) {
  for (const auto& c : FlexibleCases()) {
    const ModelPtr m = LoadRig(c.rig);
    ASSERT_NE(m, nullptr);
    DataPtr d(mj_makeData(m.get()));
    d->ctrl[0] = 0.5;
    mj_forward(m.get(), d.get());
    EXPECT_GT(d->qacc[0], 0) << c.rig;
    EXPECT_LT(d->qacc[1], 0) << c.rig;
  }
}

}  // namespace
}  // namespace gapscope::testing
