// gapscope.friction and gapscope.spring as guests of any host: refusals, threads, resets, saved states, memory.
#include <malloc.h>

#include <atomic>
#include <cmath>
#include <cstdlib>
#include <cstring>
#include <new>
#include <thread>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace {
std::atomic<long> allocations{0};
}  // namespace

[[gnu::noinline]] void* operator new(std::size_t size) {
  ++allocations;
  if (void* p = std::malloc(size ? size : 1)) return p;
  throw std::bad_alloc();
}
[[gnu::noinline]] void operator delete(void* p) noexcept { std::free(p); }
[[gnu::noinline]] void operator delete(void* p, std::size_t) noexcept { std::free(p); }

namespace gapscope::test {
namespace {

// Two joints, load and direction, LuGre, and a spring with hysteresis, all on.
std::string Everything(const std::string& integrator) {
  return "<mujoco><option timestep=\"0.002\" integrator=\"" + integrator +
         "\"/><extension><plugin plugin=\"gapscope.friction\"><instance name=\"f\">" + Config("joint", "j") +
         Config("friction_n_m", 0.2) + Config("breakaway_n_m", 0.3) + Config("load_coefficient", 0.1) +
         Config("friction_positive_n_m", 0.05) + Config("viscous_n_m_s_per_rad", 0.01) + Config("load", "gearbox") +
         Config("row_softness", 0.1) + "</instance><instance name=\"l\">" + Config("joint", "k") +
         Config("model", "lugre") + Config("friction_n_m", 0.02) + Config("sigma0_n_m_per_rad", 5) +
         Config("sigma1_n_m_s_per_rad", 0.01) +
         "</instance></plugin><plugin plugin=\"gapscope.spring\"><instance name=\"s\">" + Config("joint", "j") +
         Config("stiffness_n_m_per_rad", 0.3) + Config("hysteresis_n_m", 0.1) + Config("cogging_n_m", 0.02) +
         "</instance></plugin></extension><worldbody><body><joint name=\"j\" axis=\"0 1 0\" frictionloss=\"1e-6\" " +
         StiffRow(0.002) +
         "/><geom type=\"capsule\" size=\"0.02\" fromto=\"0 0 0 0.3 0 0\"/><plugin plugin=\"gapscope.friction\" "
         "instance=\"f\"/>"
         "<body pos=\"0.3 0 0\"><joint name=\"k\" axis=\"0 1 0\"/><geom type=\"capsule\" size=\"0.02\" fromto=\"0 0 0 "
         "0.2 0 0\"/>"
         "<plugin plugin=\"gapscope.friction\" instance=\"l\"/></body></body><body><plugin plugin=\"gapscope.spring\" "
         "instance=\"s\"/></body></worldbody>"
         "<actuator><motor joint=\"j\" gear=\"3\"/><plugin joint=\"j\" plugin=\"gapscope.friction\" "
         "instance=\"f\"/></actuator></mujoco>";
}

std::vector<mjtNum> StepOn(const mjModel* m, mjData* d, int from, int to) {
  std::vector<mjtNum> path;
  path.reserve(4 * static_cast<std::size_t>(to - from));
  for (int i = from; i < to; ++i) {
    d->ctrl[0] = std::sin(0.02 * i);
    mj_step(m, d);
    path.insert(path.end(), {d->qpos[0], d->qpos[1], d->qvel[0], d->qvel[1]});
  }
  return path;
}

TEST(FrictionHostTest, ResetRepeatsBitForBit) {
  for (const char* integrator : {"Euler", "implicitfast", "RK4"}) {
    const ModelPtr m = Compile(Everything(integrator));
    const DataPtr d(mj_makeData(m.get()));
    const auto first = StepOn(m.get(), d.get(), 0, 500);
    mj_resetData(m.get(), d.get());
    EXPECT_EQ(StepOn(m.get(), d.get(), 0, 500), first) << integrator;
  }
}

// The plugins' memory is part of the state: another mjData goes on from it bit for bit.
TEST(FrictionHostTest, SavedStateContinuesElsewhereBitForBit) {
  for (const char* integrator : {"Euler", "implicitfast", "RK4"}) {
    const ModelPtr m = Compile(Everything(integrator));
    const DataPtr a(mj_makeData(m.get())), b(mj_makeData(m.get()));
    StepOn(m.get(), a.get(), 0, 300);
    StepOn(m.get(), b.get(), 100, 250);  // other leftovers
    std::vector<mjtNum> state(mj_stateSize(m.get(), mjSTATE_INTEGRATION));
    mj_getState(m.get(), a.get(), state.data(), mjSTATE_INTEGRATION);
    mj_setState(m.get(), b.get(), state.data(), mjSTATE_INTEGRATION);
    EXPECT_EQ(StepOn(m.get(), a.get(), 300, 500), StepOn(m.get(), b.get(), 300, 500)) << integrator;
  }
}

TEST(FrictionHostTest, TwoDataInTwoThreads) {
  const ModelPtr m = Compile(Everything("implicitfast"));
  const DataPtr a(mj_makeData(m.get())), b(mj_makeData(m.get())), alone(mj_makeData(m.get()));
  std::vector<mjtNum> first, second;
  std::thread one([&] { first = StepOn(m.get(), a.get(), 0, 1000); });
  std::thread two([&] { second = StepOn(m.get(), b.get(), 50, 1050); });
  one.join();
  two.join();
  EXPECT_EQ(StepOn(m.get(), alone.get(), 0, 1000), first);
  mj_resetData(m.get(), alone.get());
  EXPECT_EQ(StepOn(m.get(), alone.get(), 50, 1050), second);
}

TEST(FrictionHostTest, SteppingAllocatesNothing) {
  for (const char* integrator : {"implicitfast", "RK4"}) {
    const ModelPtr m = Compile(Everything(integrator));
    const DataPtr d(mj_makeData(m.get()));
    for (int i = 0; i < 10; ++i) mj_step(m.get(), d.get());
    const long before = allocations;
    const auto in_use = mallinfo2().uordblks;
    for (int i = 0; i < 1000; ++i) {
      d->ctrl[0] = std::sin(0.02 * i);
      mj_step(m.get(), d.get());
    }
    EXPECT_EQ(allocations - before, 0);
    EXPECT_EQ(mallinfo2().uordblks, in_use);
  }
}

TEST(FrictionHostTest, WrongAttributesAreRefusedWithACure) {
  struct Case {
    std::string config, numeric;
    std::vector<std::string> says;
  };
  const std::vector<Case> cases = {
      {Config("friction_n_m", "-1"), "", {"instance 'f'", "friction_n_m", "-1", "allowed 0", "N m", "leave it out"}},
      {Config("friction_n_m", "much"), "", {"friction_n_m", "'much'", "number", "N m"}},
      {Config("friction_n_m", "0.1x"), "", {"friction_n_m", "0.1x"}},
      {"", Numeric("viscous_n_m_s_per_rad", -0.5), {"instance 'f'", "viscous_n_m_s_per_rad", "-0.5", "allowed 0"}},
      {Config("stribeck_exponent", 0), "", {"stribeck_exponent", "allowed 0.1"}},
      {Config("row_softness", 2), "", {"row_softness", "allowed 0.01", "to 1"}},
      {Config("load", "belt"), "", {"instance 'f'", "'load'", "belt", "motor, gearbox", "leave it out"}},
      {Config("model", "dahl"), "", {"'model'", "dahl", "dry, lugre"}},
      {Config("model", "lugre"), "", {"sigma0_n_m_per_rad", "above 0", "set it"}},
      {"", Numeric("friction", 0.1), {"instance 'f'", "f.friction", "friction_n_m", "correct the key"}}};
  for (const Case& c : cases) {
    JointModel joint;
    joint.config = c.config, joint.numeric = c.numeric;
    std::string error;
    EXPECT_EQ(Compile(joint.Xml(), &error), nullptr) << c.config << c.numeric;
    for (const std::string& text : c.says)
      EXPECT_NE(error.find(text), std::string::npos) << "'" << text << "' in: " << error;
  }
  // The joint: none, unknown, of another type; a second instance on it; no row to rewrite.
  const std::string good = JointModel{}.Xml();
  const auto refused = [&](const std::string& from, const std::string& to, const std::string& says) {
    std::string xml = good, error;
    ASSERT_NE(xml.find(from), std::string::npos) << from;
    xml.replace(xml.find(from), from.size(), to);
    EXPECT_EQ(Compile(xml, &error), nullptr);
    EXPECT_NE(error.find(says), std::string::npos) << error;
    EXPECT_NE(error.find("instance 'f'"), std::string::npos) << error;
  };
  refused(Config("joint", "j"), "", "hinge or slide joint (j)");
  refused(Config("joint", "j"), Config("joint", "arm"), "'arm', allowed the name of a hinge or slide joint (j)");
  refused("frictionloss=\"1.0000000000000001e-09\"", "", "set frictionloss=\"1e-9\"");
  refused("</instance>", "</instance><instance name=\"g\">" + Config("joint", "j") + "</instance>",
          "one gapscope.friction per joint");
  refused("type=\"hinge\" axis=\"0 -1 0\" frictionloss=\"1.0000000000000001e-09\"", "type=\"ball\"", "none named");
}

// A host may put into a finished model what the XML may not hold: that must never end it.
TEST(FrictionHostTest, EditedModelsWarnAndAreNeutral) {
  JointModel joint;
  joint.numeric = Numeric("friction_n_m", 0.1);
  const ModelPtr m = Compile(joint.Xml());
  Live(m.get(), "f.friction_n_m") = -1;  // a tuner's trial
  const DataPtr below(mj_makeData(m.get()));
  ASSERT_NE(below, nullptr);
  mj_step(m.get(), below.get());
  EXPECT_EQ(FrictionForce(below.get()), 0);

  static int warnings;
  warnings = 0;
  auto* old = mju_user_warning;
  mju_user_warning = [](const char* text) { warnings += std::strstr(text, "set frictionloss") != nullptr; };
  m->dof_frictionloss[0] = 0;
  const DataPtr without(mj_makeData(m.get()));
  mju_user_warning = old;
  ASSERT_NE(without, nullptr);
  EXPECT_EQ(warnings, 1);
  without->qvel[0] = 1;
  mj_step(m.get(), without.get());
  EXPECT_EQ(without->qvel[0], 1);
}

}  // namespace
}  // namespace gapscope::test
