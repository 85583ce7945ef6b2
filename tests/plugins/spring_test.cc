// gapscope.spring against MuJoCo's own spring and closed forms.
#include <array>
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

struct SpringModel {
  std::string config = "", numeric = "", joint = "", integrator = "Euler";
  double step_s = 0.001;
  bool with_plugin = true;

  std::string Xml() const {
    std::string xml = "<mujoco><compiler angle=\"radian\"/><option timestep=\"" + Text(step_s) + "\" integrator=\"" +
                      integrator + "\"/>";
    if (with_plugin) {
      xml += "<extension><plugin plugin=\"gapscope.spring\"><instance name=\"f\">" + Config("joint", "j") + config +
             "</instance></plugin></extension>";
    }
    return xml + "<custom>" + numeric + "</custom><worldbody><body><joint name=\"j\" axis=\"0 0 1\" " + joint +
           "/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.01 0.01 0.01\"/>" +
           (with_plugin ? "<plugin plugin=\"gapscope.spring\" instance=\"f\"/>" : "") + "</body></worldbody></mujoco>";
  }
};

TEST(SpringTest, EveryTermHasItsClosedForm) {
  struct Case {
    std::string config;
    double torque;  // at q = 0.7
  };
  constexpr double kAngle = 0.7;
  for (const Case& c : std::vector<Case>{
           {"", 0},
           {Config("stiffness_n_m_per_rad", 2), -1.4},
           {Config("stiffness_n_m_per_rad", 2) + Config("rest_rad", 0.2), -1},
           {Config("cubic_n_m_per_rad3", 3) + Config("rest_rad", 0.2), -3 * 0.125},
           {Config("gravity_n_m", 1.5) + Config("gravity_rest_rad", 0.3), -1.5 * std::sin(0.4)},
           {Config("bias_n_m", -0.25), -0.25},
           {Config("cogging_n_m", 0.1) + Config("cogging_periods_per_rev", 7) + Config("cogging_phase_rad", 0.4),
            0.1 * std::sin(4.9 + 0.4)},
           {Config("cogging_second_n_m", 0.1) + Config("cogging_periods_per_rev", 7) +
                Config("cogging_second_phase_rad", -1),
            0.1 * std::sin(9.8 - 1)},
           {Config("stop_n_m_per_rad", 5) + Config("stop_rad", 0.5), -5 * 0.2},
           {Config("stop_n_m_per_rad", 5) + Config("stop_rad", 0.8), 0},
           {Config("stop_n_m_per_rad", 5) + Config("stop_rad", -0.8), 0}}) {
    const ModelPtr m = Compile(SpringModel{.config = c.config}.Xml());
    const DataPtr d(mj_makeData(m.get()));
    d->qpos[0] = kAngle;
    mj_forward(m.get(), d.get());
    EXPECT_NEAR(d->qfrc_passive[0], c.torque, 1e-14) << c.config;
  }
}

TEST(SpringTest, EqualsNativeStiffness) {
  constexpr double kRounding_rad = 1e-12;
  for (const char* integrator : {"Euler", "implicitfast", "RK4"}) {
    // MuJoCo's polynomial: its third coefficient is that of the displacement's third power.
    for (const auto& [stiffness, cubic] : {std::pair{"2", 0.0}, {"2 0 1.5", 1.5}, {"0 0 40", 40.0}}) {
      const ModelPtr ours = Compile(SpringModel{.config = Config("stiffness_n_m_per_rad", std::atof(stiffness)) +
                                                          Config("rest_rad", 0.3) + Config("cubic_n_m_per_rad3", cubic),
                                                .integrator = integrator}
                                        .Xml());
      const std::string joint = std::string("springref=\"0.3\" stiffness=\"") + stiffness + "\"";
      const ModelPtr native =
          Compile(SpringModel{.joint = joint, .integrator = integrator, .with_plugin = false}.Xml());
      const DataPtr a(mj_makeData(ours.get())), b(mj_makeData(native.get()));
      for (int i = 0; i < 2000; ++i) {
        mj_step(ours.get(), a.get());
        mj_step(native.get(), b.get());
        ASSERT_NEAR(a->qpos[0], b->qpos[0], kRounding_rad) << integrator << stiffness << i;
      }
    }
  }
}

double Energy(const mjData* d, double stiffness, double cubic) {
  const double q = d->qpos[0], w = d->qvel[0];
  return 0.005 * w * w + 0.5 * stiffness * q * q + 0.25 * cubic * std::pow(q, 4);
}

TEST(SpringTest, EnergyIsKeptWithoutHysteresisAndLostWithIt) {
  constexpr double kRk4Loss = 1e-6;  // share of the energy in 5 s
  const std::string hard = Config("stiffness_n_m_per_rad", 2) + Config("cubic_n_m_per_rad3", 1.5);
  for (const double height : {0.0, 0.02}) {
    const ModelPtr m =
        Compile(SpringModel{.config = hard + Config("hysteresis_n_m", height), .integrator = "RK4"}.Xml());
    const DataPtr d(mj_makeData(m.get()));
    d->qpos[0] = 1;
    const double start = Energy(d.get(), 2, 1.5);
    while (d->time < 5) mj_step(m.get(), d.get());
    const double lost = 1 - Energy(d.get(), 2, 1.5) / start;
    if (height == 0) {
      EXPECT_LT(std::abs(lost), kRk4Loss);
    } else {
      EXPECT_GT(lost, 0.3);
    }
  }
}

// Swept slowly to and fro between +-a the torque runs on the loop of Dahl's closed form, at any sweep step.
TEST(SpringTest, HysteresisLoopHasItsClosedForm) {
  constexpr double kHeight = 0.3, kReach = 0.1, kSweep = 0.25;
  for (const char* integrator : {"Euler", "RK4"}) {
    for (const int steps : {5, 50}) {
      const ModelPtr m = Compile(SpringModel{
          .config = Config("hysteresis_n_m", kHeight) + Config("hysteresis_rad", kReach), .integrator = integrator}
                                     .Xml());
      const DataPtr d(mj_makeData(m.get()));
      double bend = 0, q = 0;
      for (const double target : {kSweep, -kSweep, kSweep}) {
        const double start = q, from = bend, sign = target > start ? 1 : -1;
        for (int i = 1; i <= steps; ++i) {
          // The joint is pushed so that it lands on the next point: a step of a free body under its own speed and no
          // net torque.
          const double next = start + (target - start) * i / steps;
          d->qvel[0] = (next - d->qpos[0]) / m->opt.timestep;
          m->dof_armature[0] = 1e12;
          mj_step(m.get(), d.get());
          q = d->qpos[0];
          mj_forward(m.get(), d.get());
          bend = sign + (from - sign) * std::exp(-std::abs(q - start) / kReach);
          EXPECT_NEAR(d->qfrc_passive[0], -kHeight * bend, 1e-9) << integrator << steps;
        }
      }
    }
  }
}

// RK4 calls compute four times a step; the bend must follow the joint's travel, not the number of calls.
TEST(SpringTest, Rk4SettlesOncePerStep) {
  const auto run = [](double h, const char* integrator) {
    const ModelPtr m = Compile(SpringModel{.config = Config("stiffness_n_m_per_rad", 2) + Config("hysteresis_n_m", 0.2),
                                           .integrator = integrator,
                                           .step_s = h}
                                   .Xml());
    const DataPtr d(mj_makeData(m.get()));
    d->qpos[0] = 1;
    for (int i = 0; i < std::lround(1 / h); ++i) mj_step(m.get(), d.get());
    return d->qpos[0];
  };
  const double fine = run(1e-5, "RK4");
  std::printf("hysteresis: RK4 1 ms %.3g rad, Euler 1 ms %.3g rad off\n", run(1e-3, "RK4") - fine,
              run(1e-3, "Euler") - fine);
  EXPECT_NEAR(run(1e-3, "RK4"), fine, 1e-4);
  EXPECT_NEAR(run(1e-4, "Euler"), fine, 1e-3);
}

// Moving the joint or the clock from outside between steps is no travel.
TEST(SpringTest, HostMayMoveTheJointBetweenSteps) {
  const ModelPtr m = Compile(SpringModel{.config = Config("hysteresis_n_m", 0.2)}.Xml());
  const DataPtr d(mj_makeData(m.get()));
  d->qpos[0] = 3, d->time = 17;
  mj_forward(m.get(), d.get());
  EXPECT_EQ(d->qfrc_passive[0], 0);
  mj_step(m.get(), d.get());
  d->qpos[0] = -5;
  mj_forward(m.get(), d.get());
  EXPECT_EQ(d->qfrc_passive[0], 0);
}

TEST(SpringTest, EveryParameterHasASmoothGradient) {
  struct Knob {
    const char* key;
    double value, step;
  };
  const std::vector<Knob> knobs = {
      {"stiffness_n_m_per_rad", 0.5, 1e-2},   {"rest_rad", 0.1, 1e-2},           {"hysteresis_n_m", 0.05, 1e-3},
      {"hysteresis_rad", 0.1, 1e-3},          {"cubic_n_m_per_rad3", 0.2, 1e-2}, {"gravity_n_m", 0.3, 1e-2},
      {"gravity_rest_rad", 0.4, 1e-2},        {"bias_n_m", 0.05, 1e-3},          {"cogging_n_m", 0.02, 1e-3},
      {"cogging_periods_per_rev", 6, 1e-3},   {"cogging_phase_rad", 0.3, 1e-2},  {"cogging_second_n_m", 0.01, 1e-3},
      {"cogging_second_phase_rad", 0.3, 1e-2}};
  SpringModel spring;
  for (const Knob& knob : knobs) spring.numeric += Numeric(knob.key, knob.value);
  const ModelPtr m = Compile(spring.Xml());
  const auto run = [&] {
    const DataPtr d(mj_makeData(m.get()));
    d->qpos[0] = 1.3;
    for (int i = 0; i < 700; ++i) mj_step(m.get(), d.get());
    return d->qpos[0];
  };
  for (const Knob& knob : knobs) {
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
    EXPECT_GT(std::abs(fine), 1e-5) << knob.key;
    EXPECT_NEAR(coarse, fine, 2e-2 * std::abs(fine)) << knob.key;
    EXPECT_NEAR(finest, fine, 1e-3 * std::abs(fine)) << knob.key;
  }
}

TEST(SpringTest, WrongAttributesAreRefusedWithACure) {
  for (const auto& [config, numeric, says] : std::vector<std::array<std::string, 3>>{
           {Config("stiffness_n_m_per_rad", -1), "", "'stiffness_n_m_per_rad' is -1.000000, allowed 0"},
           {Config("hysteresis_rad", "wide"), "", "'hysteresis_rad' is 'wide', expected a number rad"},
           {"", Numeric("hysteresis_n_m", -1), "'hysteresis_n_m' is -1.000000, allowed 0"},
           {"", Numeric("stiffness", 1), "numeric 'f.stiffness' sets no parameter"}}) {
    std::string error;
    EXPECT_EQ(Compile(SpringModel{.config = config, .numeric = numeric}.Xml(), &error), nullptr);
    EXPECT_NE(error.find(says), std::string::npos) << error;
    EXPECT_NE(error.find("instance 'f'"), std::string::npos) << error;
  }
  std::string xml = SpringModel{}.Xml(), error;
  xml.replace(xml.find("value=\"j\""), 9, "value=\"arm\"");
  EXPECT_EQ(Compile(xml, &error), nullptr);
  EXPECT_NE(error.find("hinge or slide joint (j)"), std::string::npos) << error;
}

}  // namespace
}  // namespace gapscope::test
