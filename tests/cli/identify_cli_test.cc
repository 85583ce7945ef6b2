// `gapscope identify` as a user runs it.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

class IdentifyCliTest : public ::testing::Test {
 protected:
  Answer Run(const std::string& arguments) const {
    return scratch_.Shell("'" GAPSCOPE_PROGRAM "' identify " + arguments);
  }
  std::string Rig(const std::string& name) {
    return "'" + std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + name + "/experiment.yaml'";
  }
  // A joint that follows a sweep: angle and torque as formulas.
  std::string ServoLog(double seconds) {
    std::string text = "time_s,target_rad,position_rad,torque_n_m\n";
    char line[128];
    for (int k = 0; k <= seconds * 500; ++k) {
      const double t = 0.002 * k, phase = 3 * t + 1.5 * t * t, q = 0.3 * std::sin(phase),
                   v = 0.3 * std::cos(phase) * (3 + 3 * t), target = 0.4 * std::sin(phase + 0.3);
      std::snprintf(line, sizeof line, "%.4f,%.9g,%.9g,%.9g\n", t, target, q, 50 * (target - q) - 2 * v);
      text += line;
    }
    return scratch_.Write("servo.csv", text);
  }
  Scratch scratch_;
};

TEST_F(IdentifyCliTest, PdPrintsJsonAndWritesPoints) {
  const std::string log = ServoLog(10), out = scratch_.Path("out");
  const Answer answer = Run("pd " + Rig("joint") + " '" + log + "' --json --out '" + out + "'");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["schema"], "gapscope.identify.pd/1");
  EXPECT_NEAR(json["values"]["kp"]["value"].get<double>(), 50, 1.5);
  EXPECT_EQ(json["values"]["kp"]["unit"], "N m/rad");
  EXPECT_LE(json["values"]["kp"]["low"].get<double>(), json["values"]["kp"]["value"].get<double>());
  EXPECT_GT(json["fit"]["r2"].get<double>(), 0.99);
  EXPECT_EQ(json["logs"][0], log);
  for (const char* file : {"result.json", "delay_scan.csv", "by_error.csv"})
    EXPECT_TRUE(std::filesystem::exists(out + "/" + file)) << file;
}

TEST_F(IdentifyCliTest, SaysWhatIsNotFit) {
  const std::string log = ServoLog(10), brief = [&] {
    const std::string path = scratch_.Path("brief.csv");
    std::filesystem::copy_file(ServoLog(0.05), path);
    return path;
  }();
  ServoLog(10);
  for (const auto& [arguments, says] : std::initializer_list<std::pair<std::string, std::string>>{
           {"pd " + Rig("joint") + " '" + brief + "'", "too few rows"},
           {"pd " + Rig("joint") + " '" + log + "' --from 60", "too few rows"},
           {"inertia " + Rig("joint") + " '" + log + "' --from 60", "too short"},
           {"inertia " + Rig("joint") + " '" + log + "' --joint elbow", "no such joint"},
           {"torque-constant " + Rig("joint") + " '" + log + "'", "no column 'current_a'"},
           {"torque-constant " + Rig("joint") + " '" + log + "' --current-unit furlong", "unknown unit"},
           {"resistance " + Rig("joint") + " '" + log + "'", "commanded by voltage"},
           {"ring-down " + Rig("joint") + " '" + log + "'", "without a command"},
           {"state-space " + Rig("joint") + " '" + log + "'", "flexible joint"},
           {"resonance " + Rig("joint") + " '" + log + "'", "no joint with a spring"},
           {"steady " + Rig("joint") + " '" + log + "'", "settled speeds"},
           {"pd " + Rig("joint") + " nowhere.csv", "nowhere.csv"},
           {"friction " + Rig("joint") + " '" + log + "' --cutoff nan", "--cutoff"},
       }) {
    const Answer answer = Run(arguments);
    EXPECT_EQ(answer.status, 2) << arguments << "\n" << answer.err;
    EXPECT_NE(answer.err.find(says), std::string::npos) << arguments << "\n" << answer.err;
    EXPECT_EQ(answer.out, "") << arguments;
  }
}

}  // namespace
}  // namespace gapscope::testing
