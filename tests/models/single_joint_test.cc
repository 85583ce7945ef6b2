// The single joint and the AK80: MuJoCo against J q'' = kp (target - q) - kd q' + feedforward - b q' - m g c sin q.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

constexpr double kReferenceStep_s = 1e-5;

TEST(JointModelTest, FollowsTheServoEquation) {
  const ModelPtr m = LoadRig("joint");
  ASSERT_NE(m, nullptr);
  // Contract values, written out again here: the MJCF must hold them.
  constexpr double kKp = 157.1451, kKd = 7.0729, kInertia = 0.159221308, kViscous = 0.5;
  constexpr double kTolerance_rad = 1e-6;
  const double h = m->opt.timestep;
  const int target = Actuator(*m, "motor"), feedforward = Actuator(*m, "motor.feedforward");
  ASSERT_EQ(m->nu, 2);
  const auto command = [&](int k) {
    std::vector<double> u(2);
    u[target] = ChirpAndSteps(k * h, 0.15, 0.1, 10, 2);
    u[feedforward] = k * h > 1 ? 3.0 * std::sin(9 * k * h) : 0;
    return u;
  };
  const auto f = [&](const std::array<double, 2>& x, const std::vector<double>& u) {
    const double torque = kKp * (u[target] - x[0]) - kKd * x[1] + u[feedforward];
    return std::array<double, 2>{x[1], (torque - kViscous * x[1]) / kInertia};
  };
  const Motion motion = Drive(*m, {0.05}, static_cast<int>(std::lround(2 / h)), command);
  EXPECT_LT(LargestDifference<2>(*m, motion, {0.05}, kReferenceStep_s, f, command), kTolerance_rad);
}

TEST(JointModelTest, HasNoGravityLoad) {
  const ModelPtr m = LoadRig("joint");
  ASSERT_NE(m, nullptr);
  DataPtr d(mj_makeData(m.get()));
  for (double q = -3; q <= 3; q += 0.5) {
    d->qpos[0] = q;
    mj_forward(m.get(), d.get());
    EXPECT_NEAR(d->qfrc_bias[0], 0, 1e-12);
  }
}

// As experiment.yaml sets a PD run: live parameters of the motor plugin.
void SetGains(mjModel* m, double kp, double kd) {
  for (const auto& [name, value] : {std::pair{"motor.kp", kp}, std::pair{"motor.kd", kd}}) {
    const int id = mj_name2id(m, mjOBJ_NUMERIC, name);
    ASSERT_GE(id, 0) << name;
    m->numeric_data[m->numeric_adr[id]] = value;
  }
}

TEST(Ak80ModelTest, FollowsThePendulumEquationUnderTorqueAndUnderPd) {
  constexpr double kMass = 0.676, kCom = 0.45, kInertia = 0.0104 + 0.676 * 0.45 * 0.45 + 0.002186, kViscous = 0.1,
                   kG = 9.81;
  constexpr double kTolerance_rad = 1e-6;
  for (const auto& [kp, kd] : {std::pair{0.0, 0.0}, std::pair{15.5, 2.5}}) {
    const ModelPtr m = LoadRig("ak80");
    ASSERT_NE(m, nullptr);
    SetGains(m.get(), kp, kd);
    const double h = m->opt.timestep;
    ASSERT_EQ(m->nu, 3);
    const int position = Actuator(*m, "motor"), velocity = Actuator(*m, "motor.velocity"),
              torque = Actuator(*m, "motor.feedforward");
    const auto command = [&](int k) {
      std::vector<double> u(3);
      u[position] = 0.8 * std::sin(3 * k * h);
      u[velocity] = 2.4 * std::cos(3 * k * h);
      u[torque] = ChirpAndSteps(k * h, 0.9, 0.2, 3, 2);
      return u;
    };
    const auto f = [&](const std::array<double, 2>& x, const std::vector<double>& u) {
      const double tau = kp * (u[position] - x[0]) + kd * (u[velocity] - x[1]) + u[torque];
      return std::array<double, 2>{x[1], (tau - kViscous * x[1] - kMass * kG * kCom * std::sin(x[0])) / kInertia};
    };
    const Motion motion = Drive(*m, {-0.1}, static_cast<int>(std::lround(2 / h)), command);
    EXPECT_LT(LargestDifference<2>(*m, motion, {-0.1}, kReferenceStep_s, f, command), kTolerance_rad) << "kp " << kp;
  }
}

}  // namespace
}  // namespace gapscope::testing
