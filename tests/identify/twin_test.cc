// Recovery on logs of the independent twin plants (tests/twin): noise, offsets, encoder counts, dropped rows,
// presliding.
#include <sys/wait.h>

#include "tests/identify/bench.h"

namespace gapscope {
namespace {

using testing::Bench;
using testing::ExpectRecovered;
using testing::LoadBench;

class TwinTest : public ::testing::Test {
 protected:
  Bench Twin(const std::string& rig, const std::string& arguments, int logs) {
    const std::string out = scratch_.Path("case" + std::to_string(count_++));
    const int raw = std::system(
        (std::string("'") + GAPSCOPE_TWIN + "' --rig " + rig + " --nominal --out '" + out + "' " + arguments).c_str());
    EXPECT_TRUE(WIFEXITED(raw) && WEXITSTATUS(raw) == 0) << arguments;
    std::vector<std::string> files;
    for (int i = 0; i < logs; ++i) files.push_back(out + "/log_" + std::to_string(i) + ".csv");
    return LoadBench(rig, files);
  }
  testing::Scratch scratch_;
  int count_ = 0;
};

// The document's experiment: gains are wrong without the delay and very accurate with it.
TEST_F(TwinTest, PdNeedsTheDelay) {
  for (const double delay : {0.004, 0.005, 0.0087}) {
    const Bench bench = Twin(
        "joint", "--seed 3 --excitation chirp --duration 20 --set torque_delay.delay_s=" + std::to_string(delay), 1);
    const auto result = IdentifyPd(bench.input(), {});
    ASSERT_TRUE(result.ok()) << result.error().Text();
    EXPECT_NEAR(result.value().Find("delay")->value, delay, 1e-4);
    // The torque column's own noise is 0.2 N m; both gains to half a percent.
    EXPECT_NEAR(result.value().Find("kp")->value, 157.1451, 0.005 * 157.1451);
    EXPECT_NEAR(result.value().Find("kd")->value, 7.0729, 0.005 * 7.0729);
    EXPECT_GT(result.value().r2, 0.999);
    EXPECT_GT(std::abs(result.value().Find("kd_without_delay")->value - 7.0729), 0.03 * 7.0729);
    EXPECT_LT(result.value().Find("r2_without_delay")->value, result.value().r2);
  }
}

TEST_F(TwinTest, PdIntervalsHoldTheTruth) {
  int held = 0, total = 0;
  for (int seed = 1; seed <= 8; ++seed) {
    const Bench bench =
        Twin("joint",
             "--excitation multisine --duration 12 --set torque_delay.delay_s=0.004 --seed " + std::to_string(seed), 1);
    const auto result = IdentifyPd(bench.input(), {});
    ASSERT_TRUE(result.ok()) << result.error().Text();
    for (const auto& [name, truth, least] :
         {std::tuple{"kp", 157.1451, 0.3}, std::tuple{"kd", 7.0729, 0.02}, std::tuple{"delay", 0.004, 1e-5}}) {
      const Estimate* e = result.value().Find(name);
      // The twin integrates at 0.05 ms and its torque is logged in steps of 0.01: nothing is known better than `least`.
      held += e->low - least <= truth && truth <= e->high + least ? 1 : 0;
      ++total;
    }
  }
  EXPECT_GE(held, total - 3) << "of " << total;
}

TEST_F(TwinTest, InertiaOfJointAndArm) {
  const auto joint = IdentifyInertia(Twin("joint", "--seed 4 --excitation chirp --duration 15", 1).input(), {});
  ASSERT_TRUE(joint.ok()) << joint.error().Text();
  EXPECT_NEAR(joint.value().Find("inertia")->value, 0.159221308, 0.01 * 0.159221308);
  // Rotor, hub, and a rod about its end; the pendulum's reaction is taken out by the model.
  const double arm = 4.6e-6 + 0.095 * 0.085 * 0.085 / 3;
  const auto qube = IdentifyInertia(
      Twin("qube",
           "--seed 4 --excitation triangle --low-hz 0.2 --duration 20 --set coulomb_friction@arm.friction_n_m=0.0006",
           1)
          .input(),
      {});
  ASSERT_TRUE(qube.ok()) << qube.error().Text();
  EXPECT_NEAR(qube.value().Find("inertia")->value, arm, 0.05 * arm);
}

TEST_F(TwinTest, FrictionOfASlowSweep) {
  for (const int seed : {1, 2}) {
    const Bench bench =
        Twin("qube",
             "--excitation triangle --low-hz 0.2 --duration 30 --set coulomb_friction@arm.friction_n_m=0.0006 --seed " +
                 std::to_string(seed),
             1);
    const auto result = IdentifyFriction(bench.input(), {.cutoff_hz = 6});
    ASSERT_TRUE(result.ok()) << result.error().Text();
    EXPECT_NEAR(result.value().Find("coulomb")->value, 0.0006, 0.04 * 0.0006);
    EXPECT_NEAR(result.value().Find("viscous")->value, 1.5e-4, 0.15 * 1.5e-4);
    EXPECT_EQ(result.value().Find("stribeck_rise"), nullptr);
    EXPECT_GE(result.value().tables.front().rows.size(), 6u);
  }
}

TEST_F(TwinTest, CableSpringAndRestAngle) {
  const Bench bench = Twin("qube",
                           "--seed 5 --excitation triangle --excitation triangle --low-hz 0.2 --duration 20 --set "
                           "cable_spring@arm.stiffness_n_m_per_rad=0.0012 --set cable_spring@arm.rest_rad=-0.4 "
                           "--set cable_spring@arm.hysteresis_rad=0 --set coulomb_friction@arm.friction_n_m=0.0006",
                           2);
  const auto result = IdentifyCable(bench.input(), {.cutoff_hz = 6});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  ExpectRecovered(result.value(), "stiffness", 0.0012, 0.1);
  // The encoder's zero is within 10 mrad, and nobody can tell it from the rest angle.
  EXPECT_NEAR(result.value().Find("rest")->value, -0.4, 0.015);
  ASSERT_NE(result.value().Find("stiffness_spread"), nullptr);
  EXPECT_LT(result.value().Find("stiffness_spread")->value, 1e-4);
  EXPECT_EQ(result.value().tables.front().rows.size(), 2u);
}

TEST_F(TwinTest, ResonanceOfTheFlexibleJoint) {
  const Bench bench = Twin("flexjoint", "--seed 6 --excitation square --low-hz 1.587 --duration 10", 1);
  const auto result = IdentifyResonance(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_NEAR(result.value().Find("clamped_frequency")->value, 3.84568, 0.01);
  EXPECT_NEAR(result.value().Find("stiffness")->value, 1.8426, 0.01);
  EXPECT_NEAR(result.value().Find("damping")->value, 0.001, 1e-4);
  // The square wave drives the base as well: the peak alone is another frequency, and the result says so.
  bool said = false;
  for (const auto& remark : result.value().remarks)
    said = said || remark.find("not the clamped frequency") != std::string::npos;
  EXPECT_EQ(said, std::abs(result.value().Find("peak_frequency")->value - 3.84568) > 0.385);
}

TEST_F(TwinTest, StateSpaceOfTheFlexibleJoint) {
  // Everything but nominal: R, K and the base's damping moved, so that the fit has to leave the nominal values.
  const Bench bench = Twin("flexjoint",
                           "--seed 7 --excitation square --excitation square --excitation multisine --low-hz 1.587 "
                           "--duration 10 --set motor.resistance=3.0 --set link.stiffness=2.1 --set base.damping=0.022",
                           3);
  const auto result = IdentifyStateSpace(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  const double gain = 0.621 * 0.00768 * 70 / 3.0, a22 = -(gain * 70 * 0.00768 + 0.022) / 0.002087;
  // To half a percent, and within the interval, which holds what noise in the regressors can take off.
  for (const auto& [name, truth] : {std::pair{"A22", a22},
                                    {"A23", 2.1 / 0.002087},
                                    {"A43", -2.1 * (1 / 0.002087 + 1 / 0.003156)},
                                    {"B2", gain / 0.002087}}) {
    EXPECT_NEAR(result.value().Find(name)->value, truth, 0.005 * std::abs(truth)) << name;
    EXPECT_LT(result.value().Find(name)->low, truth) << name;
    EXPECT_GT(result.value().Find(name)->high, truth) << name;
  }
  EXPECT_NEAR(result.value().Find("base_over_link_inertia")->value, 0.002087 / 0.003156, 0.02);
  // On what it did not see: better than nominal, and about as good as the unconstrained fit.
  const double nominal = result.value().Find("error_nominal")->value,
               constrained = result.value().Find("error_constrained")->value,
               free = result.value().Find("error_unconstrained")->value;
  EXPECT_LT(constrained, 0.6 * nominal);
  EXPECT_LT(constrained, 1.1 * free);
  // Bounds bind: 5 % about nominal does not hold the truth, and the result says which.
  const auto tight = IdentifyStateSpace(bench.input(), {.bounds_share = 0.05});
  ASSERT_TRUE(tight.ok());
  EXPECT_NE(tight.value().remarks.front().find("at a bound: "), std::string::npos);
  EXPECT_NE(tight.value().remarks.front().find("A23"), std::string::npos);
  EXPECT_NEAR(tight.value().Find("A23")->value, 1.05 * 1.8426 / 0.002087, 1);
}

TEST_F(TwinTest, RefusesRigsThatDoNotFit) {
  const Bench joint = Twin("joint", "--seed 8 --excitation chirp --duration 5", 1),
              qube = Twin("qube", "--seed 8 --excitation chirp --duration 5", 1);
  EXPECT_FALSE(IdentifyStateSpace(joint.input(), {}).ok());
  EXPECT_FALSE(IdentifyResonance(qube.input(), {}).ok());
  EXPECT_FALSE(IdentifyPd(qube.input(), {}).ok());
  EXPECT_FALSE(IdentifyResistance(joint.input(), {}).ok());
  EXPECT_FALSE(IdentifyInertia(qube.input(), {.joint = "wrist"}).ok());
  EXPECT_FALSE(IdentifyTnCurve(qube.input(), {}).ok());
}

}  // namespace
}  // namespace gapscope
