// The inertia that a drive sees, and a joint split in a motor and a load side.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "src/model/parameter_writer.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

// Two arms: the first one tilted inertial frame, off its hinge; a second body rides on it.
constexpr const char* kSplitRobot = R"(<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.0005" gravity="0 0 0" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body name="arm">
      <joint name="hinge" axis="0 0 1" pos="0.05 0 0" armature="0.004" damping="0.02"/>
      <inertial pos="0.35 0.4 0" mass="2" diaginertia="0.03 0.02 0.01" euler="0 1.5707963267948966 0"/>
      <body name="tip" pos="0.5 0 0"><joint name="slide" type="slide" axis="1 0 0" damping="1" stiffness="40"/>
        <inertial pos="0 0 0" mass="0.3" diaginertia="0.001 0.001 0.001"/></body>
    </body>
  </worldbody>
  <actuator><motor name="motor" joint="hinge"/><motor name="pusher" joint="slide"/></actuator>
</mujoco>)";
constexpr const char* kSplitYaml = R"(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
  - {signal: tau, column: tau, kind: torque, actuator: motor, optional: true}
parameters:
  arm.mass: {unit: kg, nominal: 2, bounds: [1, 3]}
set:
  body/arm/mass: arm.mass
)";

TEST(DrivenInertiaTest, HandNumbers) {
  const Scratch scratch;
  const auto model = MakeModel(MakeExperiment(scratch, kSplitRobot, kSplitYaml));
  // A quarter turn about y carries the frame's x to -z: about z stands the first diagonal, 0.03. Arm (0.3, 0.4) from
  // the hinge: 2 * 0.25.
  EXPECT_NEAR(DrivenInertia(model->compiled(), 0), 0.004 + 0.03 + 2 * 0.25, 1e-12);
  const auto joint = MakeModel(ShippedExperiment("joint"));
  EXPECT_NEAR(DrivenInertia(joint->compiled(), 0), 0.159221308, 1e-12);
  // Qube: rotor and hub on the axis, the arm a rod about its end; the pendulum it carries does not count.
  const auto qube = MakeModel(ShippedExperiment("qube"));
  EXPECT_NEAR(DrivenInertia(qube->compiled(), 0), 4.6e-6 + 0.095 * 0.085 * 0.085 / 3, 1e-10);
}

class SplitTest : public ::testing::TestWithParam<const char*> {};

TEST_P(SplitTest, ConservesTheInertiaWhateverTheShareAndTheMass) {
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(scratch, kSplitRobot, kSplitYaml);
  const std::string use = std::string(GetParam()) + "@hinge";
  const auto model = MakeModel(experiment, {{GetParam(), "hinge"}});
  ASSERT_NE(model, nullptr);
  const mjModel& m = model->compiled();
  const int load = mj_name2id(&m, mjOBJ_JOINT, "hinge"), motor = mj_name2id(&m, mjOBJ_JOINT, "hinge.motor");
  ASSERT_GE(motor, 0);
  const ModelPtr copy(mj_copyModel(nullptr, &m));
  const DataPtr data(mj_makeData(copy.get()));
  ParameterWriter writer(*model, copy.get(), data.get());
  for (const double share : {0.15, 0.5, 0.85}) {
    for (const double mass : {1.0, 2.0, 3.0}) {
      ASSERT_TRUE(writer.Write(ValuesWith(*model, {{use + ".motor_share", share}, {"arm.mass", mass}}), {}));
      const double whole = 0.004 + 0.03 + mass * 0.25;
      // The motor side's body holds 1e-9 itself.
      EXPECT_NEAR(DrivenInertia(*copy, motor), share * whole, 1e-8);
      EXPECT_NEAR(DrivenInertia(*copy, load), (1 - share) * whole, 1e-12);
      // Writing twice moves nothing twice.
      ASSERT_TRUE(writer.Write(ValuesWith(*model, {{use + ".motor_share", share}, {"arm.mass", mass}}), {}));
      EXPECT_NEAR(DrivenInertia(*copy, load) + DrivenInertia(*copy, motor), whole, 1e-8);
    }
  }
  // Both sides begin together, where the log says.
  const Recording recording = MakeRecording(experiment, 50, 0.002, [](int, double) { return 0.0; });
  Recording moved = recording;
  for (double& q : moved.measured[0].values) q = 0.4;
  const InitialState start = InitialStateAt(*model, moved, 0, model->Nominal());
  EXPECT_EQ(start.qpos[static_cast<std::size_t>(m.jnt_qposadr[load])], 0.4);
  EXPECT_EQ(start.qpos[static_cast<std::size_t>(m.jnt_qposadr[motor])], 0.4);
}

TEST_P(SplitTest, KeepsTheMomentumOfAPush) {
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(scratch,
                                               Replaced(Replaced(kSplitRobot, "damping=\"0.02\"", ""),
                                                        "<body name=\"tip\"", "<body name=\"tip\" childclass=\"main\""),
                                               kSplitYaml);
  const auto model =
      MakeModel(experiment, {{GetParam(), "hinge"}},
                {{"hinge", {.torque_n_m = 1, .angle_rad = 0.05, .speed_rad_per_s = 1, .inertia_kg_m2 = 0.534}}});
  ASSERT_NE(model, nullptr);
  const mjModel& m = model->compiled();
  const Recording recording = MakeRecording(experiment, 251, 0.002, [](int, double t) { return t < 0.1 ? 1.0 : 0.0; });
  Simulator simulator(*model, 0);
  ASSERT_TRUE(simulator.SetParameters(model->Nominal(), recording));
  std::vector<double> predicted(recording.rows() * recording.measured.size());
  ASSERT_EQ(simulator.Run(recording, {0, recording.rows()}, AtRest(*model), predicted).outcome, Outcome::kCompleted);
  // Angular momentum about the hinge: the push's impulse, 1 N m for 0.1 s (the massed slide moves along with the arm).
  mjtNum momentum = 0;
  const mjData& d = simulator.data();
  std::vector<mjtNum> product(static_cast<std::size_t>(m.nv));
  mj_mulM(&simulator.mujoco_model(), &d, product.data(), d.qvel);
  momentum = product[static_cast<std::size_t>(m.jnt_dofadr[mj_name2id(&m, mjOBJ_JOINT, "hinge")])] +
             product[static_cast<std::size_t>(m.jnt_dofadr[mj_name2id(&m, mjOBJ_JOINT, "hinge.motor")])];
  EXPECT_NEAR(momentum, 0.1, 0.002);
}

INSTANTIATE_TEST_SUITE_P(Effects, SplitTest, ::testing::Values("backlash", "joint_compliance"),
                         [](const auto& test) { return std::string(test.param); });

// One disc on an axle, split in two equal halves with a gap of 0.1 rad between them.
struct Disc {
  Disc() {
    experiment = MakeExperiment(
        scratch,
        R"(<mujoco><compiler angle="radian"/><option timestep="0.0002" gravity="0 0 0" integrator="RK4">
          <flag contact="disable"/></option>
<worldbody><body><joint name="hinge" axis="0 0 1"/><inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/>
  </body></worldbody>
<actuator><motor name="motor" joint="hinge"/></actuator></mujoco>)",
        "commands:\n  - {actuator: motor, column: u, unit: N m}\nmeasured:\n  - {signal: q, column: q, joint: hinge, "
        "unit: rad}\n");
    const Scales scales{.torque_n_m = 1, .angle_rad = 1, .speed_rad_per_s = 1, .inertia_kg_m2 = 0.02};
    model = MakeModel(experiment, {{"backlash", "hinge"}}, {{"hinge", scales}, {"motor", scales}});
  }
  std::vector<double> Values(double flank_damping_ratio) const {
    return ValuesWith(*model, {{"backlash@hinge.gap_rad", 0.1},
                               {"backlash@hinge.motor_share", 0.5},
                               {"backlash@hinge.flank_damping_ratio", flank_damping_ratio}});
  }
  Scratch scratch;
  Experiment experiment;
  std::shared_ptr<const Model> model;
};

// A blow through a linear spring and damper that only push: they part where the force is zero, w t = pi - atan2(2 z w,
// w^2 - z^2) with w = sqrt(1 - z^2), and exp(-z t) of the speed between them comes back (Schwager and Poeschel,
// Granular Matter 9 (2007), 465).
TEST(BacklashTest, FlanksGiveBackWhatTheirDampingLeaves) {
  const Disc disc;
  ASSERT_NE(disc.model, nullptr);
  const Recording recording = MakeRecording(disc.experiment, 161, 0.001, [](int, double) { return 0.0; });
  for (const double ratio : {0.2, 0.4, 0.7, 0.99}) {
    Simulator simulator(*disc.model, 0);
    ASSERT_TRUE(simulator.SetParameters(disc.Values(ratio), recording));
    InitialState start = AtRest(*disc.model);
    const mjModel& m = disc.model->compiled();
    start.qvel[static_cast<std::size_t>(m.jnt_dofadr[mj_name2id(&m, mjOBJ_JOINT, "hinge.motor")])] = 1;
    std::vector<double> predicted(recording.rows());
    // 0.05 rad to the flank, and 0.1 s later, far from the next one.
    ASSERT_EQ(simulator.Run(recording, {0, 111}, start, predicted).outcome, Outcome::kCompleted);
    const double load = (predicted[110] - predicted[90]) / 0.02, back = 2 * load - 1;
    const double w = std::sqrt(1 - ratio * ratio),
                 expected =
                     std::exp(-ratio / w * (std::numbers::pi - std::atan2(2 * ratio * w, w * w - ratio * ratio)));
    EXPECT_NEAR(back, expected, 0.03) << ratio;
  }
}

// Pushed all the time, the motor side stands on a flank: a window that begins in the middle of the log begins there,
// not in the middle of the gap.
TEST(BacklashTest, AWindowBeginsOnTheFlank) {
  const Disc disc;
  ASSERT_NE(disc.model, nullptr);
  constexpr double kAcceleration = 0.1 / 0.02;
  Recording recording = MakeRecording(disc.experiment, 401, 0.002, [](int, double) { return 0.1; });
  for (std::size_t row = 0; row < recording.rows(); ++row)
    recording.measured[0].values[row] = 0.5 * kAcceleration * recording.time_s[row] * recording.time_s[row];
  Simulator simulator(*disc.model, 0);
  const std::vector<double> values = disc.Values(0.5);
  ASSERT_TRUE(simulator.SetParameters(values, recording));
  std::vector<double> predicted(recording.rows());
  const Window window{250, 350};
  ASSERT_EQ(
      simulator.Run(recording, window, InitialStateAt(*disc.model, recording, window.begin, values), predicted).outcome,
      Outcome::kCompleted);
  for (std::size_t row = window.begin; row < window.end; ++row)
    EXPECT_NEAR(predicted[row - window.begin], recording.measured[0].values[row], 5e-4) << row;
}

}  // namespace
}  // namespace gapscope::testing
