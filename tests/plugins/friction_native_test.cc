// gapscope.friction against MuJoCo's own frictionloss, and what true stick must do: hold, not chatter, not create energy.
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

constexpr double kSensorCount_rad = 2 * std::numbers::pi / 4096;

// Two joints, one with the plugin, the other with native friction always; driven, so that they stick and slip.
std::string TwoJoints(const std::string& integrator, const std::string& solver, bool island, const std::string& jacobian, bool plugin) {
  std::string xml = "<mujoco><option timestep=\"0.002\" integrator=\"" + integrator + "\" solver=\"" + solver + "\" jacobian=\"" + jacobian +
                    "\"><flag island=\"" + (island ? "enable" : "disable") + "\"/></option>";
  if (plugin) {
    xml += "<extension><plugin plugin=\"gapscope.friction\"><instance name=\"f\">" + Config("joint", "j") + Config("friction_n_m", 0.3) +
           "</instance></plugin></extension>";
  }
  xml += "<worldbody><body><joint name=\"j\" axis=\"0 1 0\" damping=\"0.01\" frictionloss=\"" + std::string(plugin ? "1e-6" : "0.3") +
         "\"/><geom type=\"capsule\" size=\"0.02\" fromto=\"0 0 0 0.3 0 0\"/>" + (plugin ? "<plugin plugin=\"gapscope.friction\" instance=\"f\"/>" : "") +
         "<body pos=\"0.3 0 0\"><joint name=\"k\" axis=\"0 1 0\" frictionloss=\"0.05\"/><geom type=\"capsule\" size=\"0.02\" fromto=\"0 0 0 0.2 0 0\"/>"
         "</body></body><body pos=\"0 1 0\"><joint name=\"l\" axis=\"0 1 0\" frictionloss=\"0.1\"/><geom size=\"0.1\" pos=\"0.1 0 0\"/></body></worldbody>"
         "<actuator><motor joint=\"j\" gear=\"2\"/></actuator></mujoco>";
  return xml;
}

TEST(FrictionNativeTest, EqualsFrictionlossBitForBit) {
  for (const char* integrator : {"Euler", "implicitfast", "implicit", "RK4"}) {
    for (const char* solver : {"Newton", "CG", "PGS"}) {
      for (const bool island : {true, false}) {
        for (const char* jacobian : {"dense", "sparse"}) {
          const ModelPtr native = Compile(TwoJoints(integrator, solver, island, jacobian, false));
          const ModelPtr ours = Compile(TwoJoints(integrator, solver, island, jacobian, true));
          const DataPtr a(mj_makeData(native.get())), b(mj_makeData(ours.get()));
          for (int i = 0; i < 400; ++i) {
            a->ctrl[0] = b->ctrl[0] = 2 * std::sin(0.01 * i);
            mj_step(native.get(), a.get());
            mj_step(ours.get(), b.get());
          }
          EXPECT_EQ(std::memcmp(a->qpos, b->qpos, 3 * sizeof(mjtNum)), 0) << integrator << solver << island << jacobian;
          EXPECT_EQ(std::memcmp(a->qvel, b->qvel, 3 * sizeof(mjtNum)), 0) << integrator << solver << island << jacobian;
          EXPECT_GT(std::abs(a->qvel[0]) + std::abs(a->qpos[0]), 1e-3);
        }
      }
    }
  }
}

// A load at 95 % of what friction holds, started at rest, with the row of the README.
TEST(FrictionNativeTest, HoldsALoadFor1000sWithoutCreep) {
  for (const double step_s : {0.001, 0.002, 0.004}) {
    for (const char* solver : {"Newton", "CG", "PGS"}) {
      JointModel joint{.step_s = step_s, .integrator = "implicitfast", .solver = solver, .inertia = 0.0018, .mass = 0.49, .length = 0.1};
      joint.config = Config("friction_n_m", 0.35) + Config("row_softness", 1e-4);
      const ModelPtr m = Compile(joint.Xml());
      const DataPtr d(mj_makeData(m.get()));
      const double start = std::asin(0.95 * 0.35 / (0.49 * 9.81 * 0.1));
      d->qpos[0] = start;
      // Creep is a constant speed: the full time at the coarse step, its rate at the fine ones.
      const double span_s = step_s == 0.004 && std::string(solver) == "Newton" ? 1000 : 10;
      for (int i = 0; i < span_s / step_s; ++i) mj_step(m.get(), d.get());
      const double creep_in_1000s = std::abs(d->qpos[0] - start) / span_s * 1000;
      RecordProperty("creep_rad_" + std::string(solver) + "_" + Text(step_s), Text(creep_in_1000s));
      std::printf("%s h %g creep %.3g rad\n", solver, step_s, creep_in_1000s);
      EXPECT_LT(creep_in_1000s, 0.1 * kSensorCount_rad);
    }
  }
}

}  // namespace
}  // namespace gapscope::test
