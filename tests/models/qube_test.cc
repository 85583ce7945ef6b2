// The Qube: MuJoCo against the equations of a rotary pendulum of uniform rods, written out from the Lagrangian.
//
//   a = J + m L^2 + w m l^2 sin^2 alpha,  b = m L (l/2) cos alpha,  c = m l^2/3
//   a th'' + b al'' = kt (V - km th')/R - d_arm th' - 2 w m l^2 sin cos th' al' + m L (l/2) sin al'^2
//   b th'' + c al'' = -d_pend al' + w m l^2 sin cos th'^2 - m g (l/2) sin
//
// with L the arm, l and m the pendulum, J arm, rotor and hub about the axis. w = 1/3 for a uniform rod; the SimuRLacra
// source has w = 1/4 and J = m_arm L^2/12.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

struct QubeConstants {
  double r = 8.4, kt = 0.042, km = 0.042, arm_length = 0.085, mass = 0.024, length = 0.129, g = 9.81;
  double arm_inertia = 0.095 * 0.085 * 0.085 / 3 + 4.0e-6 + 0.6e-6;
  double arm_damping = 1.5e-4, pendulum_damping = 3.0e-5, w = 1.0 / 3;

  double A(double alpha) const {
    return arm_inertia + mass * arm_length * arm_length +
           w * mass * length * length * std::sin(alpha) * std::sin(alpha);
  }
  double B(double alpha) const { return mass * arm_length * length / 2 * std::cos(alpha); }
  double C() const { return mass * length * length / 3; }

  std::array<double, 4> operator()(const std::array<double, 4>& x, const std::vector<double>& u) const {
    const auto [theta, alpha, dtheta, dalpha] = x;
    (void)theta;
    const double s = std::sin(alpha), centrifugal = w * mass * length * length * s * std::cos(alpha);
    const double right1 = kt * (u[0] - km * dtheta) / r - arm_damping * dtheta - 2 * centrifugal * dtheta * dalpha +
                          mass * arm_length * length / 2 * s * dalpha * dalpha;
    const double right2 = -pendulum_damping * dalpha + centrifugal * dtheta * dtheta - mass * g * length / 2 * s;
    const double a = A(alpha), b = B(alpha), c = C(), det = a * c - b * b;
    return {dtheta, dalpha, (c * right1 - b * right2) / det, (a * right2 - b * right1) / det};
  }

  double Energy(double alpha, double dtheta, double dalpha) const {
    return A(alpha) * dtheta * dtheta / 2 + B(alpha) * dtheta * dalpha + C() * dalpha * dalpha / 2 -
           mass * g * length / 2 * std::cos(alpha);
  }
};

constexpr double kQubeStep_s = 2e-5;
// A rod is given 1e-10 kg m2 about itself, a quarter of a millionth of the inertia about the axis: that is what is left
// over.
constexpr double kTolerance_rad = 2e-5;

TEST(QubeModelTest, FollowsTheEquationsSwingingWidely) {
  const ModelPtr m = LoadRig("qube");
  ASSERT_NE(m, nullptr);
  const double h = m->opt.timestep;
  const auto command = [&](int k) { return std::vector<double>{ChirpAndSteps(k * h, 4, 0.3, 6, 2)}; };
  const Motion motion = Drive(*m, {0, 0.3}, static_cast<int>(std::lround(2 / h)), command);
  EXPECT_LT(LargestDifference<4>(*m, motion, {0, 0.3}, kQubeStep_s, QubeConstants{}, command), kTolerance_rad);
  // It swung: the check would be idle on a hanging pendulum.
  double widest = 0;
  for (const auto& q : motion.q) widest = std::fmax(widest, std::abs(q[1]));
  EXPECT_GT(widest, 0.8);
}

TEST(QubeModelTest, SimurlacraHoldsTheSourcesOwnFormula) {
  const ModelPtr m = LoadRig("qube_simurlacra");
  ASSERT_NE(m, nullptr);
  QubeConstants source;
  source.arm_inertia = 0.095 * 0.085 * 0.085 / 12;
  source.w = 0.25;
  source.arm_damping = 5e-6;
  source.pendulum_damping = 1e-6;
  // As its experiment.yaml sets them.
  const int arm = mj_name2id(m.get(), mjOBJ_BODY, "arm"), pendulum = mj_name2id(m.get(), mjOBJ_BODY, "pendulum");
  m->dof_armature[0] = 0;
  m->dof_armature[1] = source.mass * source.length * source.length / 12;
  m->dof_damping[0] = source.arm_damping;
  m->dof_damping[1] = source.pendulum_damping;
  mju_zero3(m->body_ipos + 3 * arm);
  m->body_inertia[3 * arm + 1] = m->body_inertia[3 * arm + 2] = source.arm_inertia;
  m->body_inertia[3 * pendulum] = m->body_inertia[3 * pendulum + 1] = 1e-10;
  DataPtr d(mj_makeData(m.get()));
  mj_setConst(m.get(), d.get());
  const double h = m->opt.timestep;
  const auto command = [&](int k) { return std::vector<double>{ChirpAndSteps(k * h, 1.5, 10, 0.5, 2)}; };
  const Motion motion = Drive(*m, {0, 0}, static_cast<int>(std::lround(2 / h)), command);
  EXPECT_LT(LargestDifference<4>(*m, motion, {0, 0}, kQubeStep_s, source, command), kTolerance_rad);
}

// The documents' A and B: hanging (sign +1) and upright (sign -1) differ in the coupling and the gravity term.
TEST(QubeModelTest, LinearisedMatricesHangingAndUpright) {
  const ModelPtr m = LoadRig("qube");
  ASSERT_NE(m, nullptr);
  const QubeConstants p;
  constexpr double kRelative = 1e-5;
  for (const double sign : {1.0, -1.0}) {
    const double alpha = sign > 0 ? 0 : std::numbers::pi;
    const double a = p.arm_inertia + p.mass * p.arm_length * p.arm_length,
                 b = sign * p.mass * p.arm_length * p.length / 2, c = p.C();
    const double det = a * c - b * b, gravity = sign * p.mass * p.g * p.length / 2;
    const double friction = p.kt * p.km / p.r + p.arm_damping;
    const std::array<double, 16> expected_a = {0,
                                               0,
                                               1,
                                               0,  //
                                               0,
                                               0,
                                               0,
                                               1,  //
                                               0,
                                               b * gravity / det,
                                               -c * friction / det,
                                               b * p.pendulum_damping / det,  //
                                               0,
                                               -a * gravity / det,
                                               b * friction / det,
                                               -a * p.pendulum_damping / det};
    const std::array<double, 4> expected_b = {0, 0, c * p.kt / (p.r * det), -b * p.kt / (p.r * det)};
    const Linear linear = Linearise(*m, {0, alpha});
    for (int i = 0; i < 16; ++i) {
      EXPECT_NEAR(linear.a[i], expected_a[i], kRelative * std::abs(expected_a[i]) + 1e-6)
          << "A[" << i << "], sign " << sign;
    }
    for (int i = 0; i < 4; ++i) EXPECT_NEAR(linear.b[i], expected_b[i], kRelative * std::abs(expected_b[i]) + 1e-9);
    // Hanging is stable, upright is not.
    EXPECT_LT(sign * linear.a[13], 0);
  }
}

TEST(QubeModelTest, EnergyIsKeptWithoutDampingAndVoltage) {
  const ModelPtr m = LoadRig("qube");
  ASSERT_NE(m, nullptr);
  mju_zero(m->dof_damping, m->nv);
  m->actuator_biasprm[2] = 0;
  QubeConstants p;
  DataPtr d(mj_makeData(m.get()));
  d->qpos[1] = 2.5;
  d->qvel[0] = 3;
  const double before = p.Energy(d->qpos[1], d->qvel[0], d->qvel[1]);
  for (int k = 0; k < 1000; ++k) mj_step(m.get(), d.get());
  const double after = p.Energy(d->qpos[1], d->qvel[0], d->qvel[1]);
  EXPECT_NEAR(after, before, 1e-5 * p.mass * p.g * p.length);
}

// What a log of this rig means: positive voltage turns the arm positive; the pendulum grows when its tip moves the way
// a positive arm rotation moves it, so a hanging pendulum swings negative when the arm accelerates positive.
TEST(QubeModelTest, SignsAreThoseOfTheContract) {
  const ModelPtr m = LoadRig("qube");
  ASSERT_NE(m, nullptr);
  DataPtr d(mj_makeData(m.get()));
  d->ctrl[Actuator(*m, "motor")] = 1;
  mj_forward(m.get(), d.get());
  const int arm = JointDof(*m, "arm"), pendulum = JointDof(*m, "pendulum");
  EXPECT_GT(d->qacc[arm], 0);
  EXPECT_LT(d->qacc[pendulum], 0);

  const int body = mj_name2id(m.get(), mjOBJ_BODY, "pendulum");
  const auto tip = [&](double q_arm, double q_pendulum) {
    d->qpos[0] = q_arm;
    d->qpos[1] = q_pendulum;
    mj_kinematics(m.get(), d.get());
    const mjtNum local[3] = {0, 0, -0.129};
    std::array<double, 3> p;
    mju_mulMatVec3(p.data(), d->xmat + 9 * body, local);
    mju_addTo3(p.data(), d->xpos + 3 * body);
    return p;
  };
  const auto rest = tip(0, 0), by_arm = tip(0.01, 0), by_pendulum = tip(0, 0.01);
  double dot = 0;
  for (int i = 0; i < 3; ++i) dot += (by_arm[i] - rest[i]) * (by_pendulum[i] - rest[i]);
  EXPECT_GT(dot, 0);
  // Hanging at zero: the tip rises either way.
  EXPECT_GT(by_pendulum[2], rest[2]);
  EXPECT_GT(tip(0, -0.01)[2], rest[2]);
}

}  // namespace
}  // namespace gapscope::testing
