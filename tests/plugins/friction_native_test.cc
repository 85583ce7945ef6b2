// gapscope.friction against MuJoCo's own frictionloss, and what true stick must do: hold, not chatter, not create
// energy.
#include <cmath>
#include <cstring>
#include <numbers>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

constexpr double kSensorCount_rad = 2 * std::numbers::pi / 4096;

// Two joints, one with the plugin, the other with native friction always; driven, so that they stick and slip.
std::string TwoJoints(const std::string& integrator, const std::string& solver, bool island,
                      const std::string& jacobian, bool plugin) {
  std::string xml = "<mujoco><option timestep=\"0.002\" integrator=\"" + integrator + "\" solver=\"" + solver +
                    "\" jacobian=\"" + jacobian + "\"><flag island=\"" + (island ? "enable" : "disable") +
                    "\"/></option>";
  if (plugin) {
    xml += "<extension><plugin plugin=\"gapscope.friction\"><instance name=\"f\">" + Config("joint", "j") +
           Config("friction_n_m", 0.3) + "</instance></plugin></extension>";
  }
  xml += "<worldbody><body><joint name=\"j\" axis=\"0 1 0\" damping=\"0.01\" frictionloss=\"" +
         std::string(plugin ? "1e-6" : "0.3") + "\"/><geom type=\"capsule\" size=\"0.02\" fromto=\"0 0 0 0.3 0 0\"/>" +
         (plugin ? "<plugin plugin=\"gapscope.friction\" instance=\"f\"/>" : "") +
         "<body pos=\"0.3 0 0\"><joint name=\"k\" axis=\"0 1 0\" frictionloss=\"0.05\"/><geom type=\"capsule\" "
         "size=\"0.02\" fromto=\"0 0 0 0.2 0 0\"/>"
         "</body></body><body pos=\"0 1 0\"><joint name=\"l\" axis=\"0 1 0\" frictionloss=\"0.1\"/><geom size=\"0.1\" "
         "pos=\"0.1 0 0\"/></body></worldbody>"
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
      JointModel joint{.step_s = step_s,
                       .integrator = "implicitfast",
                       .solver = solver,
                       .inertia = 0.0018,
                       .mass = 0.49,
                       .length = 0.1};
      joint.config = Config("friction_n_m", 0.35) + Config("row_softness", 0.01);
      const ModelPtr m = Compile(joint.Xml());
      const DataPtr d(mj_makeData(m.get()));
      const double start = std::asin(0.95 * 0.35 / (0.49 * 9.81 * 0.1));
      d->qpos[0] = start;
      // What remains is a constant speed: the full time at the coarse step, the rate of 10 s for the others.
      const double span_s = step_s == 0.004 && std::string(solver) == "Newton" ? 1000 : 10;
      for (int i = 0; i < span_s / step_s; ++i) mj_step(m.get(), d.get());
      const double creep_rad = std::abs(d->qpos[0] - start) / span_s * 1000;
      std::printf("%s h %g s: %.3g rad in 1000 s\n", solver, step_s, creep_rad);
      EXPECT_LT(creep_rad, 0.2 * kSensorCount_rad) << solver << step_s;
    }
  }
}

struct Driven {
  double step_s;
  std::string integrator, solver;
};

JointModel StickSlipModel(const Driven& c) {
  JointModel joint{.step_s = c.step_s,
                   .integrator = c.integrator,
                   .solver = c.solver,
                   .inertia = 0.0018,
                   .mass = 0.49,
                   .length = 0.1};
  joint.config = Config("friction_n_m", 0.35) + Config("breakaway_n_m", 0.45) + Config("load_coefficient", 0.1) +
                 Config("friction_negative_n_m", 0.05) + Config("row_softness", 0.01);
  joint.turn = true;
  joint.actuators = "<motor name=\"m\" joint=\"j\"/>";
  return joint;
}

double Drive(double t) {
  return std::sin(2 * std::numbers::pi * 0.5 * t) + 0.3 * std::sin(2 * std::numbers::pi * 1.7 * t);
}

TEST(FrictionNativeTest, NeverCreatesEnergy) {
  // Newton and PGS give exactly none; CG stops at its own relative tolerance, here of the 0.35 N m over a radian.
  constexpr double kCgTolerance_j = 1e-8 * 0.35;
  for (const Driven& c : std::vector<Driven>{{0.001, "Euler", "Newton"},
                                             {0.002, "implicitfast", "Newton"},
                                             {0.004, "implicitfast", "Newton"},
                                             {0.004, "Euler", "PGS"},
                                             {0.002, "implicitfast", "CG"}}) {
    const ModelPtr m = Compile(StickSlipModel(c).Xml());
    const DataPtr d(mj_makeData(m.get()));
    double lost_j = 0;
    for (int i = 0; i < 20 / c.step_s; ++i) {
      d->ctrl[0] = Drive(d->time);
      const double before = d->qpos[0];
      mj_step(m.get(), d.get());
      const double work_j = FrictionForce(d.get()) * (d->qpos[0] - before);
      ASSERT_LE(work_j, c.solver == "CG" ? kCgTolerance_j : 0) << c.integrator << c.solver << c.step_s << " step " << i;
      lost_j -= work_j;
    }
    EXPECT_GT(lost_j, 1);
  }
}

// The joint turns round once per reversal of the drive, and at rest it rests: no sign changes beyond the motion's own.
TEST(FrictionNativeTest, DoesNotChatter) {
  std::vector<int> turns;
  for (const Driven& c : std::vector<Driven>{{0.0001, "Euler", "Newton"},
                                             {0.001, "Euler", "Newton"},
                                             {0.002, "implicitfast", "Newton"},
                                             {0.004, "implicitfast", "Newton"},
                                             {0.004, "implicitfast", "PGS"},
                                             {0.004, "RK4", "Newton"}}) {
    JointModel joint = StickSlipModel(c);
    joint.mass = 0;  // a free wheel: where it sticks and for how long is set by the drive alone
    const ModelPtr m = Compile(joint.Xml());
    const DataPtr d(mj_makeData(m.get()));
    double last = 0;
    int changes = 0;
    for (int i = 0; i < 20 / c.step_s; ++i) {
      d->ctrl[0] = 0.8 * std::sin(2 * std::numbers::pi * 0.5 * d->time);
      mj_step(m.get(), d.get());
      if (std::abs(d->qvel[0]) < 1e-5) continue;  // at rest
      if (last * d->qvel[0] < 0) ++changes;
      last = d->qvel[0];
    }
    turns.push_back(changes);
  }
  for (const int count : turns) EXPECT_EQ(count, turns.front());
  EXPECT_EQ(turns.front(), 19);  // 10 periods of the drive, each with a turn to either side
}

}  // namespace
}  // namespace gapscope::test
