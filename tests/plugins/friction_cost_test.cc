// What gapscope.friction and gapscope.spring cost per step, as a ratio to the same model without them: native
// frictionloss on the same row, no spring. Both sides in turn in the same run, the least of many rounds.
#include <algorithm>
#include <array>
#include <chrono>
#include <cmath>
#include <cstdio>
#include <limits>
#include <vector>

#include "tests/plugins/friction_fixture.h"

namespace gapscope::test {
namespace {

constexpr double kNeutralTarget = 1.25, kActiveTarget = 1.6;  // of the design

struct Side {
  ModelPtr m;
  DataPtr d;
  double best_s = std::numeric_limits<double>::infinity();

  explicit Side(const std::string& xml) : m(Compile(xml)), d(mj_makeData(m.get())) {}
  void Round(int steps) {
    const auto start = std::chrono::steady_clock::now();
    for (int i = 0; i < steps; ++i) {
      d->ctrl[0] = std::sin(0.01 * i);
      mj_step(m.get(), d.get());
    }
    best_s = std::min(best_s, std::chrono::duration<double>(std::chrono::steady_clock::now() - start).count() / steps);
  }
};

double Ratio(const char* name, const std::string& with, const std::string& without) {
  Side ours(with), native(without);
  for (int round = 0; round < 200; ++round) {
    native.Round(500);
    ours.Round(500);
  }
  std::printf("%-34s %.3f us, without %.3f us, ratio %.3f\n", name, 1e6 * ours.best_s, 1e6 * native.best_s,
              ours.best_s / native.best_s);
  return ours.best_s / native.best_s;
}

JointModel Servo(const std::string& config, bool plugin) {
  JointModel joint{.step_s = 0.002, .integrator = "implicitfast", .mass = 0.3, .length = 0.1};
  joint.config = config;
  joint.with_plugin = plugin;
  joint.frictionloss = plugin ? 1e-9 : 0.1;
  joint.joint = "damping=\"0.01\"";
  joint.actuators = "<position joint=\"j\" kp=\"3\"/>";
  return joint;
}

TEST(FrictionCostTest, Friction) {
  const std::string native = Servo("", false).Xml();
  EXPECT_LT(Ratio("friction, Coulomb only", Servo(Config("friction_n_m", 0.1), true).Xml(), native), kNeutralTarget);
  const std::string coulomb = Config("friction_n_m", 0.1) + Config("row_softness", 0.01);
  EXPECT_LT(Ratio("friction, stiff row", Servo(coulomb, true).Xml(), native), kNeutralTarget);
  const std::string all = coulomb + Config("breakaway_n_m", 0.15) + Config("stribeck_exponent", 1.5) +
                          Config("viscous_n_m_s_per_rad", 0.01) + Config("quadratic_n_m_s2_per_rad2", 0.001) +
                          Config("load_coefficient", 0.1) + Config("load_quadratic", 0.1) +
                          Config("friction_positive_n_m", 0.01) + Config("friction_negative_n_m", 0.02) +
                          Config("viscous_negative_n_m_s_per_rad", 0.002) + Config("backdrive_factor", 0.5) +
                          Config("load", "gearbox");
  EXPECT_LT(Ratio("friction, all active", Servo(all, true).Xml(), native), kActiveTarget);
  JointModel free = Servo("", false);
  free.frictionloss = 0;
  JointModel lugre = Servo(
      all + Config("model", "lugre") + Config("sigma0_n_m_per_rad", 20) + Config("sigma1_n_m_s_per_rad", 0.01), true);
  lugre.frictionloss = 0;
  EXPECT_LT(Ratio("friction, LuGre, all active", lugre.Xml(), free.Xml()), kActiveTarget);
}

TEST(FrictionCostTest, Spring) {
  const auto model = [](const std::string& config, bool plugin) {
    JointModel joint = Servo("", false);
    joint.frictionloss = 0;
    std::string xml = joint.Xml();
    if (!plugin) return xml;
    xml.insert(xml.find("<custom>"), "<extension><plugin plugin=\"gapscope.spring\"><instance name=\"s\">" +
                                         Config("joint", "j") + config + "</instance></plugin></extension>");
    return xml.insert(xml.find("</body>"), "<plugin plugin=\"gapscope.spring\" instance=\"s\"/>");
  };
  const std::string all = Config("stiffness_n_m_per_rad", 1) + Config("hysteresis_n_m", 0.02) +
                          Config("cubic_n_m_per_rad3", 0.1) + Config("gravity_n_m", 0.1) + Config("bias_n_m", 0.1) +
                          Config("cogging_n_m", 0.01) + Config("cogging_second_n_m", 0.01);
  EXPECT_LT(Ratio("spring, neutral", model("", true), model("", false)), kNeutralTarget);
  EXPECT_LT(Ratio("spring, all active", model(all, true), model("", false)), kActiveTarget);
}

}  // namespace
}  // namespace gapscope::test
