// The built program on logs of the independent twin whose gear runs out of true: a candidate that only the experiment
// file states is found, and the exported model moves as the program said.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

constexpr double kAmplitude_n_m = 4, kPhase_rad = -0.6;  // the twin's sine is of angle + 0.6

class OwnCandidateTest : public ::testing::Test {
 protected:
  OwnCandidateTest() {
    const Answer made =
        scratch_.Shell("'" GAPSCOPE_TWIN
                       "' --rig joint --nominal --seed 5 --excitation multisine --excitation triangle --duration 6 "
                       "--rate 250 --set cogging@joint.amplitude_n_m=4 --set cogging@joint.periods_per_rev=1 --set "
                       "cogging@joint.phase_rad=0.6 --set cogging@joint.second_share=0 --out '" +
                       scratch_.Path("twin") + "'");
    EXPECT_EQ(made.status, 0) << made.err;
  }
  Answer Run(const std::string& command, const std::string& experiment, const std::string& flags) {
    std::string line = "'" GAPSCOPE_PROGRAM "' " + command + " '" + experiment + "'";
    for (const char* log : {"log_0.csv", "log_1.csv"}) line += " '" + scratch_.Path("twin/") + log + "'";
    return scratch_.Shell(line + " --json --quiet " + flags);
  }
  const std::string experiment_ = GAPSCOPE_SOURCE_DIR "/models/joint/gear_eccentricity.yaml";
  Scratch scratch_;
};

TEST_F(OwnCandidateTest, IsNamedAndSizedByADiagnosis) {
  const Answer answer = Run("diagnose", experiment_, "--effort quick --no-next-experiment");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto result = nlohmann::json::parse(answer.out);
  EXPECT_EQ(result["verdict"], "effects");
  ASSERT_EQ(result["effects"].size(), 1u) << result["effects"];
  const auto& found = result["effects"][0];
  EXPECT_EQ(found["name"], "gear_eccentricity");
  EXPECT_EQ(found["on"], "joint");
  for (const auto& [key, truth] : {std::pair{"amplitude_n_m", kAmplitude_n_m}, {"phase_rad", kPhase_rad}}) {
    const auto& size = found["parameters"][key];
    EXPECT_LE(size["low"].get<double>(), truth) << size;
    EXPECT_GE(size["high"].get<double>(), truth) << size;
    EXPECT_NEAR(size["value"].get<double>(), truth, 0.1 * std::abs(truth)) << size;
  }
  for (const auto& candidate : result["candidates"]) EXPECT_NE(candidate["name"], "cogging");
}

// A plugin that was tried and ran well crashes in the middle of the search.
TEST_F(OwnCandidateTest, OneThatCrashesLateIsLeftOut) {
  const std::string robot = scratch_.Write("late.yaml", R"(model: )" GAPSCOPE_SOURCE_DIR R"(/models/joint/joint.xml
log: {time: {column: time_s, unit: s}}
commands:
  - {actuator: motor, column: target_rad, unit: rad}
measured:
  - {signal: position_rad, column: position_rad, joint: joint, unit: rad}
candidates:
  - name: late
    joint: joint
    plugin: faulty.late
    parameters: {size: {unit: N m/rad, bounds: [0, 20], trials: [1, 5]}}
)");
  const std::string out = scratch_.Path("out");
  const Answer answer =
      Run("diagnose", robot,
          "--effort quick --no-next-experiment --plugin '" GAPSCOPE_FAULTY_PLUGINS "' --out '" + out + "'");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_NE(answer.err.find("the run crashed (Segmentation fault)"), std::string::npos) << answer.err;
  const auto result = nlohmann::json::parse(answer.out);
  ASSERT_EQ(result["left_out"].size(), 1u);
  EXPECT_NE(result["left_out"][0]["why"].get<std::string>().find("crashed with it"), std::string::npos);
  EXPECT_FALSE(result["statements"].empty());
  EXPECT_TRUE(std::filesystem::exists(out + "/report.html"));
}

TEST_F(OwnCandidateTest, ExportedModelReplaysAlike) {
  const std::string out = scratch_.Path("out");
  const Answer ours = Run("replay", experiment_,
                          "--with gear_eccentricity --set gear_eccentricity@joint.amplitude_n_m=4 --set "
                          "gear_eccentricity@joint.phase_rad=-0.6 --time-step 0.002 --out '" +
                              out + "'");
  ASSERT_EQ(ours.status, 0) << ours.err;
  const std::string bare = scratch_.Write("bare.yaml", R"(model: out/model.xml
log: {time: {column: time_s, unit: s}}
commands:
  - {actuator: motor, column: target_rad, unit: rad}
measured:
  - {signal: position_rad, column: position_rad, joint: joint, unit: rad}
  - {signal: velocity_rad_per_s, column: velocity_rad_per_s, kind: velocity, joint: joint, unit: rad/s}
  - {signal: torque_n_m, column: torque_n_m, kind: torque, actuator: motor, unit: N m}
)");
  const Answer theirs = Run("replay", bare, "--time-step 0.002");
  ASSERT_EQ(theirs.status, 0) << theirs.err;
  const auto a = nlohmann::json::parse(ours.out), b = nlohmann::json::parse(theirs.out);
  constexpr double kPrinted = 1e-5;  // what MuJoCo's writer leaves of a number
  EXPECT_NEAR(a["error"].get<double>(), b["error"].get<double>(), kPrinted * a["error"].get<double>());
}

}  // namespace
}  // namespace gapscope::testing
