// The laws against MuJoCo's native actuators and closed forms; the memoryless stages after them.
#include <cmath>

#include "tests/plugins/motor_testing.h"

namespace gapscope::testing {
namespace {

constexpr double kRounding = 1e-12;

// Largest difference of qpos over a run of both models under the same commands.
double LargestDifference(const Rig& plugin, const Rig& native, int steps) {
  const ModelPtr m = plugin.Compile(), n = native.Compile();
  const DataPtr a(mj_makeData(m.get())), b(mj_makeData(n.get()));
  double largest = 0;
  for (int k = 0; k < steps; ++k) {
    for (int i = 0; i < m->nu; ++i) {
      a->ctrl[i] = std::sin(0.03 * k + i) * (i == 0 ? 1 : 0.2);
      if (i < n->nu) b->ctrl[i] = a->ctrl[i];
    }
    mj_step(m.get(), a.get());
    mj_step(n.get(), b.get());
    largest = std::max(largest, std::abs(a->qpos[0] - b->qpos[0]));
  }
  EXPECT_GT(std::abs(a->qpos[0]) + std::abs(a->qvel[0]), 1e-3) << "nothing moved";
  return largest;
}

TEST(MotorLawTest, PositionEqualsNativePosition) {
  const Rig plugin{.config = {{"law", "position"}, {"kp", "157"}, {"kd", "7"}}, .damping = 0.5};
  const Rig native{.damping = 0.5, .native = "<position joint='joint' kp='157' kv='7'/>"};
  EXPECT_LT(LargestDifference(plugin, native, 500), kRounding);
}

TEST(MotorLawTest, AffineEqualsNativeGeneralBitForBit) {
  for (const std::string integrator : {"Euler", "RK4"}) {
    Rig plugin{.config = {{"law", "affine"}, {"inputs", "target feedforward"}},
               .live = {{"gain", "157.1"}, {"bias0", "0.3"}, {"bias1", "-157.1"}, {"bias2", "-7.07"}},
               .actuators = 2,
               .damping = 0.5};
    Rig native{.damping = 0.5,
               .native =
                   "<general joint='joint' biastype='affine' gainprm='157.1' "
                   "biasprm='0.3 -157.1 -7.07'/><motor joint='joint'/>"};
    plugin.option = native.option = "timestep='0.002' integrator='" + integrator + "'";
    EXPECT_EQ(LargestDifference(plugin, native, 500), 0) << integrator;
  }
}

TEST(MotorLawTest, TorqueEqualsNativeMotorWithRanges) {
  const std::string ranges = "ctrllimited='true' ctrlrange='-0.5 0.4' forcelimited='true' forcerange='-0.9 0.7'";
  const Rig plugin{.config = {{"law", "torque"}, {"gain", "2"}}, .first = ranges};
  const Rig native{.native = "<general joint='joint' gainprm='2' " + ranges + "/>"};
  EXPECT_EQ(LargestDifference(plugin, native, 500), 0);
}

TEST(MotorLawTest, VoltageEqualsNativeDcMotor) {
  const Rig plugin{.config = {{"law", "voltage"}, {"kt", "0.5"}, {"ke", "0.5"}, {"resistance", "2"}}, .damping = 0.1};
  const Rig native{.damping = 0.1, .native = "<dcmotor joint='joint' motorconst='0.5' resistance='2'/>"};
  EXPECT_LT(LargestDifference(plugin, native, 500), kRounding);
}

struct Case {
  std::string name;
  Attributes config;
  std::vector<double> ctrl;  // one per input
  double q, qdot, torque;
};

class MotorStaticTest : public ::testing::TestWithParam<Case> {};

TEST_P(MotorStaticTest, TorqueIsTheFormula) {
  const Case& c = GetParam();
  // From <config> and as live numbers: the same.
  for (const bool live : {false, true}) {
    Rig rig{.actuators = static_cast<int>(c.ctrl.size())};
    for (const auto& [key, value] : c.config) {
      const bool structure = key == "law" || key == "inputs" || key == "dead_zone_on";
      (live && !structure ? rig.live : rig.config)[key] = value;
    }
    const ModelPtr m = rig.Compile();
    ASSERT_TRUE(m);
    const DataPtr d(mj_makeData(m.get()));
    EXPECT_NEAR(TorqueAt(m.get(), d.get(), c.q, c.qdot, c.ctrl), c.torque, kRounding) << c.name << " live " << live;
  }
}

const Attributes kTorqueLaw = {{"law", "torque"}};
const Attributes kGearFriction = {{"friction_slope_n_m_s_per_rad", "10"},
                                  {"friction_load_coefficient", "0.2"},
                                  {"friction_hump_n_m", "0.5"},
                                  {"friction_hump_speed_rad_per_s", "1"}};

Attributes Torque(Attributes more) {
  more["law"] = "torque";
  return more;
}

INSTANTIATE_TEST_SUITE_P(
    All, MotorStaticTest,
    ::testing::Values(
        Case{"position with velocity and feedforward",
             {{"law", "position"}, {"inputs", "target velocity feedforward"}, {"kp", "10"}, {"kd", "2"}},
             {0.5, 1.5, 0.25},
             0.1,
             1,
             10 * 0.4 + 2 * 0.5 + 0.25},
        Case{"inputs in another order",
             {{"law", "position"}, {"inputs", "feedforward target"}, {"kp", "10"}},
             {0.25, 0.5},
             0.1,
             1,
             4.25},
        Case{"enabled", {{"law", "torque"}, {"inputs", "torque enable"}}, {2, 1}, 0, 0, 2},
        Case{"off", {{"law", "torque"}, {"inputs", "torque enable"}}, {2, 0}, 0, 0, 0},
        Case{"off leaves no back-EMF",
             {{"law", "voltage"}, {"inputs", "voltage enable"}, {"kt", "1"}, {"ke", "1"}, {"resistance", "2"}},
             {0, 0},
             0,
             5,
             0},
        Case{"current at the joint", {{"law", "current"}, {"kt", "0.3338496"}}, {2}, 0, 0, 0.6676992},
        Case{"current through a gear", {{"law", "current"}, {"kt", "0.1"}, {"gear", "-3"}}, {2}, 0, 0, -0.6},
        Case{"separate kt and ke",
             {{"law", "voltage"}, {"kt", "0.00768"}, {"ke", "0.008"}, {"resistance", "2.6"}, {"gear", "70"}},
             {5},
             0,
             3,
             70 * 0.00768 * (5 - 0.008 * 70 * 3) / 2.6},
        Case{"voltage up to the supply",
             {{"law", "voltage"}, {"kt", "1"}, {"ke", "0"}, {"resistance", "2"}, {"supply_v", "3"}},
             {-5},
             0,
             0,
             -1.5},
        Case{"duty",
             {{"law", "duty"},
              {"duty_gain", "2"},
              {"duty_damping", "0.1"},
              {"supply_v", "12"},
              {"kt", "0.4"},
              {"ke", "0.3"},
              {"resistance", "4"}},
             {0.3},
             0.1,
             1,
             0.4 * ((2 * 0.2 - 0.1) * 12 - 0.3) / 4},
        Case{"duty at its limit, measured supply",
             {{"law", "duty"},
              {"inputs", "target supply"},
              {"duty_gain", "50"},
              {"duty_limit", "0.9"},
              {"kt", "0.4"},
              {"ke", "0.3"},
              {"resistance", "4"}},
             {-2, 7},
             0.1,
             1,
             0.4 * (-0.9 * 7 - 0.3) / 4},
        Case{"dead zone on the voltage",
             {{"law", "voltage"}, {"kt", "1"}, {"ke", "1"}, {"resistance", "2"}, {"dead_zone", "0.4"}},
             {1},
             0,
             0.1,
             (0.6 - 0.1) / 2},
        Case{"inside the voltage's dead zone the winding still brakes",
             {{"law", "voltage"}, {"kt", "1"}, {"ke", "1"}, {"resistance", "2"}, {"dead_zone", "0.4"}},
             {0.3},
             0,
             0.1,
             -0.05},
        Case{"dead zone on the torque", Torque({{"dead_zone", "0.4"}}), {-1}, 0, 0, -0.6},
        Case{"affine, dead zone on the command",
             {{"law", "affine"}, {"gain", "3"}, {"dead_zone", "0.4"}, {"dead_zone_on", "command"}},
             {1},
             0,
             0,
             1.8},
        Case{"torque limit", Torque({{"torque_limit_n_m", "0.8"}}), {-3}, 0, 0, -0.8},
        Case{"soft limit below its corner",
             Torque({{"torque_limit_n_m", "2"}, {"limit_softness", "0.5"}}),
             {-0.9},
             0,
             0,
             -0.9},
        Case{
            "soft limit at its level", Torque({{"torque_limit_n_m", "2"}, {"limit_softness", "0.5"}}), {2}, 0, 0, 1.75},
        Case{"soft limit beyond its corner",
             Torque({{"torque_limit_n_m", "2"}, {"limit_softness", "0.5"}}),
             {-3.1},
             0,
             0,
             -2},
        Case{"droop", Torque({{"droop_at_peak", "0.2"}, {"droop_reference_n_m", "4"}}), {-2}, 0, 0, -2 * 0.9},
        Case{"droop that sets in late",
             Torque({{"droop_at_peak", "0.2"}, {"droop_reference_n_m", "4"}, {"droop_exponent", "3"}}),
             {-2},
             0,
             0,
             -2 * 0.975},
        Case{"asymmetry up", Torque({{"asymmetry", "0.1"}}), {2}, 0, 0, 2.2},
        Case{"asymmetry down", Torque({{"asymmetry", "0.1"}}), {-2}, 0, 0, -1.8},
        Case{"asymmetry of the voltage leaves the back-EMF",
             {{"law", "voltage"}, {"kt", "1"}, {"ke", "1"}, {"resistance", "2"}, {"command_asymmetry", "0.2"}},
             {-1},
             0,
             0.1,
             (-0.8 - 0.1) / 2},
        Case{"asymmetry after the command's dead zone",
             {{"law", "affine"},
              {"gain", "3"},
              {"dead_zone", "0.4"},
              {"dead_zone_on", "command"},
              {"command_asymmetry", "0.2"}},
             {1},
             0,
             0,
             3 * 0.6 * 1.2},
        Case{"driving", Torque({{"efficiency_drive", "0.7"}, {"efficiency_backdrive", "0.4"}}), {2}, 0, 3, 1.4},
        Case{"driven back", Torque({{"efficiency_drive", "0.7"}, {"efficiency_backdrive", "0.4"}}), {2}, 0, -3, 0.8},
        Case{"gear friction that slides", Torque(kGearFriction), {2}, 0, -1, 2 + 0.2 * 2 + 0.5 * std::exp(-1)},
        Case{"gear friction that creeps", Torque(kGearFriction), {2}, 0, 0.01, 2 - 10 * 0.01},
        Case{"limit before droop before asymmetry",
             Torque({{"torque_limit_n_m", "2"},
                     {"droop_at_peak", "0.5"},
                     {"droop_reference_n_m", "2"},
                     {"asymmetry", "0.1"},
                     {"efficiency_drive", "0.9"}}),
             {9},
             0,
             1,
             2 * 0.5 * 1.1 * 0.9}),
    [](const auto& test) {
      std::string name = test.param.name;
      for (char& c : name) c = std::isalnum(static_cast<unsigned char>(c)) ? c : '_';
      return name;
    });

TEST(MotorLawTest, EstimateIsBeforeDroopAsymmetryAndEfficiency) {
  const Rig rig{.config = Torque({{"torque_limit_n_m", "2"},
                                  {"droop_at_peak", "0.5"},
                                  {"asymmetry", "0.1"},
                                  {"efficiency_drive", "0.9"},
                                  {"dead_zone", "0.5"}})};
  const ModelPtr m = rig.Compile();
  const DataPtr d(mj_makeData(m.get()));
  TorqueAt(m.get(), d.get(), 0, 0, {1.75});
  EXPECT_NEAR(StateOf(m.get(), d.get()).estimate_n_m(), 1.25, kRounding);
}

TEST(MotorLawTest, DisabledGroupGivesNoTorque) {
  Rig rig{.config = kTorqueLaw, .first = "group='3'"};
  const ModelPtr m = rig.Compile();
  const DataPtr d(mj_makeData(m.get()));
  EXPECT_EQ(TorqueAt(m.get(), d.get(), 0, 0, {1}), 1);
  m->opt.disableactuator = 1 << 3;
  EXPECT_EQ(TorqueAt(m.get(), d.get(), 0, 0, {1}), 0);
}

}  // namespace
}  // namespace gapscope::testing
