// gapscope.expression against MuJoCo's native elements and closed forms.
#include <cmath>
#include <numbers>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

struct FormulaModel {
  std::string torque = "", numeric = "", config = "", joint = "", integrator = "RK4";
  bool with_plugin = true;

  std::string Xml() const {
    std::string xml =
        "<mujoco><compiler angle=\"radian\"/><option timestep=\"0.001\" integrator=\"" + integrator + "\"/>";
    if (with_plugin) {
      xml +=
          "<extension><plugin plugin=\"gapscope.expression\"><instance name=\"f\"><config key=\"joint\" "
          "value=\"j\"/>" +
          (torque.empty() ? "" : "<config key=\"torque\" value=\"" + torque + "\"/>") + config +
          "</instance></plugin></extension>";
    }
    return xml + "<custom>" + numeric + "</custom><worldbody><body><joint name=\"j\" axis=\"0 0 1\" " + joint +
           "/><inertial pos=\"0 0 0\" mass=\"1\" diaginertia=\"0.01 0.01 0.01\"/>" +
           (with_plugin ? "<plugin plugin=\"gapscope.expression\" instance=\"f\"/>" : "") +
           "</body></worldbody><actuator><motor name=\"a\" joint=\"j\" gear=\"0.02\"/></actuator></mujoco>";
  }
};

// Both turn from the same state under the same command.
double LargestApart(const FormulaModel& formula, const std::string& native_joint, const std::string& integrator) {
  FormulaModel native{.joint = native_joint, .integrator = integrator, .with_plugin = false}, ours = formula;
  ours.integrator = integrator;
  const ModelPtr a = Compile(ours.Xml()), b = Compile(native.Xml());
  if (!a || !b) return 1;
  const DataPtr x(mj_makeData(a.get())), y(mj_makeData(b.get()));
  double most = 0;
  x->qpos[0] = y->qpos[0] = 0.8;
  for (int i = 0; i < 2000; ++i) {
    x->ctrl[0] = y->ctrl[0] = i / 300 % 2;
    mj_step(a.get(), x.get());
    mj_step(b.get(), y.get());
    most = std::max(most, std::abs(x->qpos[0] - y->qpos[0]));
  }
  return most;
}

TEST(ExpressionTest, EqualsTheNativeSpringAndDamper) {
  constexpr double kRounding_rad = 1e-12;
  const FormulaModel spring{.torque = "-k*angle", .numeric = Numeric("k", 2)},
      hard{.torque = "-k*(angle-rest) - k3*(angle-rest)^3",
           .numeric = Numeric("k", 2) + Numeric("k3", 1.5) + Numeric("rest", 0.3)},
      damper{.torque = "-d*speed", .numeric = Numeric("d", 0.05)};
  for (const char* integrator : {"Euler", "RK4"}) {
    EXPECT_LT(LargestApart(spring, "stiffness=\"2\"", integrator), kRounding_rad) << integrator;
    EXPECT_LT(LargestApart(hard, "stiffness=\"2 0 1.5\" springref=\"0.3\"", integrator), kRounding_rad) << integrator;
  }
  // Euler takes the native damper implicitly.
  EXPECT_LT(LargestApart(damper, "damping=\"0.05\"", "RK4"), kRounding_rad);
}

TEST(ExpressionTest, ReadsAngleSpeedCommandTimeAndParameters) {
  const ModelPtr m = Compile(FormulaModel{.torque = "p*sin(3*angle - q) + speed^2 + 10*command + 100*time + pi",
                                          .numeric = Numeric("p", 0.2) + Numeric("q", 0.4),
                                          .config = Config("actuator", "a")}
                                 .Xml());
  const DataPtr d(mj_makeData(m.get()));
  d->qpos[0] = 0.7, d->qvel[0] = -2, d->ctrl[0] = 0.5, d->time = 3;
  mj_forward(m.get(), d.get());
  EXPECT_NEAR(d->qfrc_passive[0], 0.2 * std::sin(2.1 - 0.4) + 4 + 5 + 300 + std::numbers::pi, 1e-12);
  // Parameters are live.
  Live(m.get(), "f.p") = 0;
  mj_forward(m.get(), d.get());
  EXPECT_NEAR(d->qfrc_passive[0], 4 + 5 + 300 + std::numbers::pi, 1e-12);
}

// A command that is late by whole and by half steps is the exact mean over the step of what was sent.
TEST(ExpressionTest, CommandMayBeLate) {
  for (const char* integrator : {"Euler", "RK4"}) {
    for (const double late_steps : {0.0, 3.0, 4.5}) {
      const ModelPtr m = Compile(FormulaModel{.torque = "command",
                                              .numeric = Numeric("command_delay_s", 0.001 * late_steps),
                                              .config = Config("actuator", "a") + Config("max_delay_s", 0.02),
                                              .integrator = integrator}
                                     .Xml());
      const DataPtr d(mj_makeData(m.get()));
      const auto sent = [](double step) { return step < 0 ? 1.0 : 1 + std::floor(step) * std::floor(step); };
      for (int i = 0; i < 40; ++i) {
        d->ctrl[0] = sent(i);
        mj_step1(m.get(), d.get());
        const double expected = 0.5 * (sent(i - late_steps) + sent(i - late_steps + 0.5));
        ASSERT_NEAR(d->qfrc_passive[0], expected, 1e-9 * expected) << integrator << late_steps << " " << i;
        mj_step(m.get(), d.get());
      }
    }
  }
}

// A torque that is no number is MuJoCo's own warning, never an end of the program.
TEST(ExpressionTest, ATorqueThatIsNotFiniteIsADivergence) {
  for (const char* torque : {"sqrt(-1-angle^2)", "1/(angle-angle)", "ln(0-1)"}) {
    const ModelPtr m = Compile(FormulaModel{.torque = torque}.Xml());
    ASSERT_TRUE(m);
    mju_user_warning = [](const char*) {};
    m->opt.disableflags |= mjDSBL_AUTORESET;
    const DataPtr d(mj_makeData(m.get()));
    for (int i = 0; i < 10; ++i) mj_step(m.get(), d.get());
    EXPECT_GT(d->warning[mjWARN_BADQACC].number + d->warning[mjWARN_BADQPOS].number, 0) << torque;
    mju_user_warning = [](const char* text) { ADD_FAILURE() << "MuJoCo warning: " << text; };
  }
}

TEST(ExpressionTest, RefusesWithACure) {
  struct Case {
    FormulaModel model;
    const char* says;
  };
  mju_user_warning = [](const char*) {};
  for (const auto& [model, says] :
       std::vector<Case>{{{}, "set <config key=\"torque\""},
                         {{.torque = "k*angle"}, "add <numeric name=\"f.k\""},
                         {{.torque = "angle", .numeric = Numeric("kk", 1)}, "numeric 'f.kk' sets no parameter"},
                         {{.torque = "sin(angle"}, "arenthes"},
                         {{.torque = "angle = 3"}, "it assigns"},
                         {{.torque = "angle, speed"}, "several values"},
                         {{.torque = std::string(5000, '1')}, "too long"},
                         {{.torque = "command"}, "set <config key=\"actuator\""},
                         {{.torque = "command", .config = Config("actuator", "b")}, "the name of an actuator"},
                         {{.torque = "command",
                           .numeric = Numeric("command_delay_s", 0.1),
                           .config = Config("actuator", "a") + Config("max_delay_s", 0.02)},
                          "raise max_delay_s"},
                         {{.torque = "angle", .config = Config("max_delay_s", -1)}, "leave it out for no delay"}}) {
    std::string error;
    EXPECT_FALSE(Compile(model.Xml(), &error)) << model.torque;
    EXPECT_NE(error.find(says), std::string::npos) << model.torque << ": " << error;
  }
  mju_user_warning = [](const char* text) { ADD_FAILURE() << "MuJoCo warning: " << text; };
}

}  // namespace
}  // namespace gapscope::test
