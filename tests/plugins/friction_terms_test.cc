// Each term of gapscope.friction against its closed form, and the gradients a tuner sees.
#include <cmath>
#include <functional>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

constexpr double kTermsInertia = 0.01;

// The acceleration of a free wheel at a speed under a motor torque, steady (the second step of two).
double Acceleration(const JointModel& joint, double speed, double torque) {
  const ModelPtr m = Compile(joint.Xml());
  const DataPtr d(mj_makeData(m.get()));
  for (int i = 0; i < 2; ++i) {
    d->qvel[0] = speed;
    d->ctrl[0] = torque;
    mj_step(m.get(), d.get());
  }
  return d->qacc[0];
}

JointModel Wheel(const std::string& config, bool turn = true) {
  JointModel joint{.step_s = 1e-4, .inertia = kTermsInertia};
  joint.config = config + Config("row_softness", 0.01);
  joint.turn = turn;
  joint.actuators = "<motor joint=\"j\" forcerange=\"-2 2\"/>";
  return joint;
}

TEST(FrictionTermsTest, SlidingTorqueFollowsTheLaw) {
  constexpr double kTolerance = 1e-9;
  const std::string base = Config("friction_n_m", 0.1);
  struct Case {
    std::string config;
    double speed, torque, friction;  // friction torque expected, with its sign
  };
  const double hump = 0.1 + 0.2 * std::exp(-1.0 / 4), hump_linear = 0.1 + 0.2 * std::exp(-0.5);
  for (const Case& c :
       std::vector<Case>{{base, 2, 0.5, -0.1},
                         {base, -2, 0.5, 0.1},
                         {base + Config("breakaway_n_m", 0.3) + Config("stribeck_speed_rad_per_s", 2), 1, 0, -hump},
                         {base + Config("breakaway_n_m", 0.3) + Config("stribeck_speed_rad_per_s", 2) +
                              Config("stribeck_exponent", 1),
                          -1, 0, hump_linear},
                         {base + Config("breakaway_n_m", 0.05), 1, 0, -0.1},
                         {base + Config("viscous_n_m_s_per_rad", 0.02), 5, 0, -0.2},
                         {base + Config("quadratic_n_m_s2_per_rad2", 0.02), -5, 0, 0.6},
                         {base + Config("friction_positive_n_m", 0.04), 3, 0, -0.14},
                         {base + Config("friction_positive_n_m", 0.04), -3, 0, 0.1},
                         {base + Config("friction_negative_n_m", 0.04), -3, 0, 0.14},
                         {base + Config("viscous_positive_n_m_s_per_rad", 0.01), 4, 0, -0.14},
                         {base + Config("viscous_positive_n_m_s_per_rad", 0.01), -4, 0, 0.1},
                         {base + Config("viscous_negative_n_m_s_per_rad", 0.01), -4, 0, 0.14},
                         {base + Config("load_coefficient", 0.2), 3, 1, -0.3},
                         {base + Config("load_coefficient", 0.2), 3, 5, -0.5},  // the force limit of 2 N m holds
                         {base + Config("load_quadratic", 0.2), -3, -1.5, 0.55},
                         {base + Config("load_coefficient", 0.2) + Config("backdrive_factor", 0.5), 3, -1, -0.2},
                         {base + Config("load_coefficient", 0.2) + Config("backdrive_factor", 0.5), 3, 1, -0.3}}) {
    const double applied = std::clamp(c.torque, -2.0, 2.0);
    for (const bool turn : {true, false}) {  // the torque is steady, so last step's is this step's
      EXPECT_NEAR(Acceleration(Wheel(c.config, turn), c.speed, c.torque), (applied + c.friction) / kTermsInertia,
                  kTolerance / kTermsInertia)
          << c.config << " at " << c.speed << " rad/s, " << c.torque << " N m, turn " << turn;
    }
  }
}

// At rest the level is that of the direction in which the joint would start.
TEST(FrictionTermsTest, HoldsDifferentlyByDirection) {
  const std::string config =
      Config("friction_n_m", 0.1) + Config("friction_positive_n_m", 0.05) + Config("friction_negative_n_m", 0.2);
  for (const bool turn : {true, false}) {
    EXPECT_LT(std::abs(Acceleration(Wheel(config, turn), 0, 0.149)), 1e-3);
    EXPECT_NEAR(Acceleration(Wheel(config, turn), 0, 0.151), 0.001 / kTermsInertia, 1e-3);
    EXPECT_LT(std::abs(Acceleration(Wheel(config, turn), 0, -0.299)), 1e-3);
    EXPECT_NEAR(Acceleration(Wheel(config, turn), 0, -0.301), -0.001 / kTermsInertia, 1e-3);
  }
  // Held by the motor against back-driving: half of the load's share.
  const std::string geared =
      Config("load_coefficient", 0.2) + Config("backdrive_factor", 0.5) + Config("friction_n_m", 0.01);
  JointModel loaded = Wheel(geared);
  loaded.mass = 0.5, loaded.length = 0.1, loaded.inertia = kTermsInertia;
  const ModelPtr m = Compile(loaded.Xml());
  const DataPtr d(mj_makeData(m.get()));
  const double load = 0.5 * 9.81 * 0.1;  // at q = pi/2, pulling negative
  for (const auto& [torque, moves] : std::vector<std::pair<double, int>>{{0.93, 0}, {0.88, -1}, {1.2, 0}, {1.28, 1}}) {
    mj_resetData(m.get(), d.get());
    d->qpos[0] = std::acos(-1.0) / 2;
    d->ctrl[0] = torque * load;
    for (int i = 0; i < 20; ++i) mj_step(m.get(), d.get());
    EXPECT_EQ((d->qvel[0] > 1e-5) - (d->qvel[0] < -1e-5), moves) << torque << " speed " << d->qvel[0];
  }
}

// A pendulum on the same wheel pulls it through the mass matrix: only the whole system's free acceleration tells the
// side.
TEST(FrictionTermsTest, DirectionAtRestSeesOtherJoints) {
  const std::string xml =
      "<mujoco><option timestep=\"0.001\"><flag contact=\"disable\"/></option><extension><plugin "
      "plugin=\"gapscope.friction\"><instance name=\"f\">" +
      Config("joint", "j") + Config("friction_n_m", 0.01) + Config("friction_negative_n_m", 5) +
      "</instance></plugin></extension><worldbody><body><joint name=\"j\" axis=\"0 0 1\" frictionloss=\"1e-9\" " +
      StiffRow(0.001) +
      "/><geom type=\"capsule\" size=\".01\" fromto=\"0 0 0 .2 0 0\" mass=\".1\"/><plugin plugin=\"gapscope.friction\" "
      "instance=\"f\"/>"
      "<body pos=\".2 0 0\"><joint name=\"p\" axis=\"1 0 0\"/><geom type=\"capsule\" size=\".01\" fromto=\"0 0 0 0 0 "
      "-.3\" mass=\".2\"/></body></body>"
      "</worldbody><actuator><plugin joint=\"j\" plugin=\"gapscope.friction\" instance=\"f\"/></actuator></mujoco>";
  const ModelPtr m = Compile(xml);
  for (const double side : {1.0, -1.0}) {
    const DataPtr d(mj_makeData(m.get()));
    d->qpos[1] = side;
    for (int i = 0; i < 50; ++i) mj_step(m.get(), d.get());
    // Without friction the arm would start one way; that way is either nearly free or all but locked.
    const DataPtr free(mj_makeData(m.get()));
    free->qpos[1] = side;
    mj_forward(m.get(), free.get());
    if (free->qacc_smooth[0] > 0) {
      EXPECT_GT(d->qvel[0], 1e-2);
    } else {
      EXPECT_LT(std::abs(d->qvel[0]), 1e-4);
    }
  }
}

// BAM's gearbox torque: |motor - external|, external being gravity here.
TEST(FrictionTermsTest, GearboxLoadCountsMotorAndGravity) {
  const double gravity = -0.5 * 9.81 * 0.1 * std::sin(0.8);
  for (const bool turn : {true, false}) {
    JointModel joint =
        Wheel(Config("load", "gearbox") + Config("load_coefficient", 0.2) + Config("viscous_n_m_s_per_rad", 0.1), turn);
    joint.mass = 0.5, joint.length = 0.1, joint.joint = "damping=\"0.3\"";
    const ModelPtr m = Compile(joint.Xml());
    const DataPtr d(mj_makeData(m.get()));
    for (int i = 0; i < 2; ++i) {
      d->qpos[0] = 0.8, d->qvel[0] = 2, d->ctrl[0] = 0.7;
      mj_forward(m.get(), d.get());
      if (i == 0) mj_step(m.get(), d.get());
    }
    EXPECT_NEAR(FrictionForce(d.get()), -0.2 * (0.7 - gravity), 1e-9) << turn;
  }
}

// An actuator plugin that passes its command on, to stand before or after the friction.
void RegisterTestMotor() {
  static const bool once = [] {
    mjpPlugin plugin;
    mjp_defaultPlugin(&plugin);
    plugin.name = "test.motor";
    plugin.capabilityflags = mjPLUGIN_ACTUATOR;
    plugin.nstate = +[](const mjModel*, int) { return 0; };
    plugin.init = +[](const mjModel*, mjData*, int) { return 0; };
    plugin.reset = +[](const mjModel*, mjtNum*, void*, int) {};
    plugin.compute = +[](const mjModel* m, mjData* d, int instance, int) {
      for (int i = 0; i < m->nactuator; ++i) {
        if (m->actuator_plugin[i] == instance)
          d->actuator_force[m->actuator_outadr[i]] = d->ctrl[m->actuator_ctrladr[i]];
      }
    };
    mjp_registerPlugin(&plugin);
    return true;
  }();
  (void)once;
}

// Behind the motor plugin this step's torque counts, before it the last one's; asking for the turn there is refused.
TEST(FrictionTermsTest, LoadFrictionIsCurrentBehindTheMotorPlugin) {
  RegisterTestMotor();
  const std::string motor = "<plugin plugin=\"test.motor\"><instance name=\"a\"/></plugin>";
  const auto model = [&](bool behind, bool turn) {
    JointModel joint = Wheel(Config("load_coefficient", 0.1), turn);
    joint.actuators = "<plugin joint=\"j\" plugin=\"test.motor\" instance=\"a\"/>";
    std::string xml = joint.Xml();
    return xml.insert(behind ? xml.find("<extension>") + 11 : xml.find("</extension>"), motor);
  };
  std::string error;
  EXPECT_EQ(Compile(model(false, true), &error), nullptr);
  EXPECT_NE(error.find("instance 'f': it stands before the actuator plugin instance 'a'"), std::string::npos) << error;
  for (const auto& [behind, turn] : {std::pair{true, true}, {true, false}, {false, false}}) {
    const ModelPtr m = Compile(model(behind, turn));
    const DataPtr d(mj_makeData(m.get()));
    for (const double torque : {1.0, -0.5, 1.5}) {
      const double before = d->ctrl[0];
      d->qvel[0] = 50;
      d->ctrl[0] = torque;
      mj_step(m.get(), d.get());
      EXPECT_NEAR(FrictionForce(d.get()), -0.1 * std::abs(behind ? torque : before), 1e-12) << behind << turn;
    }
  }
}

// A coast that ends before standstill, so that no event falls between steps: every parameter must have a gradient that
// does not depend on the step of the difference.
TEST(FrictionTermsTest, EveryParameterHasASmoothGradient) {
  struct Knob {
    const char* key;
    double value, step;
  };
  const std::vector<Knob> knobs = {{"friction_n_m", 0.02, 1e-3},
                                   {"breakaway_n_m", 0.05, 1e-3},
                                   {"stribeck_speed_rad_per_s", 3, 0.03},
                                   {"stribeck_exponent", 2, 0.02},
                                   {"viscous_n_m_s_per_rad", 0.002, 1e-4},
                                   {"quadratic_n_m_s2_per_rad2", 3e-4, 1e-5},
                                   {"load_coefficient", 0.1, 1e-3},
                                   {"load_quadratic", 0.1, 1e-3},
                                   {"friction_positive_n_m", 0.01, 1e-4},
                                   {"friction_negative_n_m", 0.02, 1e-4},
                                   {"viscous_positive_n_m_s_per_rad", 0.001, 1e-5},
                                   {"viscous_negative_n_m_s_per_rad", 0.002, 1e-5},
                                   {"backdrive_factor", 0.7, 1e-2}};
  for (const bool lugre : {false, true}) {
    JointModel joint{.step_s = 0.001, .inertia = kTermsInertia};
    std::vector<Knob> all = knobs;
    if (lugre) {
      all.push_back({"sigma0_n_m_per_rad", 5, 0.1});
      all.push_back({"sigma1_n_m_s_per_rad", 0.005, 1e-4});
      joint.config = Config("model", "lugre");
    }
    for (const Knob& knob : all) joint.numeric += Numeric(knob.key, knob.value);
    joint.turn = true;
    joint.actuators = "<motor joint=\"j\"/>";
    const ModelPtr m = Compile(joint.Xml());
    // To and fro: ends with both directions used, driven and back-driven.
    const auto run = [&] {
      const DataPtr d(mj_makeData(m.get()));
      double end = 0;
      for (const double side : {1.0, -1.0}) {
        mj_resetData(m.get(), d.get());
        d->qvel[0] = 6 * side;
        for (int i = 0; i < 300; ++i) {
          d->ctrl[0] = side * (i < 150 ? -0.1 : 0.15);
          mj_step(m.get(), d.get());
        }
        end += d->qpos[0] * (side > 0 ? 1 : 2);
      }
      return end;
    };
    for (const Knob& knob : all) {
      mjtNum& live = Live(m.get(), std::string("f.") + knob.key);
      const auto slope = [&](double step) {
        live = knob.value + step;
        const double up = run();
        live = knob.value - step;
        const double down = run();
        live = knob.value;
        return (up - down) / (2 * step);
      };
      const double coarse = slope(knob.step), fine = slope(0.1 * knob.step), finest = slope(1e-3 * knob.step);
      EXPECT_GT(std::abs(fine), 1e-5) << knob.key << lugre;
      EXPECT_NEAR(coarse, fine, 1e-2 * std::abs(fine)) << knob.key << lugre;
      EXPECT_NEAR(finest, fine, 1e-3 * std::abs(fine)) << knob.key << lugre;
    }
  }
}

}  // namespace
}  // namespace gapscope::test
