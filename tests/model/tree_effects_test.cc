// Effects that a tree of joints feels as one: a payload against the two-link equations, a tilted mount against MuJoCo's
// own model of it, and where either is looked for.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "tests/model/synthetic.h"
#include "tests/model/two_links.h"

namespace gapscope::testing {
namespace {

constexpr double kUpper_m = 0.3, kGravity = 9.81;

// A double pendulum under a base that may be turned.
std::string Arm(const std::string& euler = "0 0 0") {
  return R"(<mujoco>
  <compiler angle="radian" eulerseq="xyz"/>
  <option timestep="0.002" integrator="RK4"><flag contact="disable"/></option>
  <worldbody><body name="base" euler=")" +
         euler + R"(">
    <body name="upper"><joint name="shoulder" axis="0 -1 0"/>
      <inertial pos="0 0 -0.15" mass="1" diaginertia="0.01 0.01 0.001"/>
      <body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="0 -1 0"/>
        <inertial pos="0.02 0 -0.1" mass="0.3" diaginertia="0.002 0.002 0.001"/></body></body></body></worldbody>
  <actuator><motor name="first" joint="shoulder"/><motor name="second" joint="elbow"/></actuator>
</mujoco>)";
}

bool Has(const std::vector<EffectUse>& uses, const EffectUse& use) {
  return std::find(uses.begin(), uses.end(), use) != uses.end();
}

struct Dynamics {
  double bias[2];     // N m
  double inertia[4];  // kg m^2
};

class TreeEffectsTest : public ::testing::Test {
 protected:
  explicit TreeEffectsTest(const std::string& mjcf = Arm(), const std::string& yaml = kTwoLinks)
      : experiment_(MakeExperiment(scratch_, mjcf, yaml)),
        base_(MakeModel(experiment_)),
        recording_(MakeRecording(experiment_, 10, 0.002, [](int, double) { return 0.0; })) {}

  // At rest at two angles.
  Dynamics At(double q1, double q2, const std::vector<EffectUse>& uses = {},
              const std::map<std::string, double>& set = {}) {
    const auto model = MakeModel(experiment_, uses, {});
    std::vector<double> values = model->Nominal();
    for (const auto& [name, value] : set) values[static_cast<std::size_t>(model->IndexOf(name))] = value;
    Simulator simulator(*model, 0);
    EXPECT_TRUE(simulator.SetParameters(values, recording_));
    mjData& d = simulator.data();
    d.qpos[0] = q1, d.qpos[1] = q2;
    d.qvel[0] = d.qvel[1] = 0;
    mj_forward(&simulator.mujoco_model(), &d);
    Dynamics at{.bias = {d.qfrc_bias[0], d.qfrc_bias[1]}, .inertia = {}};
    mj_fullM(&simulator.mujoco_model(), &d, at.inertia);
    return at;
  }

  Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> base_;
  Recording recording_;
};

TEST_F(TreeEffectsTest, APayloadIsAPointMassOfTheTwoLinkEquations) {
  const double m = 0.4, x = 0.05, z = -0.17, q1 = 0.6, q2 = -1.1, s = q1 + q2;
  const Dynamics without = At(q1, q2);
  const Dynamics with = At(
      q1, q2, {{"payload", "lower"}},
      {{"payload@lower.mass_kg", m}, {"payload@lower.x_m", x}, {"payload@lower.y_m", 0.03}, {"payload@lower.z_m", z}});
  const double jx2 = -x * std::sin(s) - z * std::cos(s), jz2 = x * std::cos(s) - z * std::sin(s);
  const double jx1 = kUpper_m * std::cos(q1) + jx2, jz1 = kUpper_m * std::sin(q1) + jz2;
  EXPECT_NEAR(with.bias[0] - without.bias[0], m * kGravity * jz1, 1e-12);
  EXPECT_NEAR(with.bias[1] - without.bias[1], m * kGravity * jz2, 1e-12);
  const double inertia[] = {m * (jx1 * jx1 + jz1 * jz1), m * (jx1 * jx2 + jz1 * jz2), m * (jx1 * jx2 + jz1 * jz2),
                            m * (jx2 * jx2 + jz2 * jz2)};
  for (int i = 0; i < 4; ++i) EXPECT_NEAR(with.inertia[i] - without.inertia[i], inertia[i], 1e-12) << i;
}

TEST_F(TreeEffectsTest, APayloadStartsAtTheBodysCentreOfMass) {
  const auto placed = PlacedParameters({"payload", "lower"}, *base_->rig(), {});
  ASSERT_EQ(placed.size(), 4u);
  EXPECT_EQ(placed[0].neutral, 0);
  EXPECT_DOUBLE_EQ(placed[0].high, 5 * 0.3);
  EXPECT_DOUBLE_EQ(placed[1].start, 0.02);
  EXPECT_DOUBLE_EQ(placed[3].start, -0.1);
  EXPECT_LT(placed[3].low, -0.2);
}

TEST_F(TreeEffectsTest, ATiltedMountIsMujocosModelOnATurnedBase) {
  const double x = 0.21, y = -0.33;
  Scratch scratch;
  const auto turned = MakeModel(MakeExperiment(scratch, Arm("0.21 -0.33 0"), kTwoLinks));
  for (const auto& [q1, q2] : {std::pair{0.6, -1.1}, std::pair{-2.0, 0.4}}) {
    const DataPtr d(mj_makeData(&turned->compiled()));
    d->qpos[0] = q1, d->qpos[1] = q2;
    mj_forward(&turned->compiled(), d.get());
    const Dynamics tilted =
        At(q1, q2, {{"mount_tilt", "model"}}, {{"mount_tilt@model.x_rad", x}, {"mount_tilt@model.y_rad", y}});
    EXPECT_NEAR(tilted.bias[0], d->qfrc_bias[0], 1e-12);
    EXPECT_NEAR(tilted.bias[1], d->qfrc_bias[1], 1e-12);
    EXPECT_GT(std::abs(tilted.bias[0] - At(q1, q2).bias[0]), 0.1);
  }
}

TEST_F(TreeEffectsTest, AreLookedForWhereTwoJointsFeelThem) {
  const std::vector<EffectUse> uses = AllUses(*base_->rig());
  EXPECT_TRUE(Has(uses, {"payload", "lower"}));
  EXPECT_FALSE(Has(uses, {"payload", "upper"}));  // gravity_offset@shoulder
  EXPECT_TRUE(Has(uses, {"mount_tilt", "model"}));
  // Asked for by name they can be anywhere that moves, and nowhere else.
  EXPECT_TRUE(ParseEffects({"payload@upper"}, *base_->rig()).ok());
  const auto fixed = ParseEffects({"payload@base"}, *base_->rig());
  ASSERT_FALSE(fixed.ok());
  EXPECT_NE(fixed.error().Text().find("allowed: upper, lower"), std::string::npos) << fixed.error().Text();
}

// Two effects on each place, so that expressions of several parameters are among them.
TEST(NamesTest, JointsDrivesAndSignalsMayHaveAnyName) {
  std::string mjcf = Arm(), yaml = kTwoLinks;
  for (std::string* text : {&mjcf, &yaml}) {
    for (const auto& [plain, odd] : {std::pair{"shoulder", "left hip-1"}, std::pair{"first", "hip (yaw)"},
                                     std::pair{"lower", "fore arm"}, std::pair{"signal: q", "signal: 'hip angle'"}}) {
      for (std::size_t at = text->find(plain); at != std::string::npos; at = text->find(plain, at + 1))
        text->replace(at, std::string(plain).size(), odd);
    }
  }
  Scratch scratch;
  const Experiment experiment = MakeExperiment(scratch, mjcf, yaml);
  const auto base = MakeModel(experiment);
  ASSERT_NE(base, nullptr);
  const std::vector<EffectUse> uses = AllUses(*base->rig());
  std::set<std::string> places;
  for (const EffectUse& use : uses) {
    places.insert(use.on);
    for (const EffectUse& other : {EffectUse{"torque_limit", "hip (yaw)"}, EffectUse{"torque_bias", "left hip-1"}}) {
      if (use.effect == other.effect) continue;
      const auto built = Model::Build(base->rig(), {use, other}, {});
      EXPECT_TRUE(built.ok()) << use.Text() << ": " << built.error().Text();
    }
  }
  for (const char* place : {"left hip-1", "hip (yaw)", "fore arm", "hip angle", "all", "model"})
    EXPECT_TRUE(places.contains(place)) << place;
}

TEST(EndStopTest, IsLookedForOnJointsWithARange) {
  std::string mjcf = Arm();
  const std::string joint = "<joint name=\"elbow\"";
  mjcf.replace(mjcf.find(joint), joint.size(), joint + " range=\"-1 2\" limited=\"false\"");
  Scratch scratch;
  const auto model = MakeModel(MakeExperiment(scratch, mjcf, kTwoLinks));
  const std::vector<EffectUse> uses = AllUses(*model->rig());
  EXPECT_TRUE(Has(uses, {"end_stop", "elbow"}));
  EXPECT_FALSE(Has(uses, {"end_stop", "shoulder"}));
  EXPECT_TRUE(ParseEffects({"end_stop@shoulder"}, *model->rig()).ok());
}

TEST(MountTiltTest, WhereTheExperimentSetsGravityItIsAParameter) {
  Scratch scratch;
  const std::string set = R"yaml(parameters:
  tilt: {unit: rad, nominal: 0, bounds: [-0.1, 0.1]}
set:
  option/gravity: ["9.81*sin(tilt)", "0", "-9.81*cos(tilt)"]
)yaml";
  const auto model = MakeModel(MakeExperiment(scratch, Arm(), kTwoLinks + set));
  EXPECT_FALSE(Has(AllUses(*model->rig()), {"mount_tilt", "model"}));
}

}  // namespace
}  // namespace gapscope::testing
