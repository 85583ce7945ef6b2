// Each effect acts in the physically right direction and, where there is one, by the closed form: one hinge of 0.02 kg
// m^2 that a torque drives.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr double kInertia = 0.02;
constexpr const char* kMotor = "<motor name=\"motor\" joint=\"hinge\"/>";
constexpr const char* kServo = "<position name=\"motor\" joint=\"hinge\" kp=\"2\" kv=\"0.1\"/>";

class DirectionTest : public ::testing::Test {
 protected:
  // Sets the rig up with one effect (none: the base). `attributes` go to the joint.
  void Build(const std::string& use, const std::string& actuator = kMotor, const std::string& attributes = "") {
    const std::string mjcf =
        "<mujoco><compiler angle=\"radian\"/><option timestep=\"0.001\" integrator=\"RK4\" gravity=\"0 0 0\"><flag "
        "contact=\"disable\"/></option><worldbody><body name=\"disc\">"
        "<joint name=\"hinge\" axis=\"0 0 1\" " +
        attributes +
        "/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.015 0.015 0.02\"/></body></worldbody><actuator>" +
        actuator + "</actuator></mujoco>";
    experiment_ =
        MakeExperiment(scratch_, mjcf,
                       "commands:\n  - {actuator: motor, column: u, unit: N m}\nmeasured:\n  - {signal: q, column: q, "
                       "joint: hinge, unit: rad}\n  - {signal: w, column: w, kind: velocity, joint: hinge}\n");
    model_ = MakeModel(experiment_);
    use_ = use;
    if (use.empty()) return;
    const auto uses = ParseEffects({use}, *model_->rig());
    ASSERT_TRUE(uses.ok()) << uses.error().Text();
    use_ = uses.value()[0].Text();
    const Scales scales{.torque_n_m = 1,
                        .angle_rad = 1,
                        .speed_rad_per_s = 10,
                        .sample_s = 0.002,
                        .command = 1,
                        .inertia_kg_m2 = kInertia};
    model_ = MakeModel(experiment_, uses.value(), {{"hinge", scales}, {"motor", scales}});
  }
  // Runs 0.5 s under command(t) from (q, w); parameters by key. Fills q_, w_.
  void Run(const std::function<double(double)>& command, double q = 0, double w = 0,
           const std::map<std::string, double>& keys = {}, double max_step_s = 0) {
    const Recording recording = MakeRecording(experiment_, 251, 0.002, [&](int, double t) { return command(t); });
    InitialState start = AtRest(*model_);
    std::fill(start.qpos.begin(), start.qpos.end(), q);
    std::fill(start.qvel.begin(), start.qvel.end(), w);
    std::map<std::string, double> set;
    for (const auto& [key, value] : keys) set[use_ + "." + key] = value;
    const auto predicted = Predict(*model_, recording, set, &start, max_step_s);
    q_ = predicted[0], w_ = predicted[1], t_ = recording.time_s;
  }
  static double Zero(double) { return 0; }

  Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> model_;
  std::string use_;
  std::vector<double> q_, w_, t_;
};

TEST_F(DirectionTest, CoulombFrictionStopsACoastingJointAndHoldsIt) {
  Build("coulomb_friction");
  Run(Zero, 0, 2, {{"friction_n_m", 0.1}});
  // Deceleration 5 rad/s^2: at rest after 0.4 s and 0.4 rad.
  EXPECT_NEAR(w_[100], 2 - 5 * 0.2, 2e-3);
  EXPECT_NEAR(q_.back(), 0.4, 2e-3);
  EXPECT_NEAR(w_.back(), 0, 1e-4);
  Run([](double) { return 0.09; }, 0, 0, {{"friction_n_m", 0.1}});
  EXPECT_LT(std::abs(q_.back()), 1e-4);
  Run([](double) { return 0.15; }, 0, 0, {{"friction_n_m", 0.1}});
  EXPECT_NEAR(w_.back(), 2.5 * 0.5, 2e-3);
}

TEST_F(DirectionTest, StribeckFrictionHoldsMoreThanItBrakes) {
  Build("stribeck_friction");
  const std::map<std::string, double> keys = {
      {"friction_n_m", 0.05}, {"breakaway_n_m", 0.15}, {"stribeck_speed_rad_per_s", 0.05}};
  Run([](double) { return 0.14; }, 0, 0, keys);
  EXPECT_LT(std::abs(q_.back()), 1e-4);
  Run([](double) { return 0.14; }, 0, 1, keys);
  EXPECT_NEAR(w_.back(), 1 + (0.14 - 0.05) / kInertia * 0.5, 5e-3);
}

TEST_F(DirectionTest, LoadFrictionTakesAShareOfTheTorque) {
  Build("load_friction");
  Run([](double) { return 0.2; }, 0, 0.1, {{"coefficient", 0.25}});
  EXPECT_NEAR(w_.back(), 0.1 + 0.75 * 0.2 / kInertia * 0.5, 0.02 * w_.back());
  Run(Zero, 0, 1, {{"coefficient", 0.25}});
  EXPECT_NEAR(w_.back(), 1, 1e-3);
}

TEST_F(DirectionTest, DirectionAsymmetryOfFrictionActsInItsDirection) {
  Build("direction_asymmetry@hinge");
  const std::map<std::string, double> keys = {{"friction_positive_n_m", 0.02}, {"friction_negative_n_m", 0.06}};
  Run(Zero, 0, 2, keys);
  EXPECT_NEAR(w_[100], 2 - 0.2 * 0.02 / kInertia, 2e-3);
  Run(Zero, 0, -2, keys);
  EXPECT_NEAR(w_[100], -2 + 0.2 * 0.06 / kInertia, 2e-3);
}

TEST_F(DirectionTest, QuadraticDragBrakesByTheSquareOfSpeed) {
  Build("quadratic_drag");
  Run(Zero, 0, 10, {{"drag_n_m_s2_per_rad2", 0.004}});
  // w' = -c w^2: w = w0 / (1 + c w0 t).
  EXPECT_NEAR(w_.back(), 10 / (1 + 0.2 * 10 * 0.5), 1e-3);
  Run(Zero, 0, -10, {{"drag_n_m_s2_per_rad2", 0.004}});
  EXPECT_NEAR(w_.back(), -5, 1e-3);
}

TEST_F(DirectionTest, ACableSpringPullsToItsRestAngle) {
  Build("cable_spring");
  Run(Zero, 0, 0, {{"stiffness_n_m_per_rad", 0.5}, {"rest_rad", 0.3}});
  const double omega = std::sqrt(0.5 / kInertia);
  for (std::size_t k = 0; k < t_.size(); k += 25) EXPECT_NEAR(q_[k], 0.3 * (1 - std::cos(omega * t_[k])), 1e-6);
}

// Duffing's equation about the rest: MuJoCo's own spring, and the plugin beside a cubic that the joint has already.
TEST_F(DirectionTest, ACubicCableStiffensAwayFromItsRest) {
  constexpr double kRest = 0.3, kAway = 0.6, kCubic = 2;
  for (const bool beside : {false, true}) {
    Build("cable_spring", kMotor, beside ? "stiffness=\"0 0 1.5\" springref=\"0.3\"" : "");
    for (const double stiffness : {0.5, 0.0}) {
      Run(Zero, kRest - kAway, 0,
          {{"stiffness_n_m_per_rad", stiffness}, {"rest_rad", kRest}, {"stiffness_cubic_n_m_per_rad3", kCubic}});
      const double cubic = kCubic + (beside ? 1.5 : 0.0), steepest = stiffness + cubic * kAway * kAway,
                   quarter_s = std::comp_ellint_1(std::sqrt(0.5 * cubic * kAway * kAway / steepest)) /
                               std::sqrt(steepest / kInertia);
      const auto after = static_cast<std::size_t>(
          std::find_if(q_.begin(), q_.end(), [](double q) { return q >= kRest; }) - q_.begin());
      ASSERT_LT(after, q_.size());
      const double crossing_s =
          t_[after - 1] + (kRest - q_[after - 1]) / (q_[after] - q_[after - 1]) * (t_[after] - t_[after - 1]);
      EXPECT_NEAR(crossing_s, quarter_s, 2e-5) << beside << stiffness;
    }
  }
}

TEST_F(DirectionTest, ATorqueBiasPushesAndAGravityOffsetPullsDown) {
  Build("torque_bias");
  Run(Zero, 0, 0, {{"torque_n_m", 0.04}});
  EXPECT_NEAR(w_.back(), 1, 1e-6);
  Build("gravity_offset");
  Run(Zero, 0.4, 0, {{"torque_n_m", 0.5}, {"rest_rad", 0.39}});
  const double omega = std::sqrt(0.5 / kInertia);
  for (std::size_t k = 0; k < t_.size(); k += 25) EXPECT_NEAR(q_[k], 0.39 + 0.01 * std::cos(omega * t_[k]), 1e-5);
}

TEST_F(DirectionTest, CoggingRepeatsOverTheTurn) {
  Build("cogging");
  Run(Zero, 0, 1e-3, {{"amplitude_n_m", 0.1}, {"periods_per_rev", 12}});
  // J q'' = A sin(P q): near 0, where the torque pushes away, it grows as sinh; all along it keeps J w^2 / 2 + A cos(P
  // q) / P.
  const double rate = std::sqrt(0.1 * 12 / kInertia);
  EXPECT_NEAR(q_[125], 1e-3 / rate * std::sinh(rate * t_[125]), 1e-7);
  for (std::size_t k = 0; k < t_.size(); k += 25) {
    const double energy = 0.5 * kInertia * w_[k] * w_[k] + 0.1 / 12 * std::cos(12 * q_[k]);
    EXPECT_NEAR(energy, 0.5 * kInertia * 1e-6 + 0.1 / 12, 1e-10) << t_[k];
  }
  Run(Zero, 2 * std::numbers::pi / 12, 1e-3, {{"amplitude_n_m", 0.1}, {"periods_per_rev", 12}});
  const std::vector<double> shifted = q_;
  Run(Zero, 0, 1e-3, {{"amplitude_n_m", 0.1}, {"periods_per_rev", 12}});
  EXPECT_NEAR(shifted.back() - 2 * std::numbers::pi / 12, q_.back(), 1e-9);
}

TEST_F(DirectionTest, SpringHardeningRaisesTheFrequency) {
  Build("spring_hardening", kMotor, "stiffness=\"0.5\"");
  // Duffing's equation J q'' = -k q - c q^3 from rest at a: q = a cn(W t | m), W^2 = (k + c a^2) / J,
  // m = c a^2 / 2 (k + c a^2); zero after a quarter period K(m) / W.
  constexpr double kStiffness = 0.5, kStart = 0.5;
  for (const double cubic : {0.0, 2.0}) {
    Run(Zero, kStart, 0, {{"cubic_n_m_per_rad3", cubic}});
    const double total = kStiffness + cubic * kStart * kStart, m = 0.5 * cubic * kStart * kStart / total;
    const double quarter_s = std::comp_ellint_1(std::sqrt(m)) / std::sqrt(total / kInertia);
    const auto after =
        static_cast<std::size_t>(std::find_if(q_.begin(), q_.end(), [](double q) { return q < 0; }) - q_.begin());
    ASSERT_GT(after, 0u);
    ASSERT_LT(after, q_.size());
    // Where it crosses zero it hardly accelerates: a straight line between two rows.
    const double crossing_s = t_[after] + (t_[after - 1] - t_[after]) * q_[after] / (q_[after] - q_[after - 1]);
    EXPECT_NEAR(crossing_s, quarter_s, 1e-6) << cubic;
  }
}

TEST_F(DirectionTest, LimitsCapTheTorque) {
  Build("torque_limit");
  Run([](double t) { return t < 0.25 ? 1.0 : -1.0; }, 0, 0, {{"limit_n_m", 0.3}});
  EXPECT_NEAR(w_[125], 0.3 / kInertia * 0.25, 1e-6);
  EXPECT_NEAR(w_.back(), 0, 1e-6);
  Build("torque_speed_curve");
  Run([](double) { return 1.0; }, 0, 0, {{"power_w", 2}});
  // Full torque to 2 rad/s, then constant power: the energy grows by 2 W.
  const double start_s = 2 * kInertia, energy = 0.5 * kInertia * 4 + 2 * (0.5 - start_s);
  EXPECT_NEAR(w_.back(), std::sqrt(2 * energy / kInertia), 0.05);
  Build("supply_sag");
  Run([](double t) { return t < 0.1 ? 0.0 : 1.0; }, 0, 0,
      {{"time_constant_s", 0.05}, {"sag_fraction", 0.5}, {"limit_n_m", 0.5}});
  // Full at first; in the end the ceiling has sagged by half of its own load: T = 0.5 (1 - 0.5 T / 0.5).
  EXPECT_NEAR((w_[52] - w_[50]) / 0.004 * kInertia, 0.5, 0.02);
  EXPECT_NEAR((w_[250] - w_[240]) / 0.02 * kInertia, 1.0 / 3, 1e-3);
}

TEST_F(DirectionTest, DroopAsymmetryAndDeadZoneTakeTorqueAway) {
  Build("torque_constant_droop");
  Run([](double) { return 1.0; }, 0, 0, {{"loss_at_peak", 0.3}});
  EXPECT_NEAR(w_.back(), 0.7 / kInertia * 0.5, 1e-6);
  Run([](double) { return 0.1; }, 0, 0, {{"loss_at_peak", 0.3}});
  EXPECT_GT(w_.back(), 0.9 * 0.1 / kInertia * 0.5);
  Build("direction_asymmetry@motor");
  Run([](double) { return 0.5; }, 0, 0, {{"asymmetry", 0.2}});
  const double up = w_.back();
  Run([](double) { return -0.5; }, 0, 0, {{"asymmetry", 0.2}});
  EXPECT_NEAR(up / -w_.back(), 1.2 / 0.8, 1e-6);
  Build("dead_zone");
  Run([](double) { return 0.09; }, 0, 0, {{"half_width_n_m", 0.1}});
  EXPECT_EQ(q_.back(), 0);
  Run([](double) { return -0.3; }, 0, 0, {{"half_width_n_m", 0.1}});
  EXPECT_LT(w_.back(), -0.15 / kInertia * 0.5);
}

TEST_F(DirectionTest, LagAndDelaysAreLate) {
  Build("actuator_lag");
  Run([](double) { return 0.1; }, 0, 0, {{"time_constant_s", 0.05}});
  // w = T/J (t - tau (1 - exp(-t / tau))): before a log that begins at rest nothing was asked of the drive.
  const double lagged = w_.back();
  Run([](double t) { return t < 0.1 ? 0.0 : 0.1; }, 0, 0, {{"time_constant_s", 0.05}});
  EXPECT_NEAR(w_.back(), 0.1 / kInertia * (0.4 - 0.05 * (1 - std::exp(-0.4 / 0.05))), 2e-3);
  EXPECT_NEAR(lagged, 0.1 / kInertia * (0.5 - 0.05 * (1 - std::exp(-0.5 / 0.05))), 2e-3);
  Build("command_delay");
  Run([](double t) { return t < 0.1 ? 0.0 : 0.1; }, 0, 0, {{"delay_s", 0.03}});
  EXPECT_NEAR(w_.back(), 0.1 / kInertia * 0.37, 1e-9);
  // In a servo's own loop a late torque undamps.
  Build("torque_delay", kServo);
  Run([](double) { return 0.5; });
  const double peak = *std::max_element(q_.begin(), q_.end());
  Run([](double) { return 0.5; }, 0, 0, {{"delay_s", 0.02}});
  EXPECT_GT(*std::max_element(q_.begin(), q_.end()), peak + 0.02);
  Build("sensor_delay@q");
  Run(Zero, 0, 2, {{"delay_s", 0.01}});
  EXPECT_NEAR(q_.back(), 2 * (0.5 - 0.01), 1e-12);
  EXPECT_NEAR(w_.back(), 2, 1e-12);
}

TEST_F(DirectionTest, ABacklashLosesTheMotorAndASpringGivesWay) {
  Build("backlash");
  // The load coasts inside the gap while the motor turns back.
  Run([](double t) { return t < 0.1 ? 0.1 : -0.1; }, 0, 0, {{"gap_rad", 0.02}, {"motor_share", 0.5}}, 2e-4);
  const std::vector<double> gap = q_;
  Build("");
  Run([](double t) { return t < 0.1 ? 0.1 : -0.1; });
  EXPECT_LT(gap[20], q_[20]);  // first the gap is crossed, without the load
  EXPECT_GT(LargestDifference(gap, q_), 0.005);
  EXPECT_LT(LargestDifference(gap, q_), 0.08);
  Build("joint_compliance");
  Run([](double) { return 0.1; }, 0, 0, {{"stiffness_n_m_per_rad", 2}, {"motor_share", 0.5}, {"damping_ratio", 0.05}},
      2e-4);
  // On average the whole inertia accelerates; the load rings about it at sqrt(k / reduced inertia).
  EXPECT_NEAR(w_.back(), 0.1 / kInertia * 0.5, 0.25);
  EXPECT_LT(q_[5], 0.2 * 0.5 * 0.1 / kInertia * t_[5] * t_[5]);
}

}  // namespace
}  // namespace gapscope::testing
