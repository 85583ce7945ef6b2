// The built program on logs of the independent twin: a cable that grows stiffer the farther it is pulled.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

struct Cable {
  double stiffness, cubic;
};

class CableTwinTest : public ::testing::TestWithParam<Cable> {};

TEST_P(CableTwinTest, TuneFindsStiffnessAndCubic) {
  const Scratch scratch;
  const Cable truth = GetParam();
  const std::string name = "cable_spring@arm.", rest = name + "rest_rad=-0.4",
                    known = " --set " + rest + " --set " + name +
                            "stiffness_n_m_per_rad=" + std::to_string(truth.stiffness) + " --set " + name +
                            "stiffness_cubic_n_m_per_rad3=" + std::to_string(truth.cubic),
                    experiment = GAPSCOPE_SOURCE_DIR "/models/qube/experiment.yaml";
  const Answer made = scratch.Shell("'" GAPSCOPE_TWIN
                                    "' --rig qube --nominal --seed 6 --excitation triangle "
                                    "--excitation multisine --low-hz 0.5 --duration 8 --out '" +
                                    scratch.Path("twin") + "'" + known);
  ASSERT_EQ(made.status, 0) << made.err;
  const std::string logs =
      "'" + scratch.Path("twin/log_0.csv") + "' --hold-out '" + scratch.Path("twin/log_1.csv") + "'";
  // The arm's zero and the cable's rest are one number where nothing else says where the arm is.
  std::string tune = "'" GAPSCOPE_PROGRAM "' tune '" + experiment + "' " + logs +
                     " --with cable_spring@arm --objective windows --starts 1 --json --quiet --set " + rest +
                     " --freeze " + name + "rest_rad";
  for (const char* base :
       {"motor.resistance", "motor.kt", "motor.km", "arm.mass", "pendulum.mass", "pendulum.length", "pendulum.damping"})
    tune += std::string(" --freeze ") + base;
  const Answer answer = scratch.Shell(tune);
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto result = nlohmann::json::parse(answer.out);
  int found = 0;
  for (const auto& p : result.at("parameters")) {
    const std::string key = p.at("name");
    const bool cubic = key == name + "stiffness_cubic_n_m_per_rad3";
    if (!cubic && key != name + "stiffness_n_m_per_rad") continue;
    const double value = p.at("value"), expected = cubic ? truth.cubic : truth.stiffness;
    EXPECT_NEAR(value, expected, cubic ? 2e-4 : 2e-5) << key;
    EXPECT_LE(p.at("low"), expected) << key;
    EXPECT_GE(p.at("high"), expected) << key;
    ++found;
  }
  EXPECT_EQ(found, 2);
}

INSTANTIATE_TEST_SUITE_P(Cables, CableTwinTest,
                         ::testing::Values(Cable{8e-4, 1.5e-3}, Cable{0, 1.5e-3}, Cable{8e-4, 0}),
                         [](const auto& test) {
                           return std::string(test.param.stiffness > 0 ? "Linear" : "") +
                                  (test.param.cubic > 0 ? "Cubic" : "");
                         });

}  // namespace
}  // namespace gapscope::testing
