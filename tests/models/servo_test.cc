// Hobby servos: MuJoCo against (m l^2 + armature) q'' = tau - b q' - m g l sin(q + offset) - dry friction, with
// tau = kt (clip(k (target - q)) V - kt q')/R. The mechanism is checked with a native actuator in the plugin's place,
// unclipped; the whole, with clipping and switching off, with the plugin.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

struct ServoCase {
  const char* rig;
  double mass, length, armature, viscous, friction, kt, r, gain, limit, supply;
};

// Published m1 values as in the rigs' READMEs; gains at the kp that the MJCF's nominal stands for (400 and 16).
const std::vector<ServoCase>& Cases() {
  static const std::vector<ServoCase> cases = {
      {"xl330", 0.49, 0.1, 0.001643, 0.01049, 0.00697, 0.3232, 4.764, 1.1509, 1.0, 7.4},
      {"sts3032", 0.457, 0.1, 0.001013, 0.00159, 0.0054, 0.4934, 4.092, 2.3905, 0.97, 6.0}};
  return cases;
}

constexpr double kG = 9.81;

// The reference: symplectic Euler in small steps, with friction that either stops the joint within the step or opposes
// it in full.
class ServoReference {
 public:
  ServoReference(const ServoCase& c, double q0, double step_s) : c_(c), q_(q0), step_s_(step_s) {}

  // `target` and `supply` held over `duration_s`; limit = the duty limit.
  double Advance(double target, double supply, bool enabled, double limit, double duration_s) {
    const double inertia = c_.mass * c_.length * c_.length + c_.armature + 1e-10 + 1e-12;
    const int steps = static_cast<int>(std::lround(duration_s / step_s_));
    for (int s = 0; s < steps; ++s) {
      const double duty = std::fmin(std::fmax(c_.gain * (target - q_), -limit), limit);
      const double tau = enabled ? c_.kt * (duty * supply - c_.kt * v_) / c_.r : 0;
      const double free = v_ + step_s_ / inertia * (tau - c_.viscous * v_ - c_.mass * kG * c_.length * std::sin(q_));
      const double stop = step_s_ / inertia * c_.friction;
      v_ = std::abs(free) <= stop ? 0 : free - std::copysign(stop, free);
      q_ += step_s_ * v_;
    }
    return q_;
  }

 private:
  ServoCase c_;
  double q_, v_ = 0, step_s_;
};

// Where friction, duty clip or switch have a kink inside a step even RK4 is of first order in the step: this share of
// it.
constexpr double kTolerance_rad_per_s = 0.6;

TEST(ServoModelTest, MechanismFollowsTheEquationWithANativeActuator) {
  for (const auto& c : Cases()) {
    const double gain = c.gain * c.supply * c.kt / c.r;
    const ModelPtr m =
        LoadRig(c.rig, fmt::format("<general name=\"motor\" joint=\"joint\" gaintype=\"fixed\" gainprm=\"{}\" "
                                   "biastype=\"affine\" biasprm=\"0 {} {}\"/>",
                                   gain, -gain, -c.kt * c.kt / c.r));
    ASSERT_NE(m, nullptr);
    const double h = m->opt.timestep;
    const auto target = [&](int k) { return ChirpAndSteps(k * h, 0.3, 0.2, 2, 3); };
    const Motion motion =
        Drive(*m, {0.2}, static_cast<int>(std::lround(3 / h)), [&](int k) { return std::vector<double>{target(k)}; });
    ServoReference reference(c, 0.2, 1e-5);
    double largest = 0;
    for (std::size_t k = 0; k < motion.q.size(); ++k) {
      const double q = reference.Advance(target(static_cast<int>(k)), c.supply, true, 1e9, h);
      largest = std::fmax(largest, std::abs(q - motion.q[k][0]));
    }
    EXPECT_LT(largest, kTolerance_rad_per_s * h) << c.rig;
  }
}

// The largest difference of a run with a clipped start, a supply that drops and a motor that is switched off, at time
// step h.
double PluginDifference(const ServoCase& c, double h) {
  const ModelPtr m = LoadRig(c.rig);
  if (!m) return NAN;
  m->opt.timestep = h;
  m->dof_solref[1] = -1 / h;
  const int target = Actuator(*m, "motor"), supply = Actuator(*m, "motor.supply"),
            enable = Actuator(*m, "motor.enable");
  EXPECT_EQ(m->nu, 3);
  const auto command = [&](int k) {
    const double t = k * h;
    std::vector<double> u(3);
    u[target] = t < 1 ? 1.5 : ChirpAndSteps(t, 1.2, 0.2, 2, 3);
    u[supply] = t < 1.5 ? c.supply : 0.8 * c.supply;
    u[enable] = t < 2.2 ? 1 : 0;
    return u;
  };
  const Motion motion = Drive(*m, {0}, static_cast<int>(std::lround(3 / h)), command);
  ServoReference reference(c, 0, 2e-6);
  double largest = 0;
  for (std::size_t k = 0; k < motion.q.size(); ++k) {
    const auto u = command(static_cast<int>(k));
    const double q = reference.Advance(u[target], u[supply], u[enable] > 0.5, c.limit, h);
    largest = std::fmax(largest, std::abs(q - motion.q[k][0]));
  }
  return largest;
}

TEST(ServoModelTest, PluginClipsDutyFollowsSupplyAndSwitchesOff) {
  if (!HasMotorPlugin()) GTEST_SKIP() << "the plugin library has no gapscope.motor";
  for (const auto& c : Cases()) {
    constexpr double kStep_s = 0.002;
    const double coarse = PluginDifference(c, kStep_s), fine = PluginDifference(c, kStep_s / 2);
    EXPECT_LT(coarse, kTolerance_rad_per_s * kStep_s) << c.rig;
    EXPECT_LT(fine, kTolerance_rad_per_s * kStep_s / 2) << c.rig;
    EXPECT_LT(fine, 0.65 * coarse) << c.rig << ": does not converge to the equation";
  }
}

// experiment.yaml expresses the published q_offset, gravity at q + offset, as a tilt of gravity.
TEST(ServoModelTest, TiltedGravityActsAtTheOffsetAngle) {
  for (const auto& c : Cases()) {
    const ModelPtr m = LoadRig(c.rig, "<motor name=\"motor\" joint=\"joint\"/>");
    ASSERT_NE(m, nullptr);
    constexpr double kOffset_rad = -0.1258;
    m->opt.gravity[0] = -kG * std::sin(kOffset_rad);
    m->opt.gravity[2] = -kG * std::cos(kOffset_rad);
    DataPtr d(mj_makeData(m.get()));
    for (double q = -1.5; q <= 1.5; q += 0.25) {
      d->qpos[0] = q;
      mj_forward(m.get(), d.get());
      // The inertial stub of the arm, a milligram at the axis, has no moment.
      EXPECT_NEAR(d->qfrc_bias[0], c.mass * kG * c.length * std::sin(q + kOffset_rad), 1e-9) << c.rig;
    }
  }
}

// A joint held below its dry friction stays where it is: solreffriction and solimpfriction are in the MJCF.
TEST(ServoModelTest, HeldBelowFrictionItDoesNotCreep) {
  for (const auto& c : Cases()) {
    const ModelPtr m = LoadRig(c.rig, "<motor name=\"motor\" joint=\"joint\"/>");
    ASSERT_NE(m, nullptr);
    DataPtr d(mj_makeData(m.get()));
    d->ctrl[0] = 0.8 * c.friction;
    for (int k = 0; k < 500; ++k) mj_step(m.get(), d.get());
    EXPECT_LT(std::abs(d->qvel[0]), 1e-4) << c.rig;
  }
}

}  // namespace
}  // namespace gapscope::testing
