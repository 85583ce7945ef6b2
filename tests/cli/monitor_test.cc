// The built program on days of the independent twin: the same as before, another friction, a delay that is new.
#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

class MonitorTest : public ::testing::Test {
 protected:
  // A day's log of the twin, with friction and delay as told.
  std::string Day(int day, const std::string& friction, const std::string& delay = "0") {
    const std::string folder = scratch_.Path("day" + std::to_string(day));
    const Answer made = scratch_.Shell(
        "'" GAPSCOPE_TWIN "' --rig joint --nominal --seed 4 --index " + std::to_string(day) +
        " --excitation multisine --duration 1 --rate 200 --set coulomb_friction@joint.friction_n_m=" + friction +
        (delay == "0" ? "" : " --set command_delay@motor.delay_s=" + delay) + " --out '" + folder + "'");
    EXPECT_EQ(made.status, 0) << made.err;
    return "'" + folder + "/log_0.csv'";
  }
  Answer Run(const std::string& arguments) { return scratch_.Shell("'" GAPSCOPE_PROGRAM "' " + arguments); }

  Scratch scratch_;
};

TEST_F(MonitorTest, TellsTheSameFromAnotherSizeAndFromANewEffect) {
  const std::string result = "'" + scratch_.Path("result") + "'";
  std::string logs;
  for (const int day : {1, 2, 3, 4, 5}) logs += " " + Day(day, "0.5");
  ASSERT_EQ(Run("tune '" GAPSCOPE_SOURCE_DIR "/models/joint/experiment.yaml'" + logs +
                " --with coulomb_friction@joint --starts 1 --quiet --out " + result)
                .status,
            0);
  const auto ask = [&](const std::string& log, int status) {
    const Answer answer = Run("monitor " + result + " " + log + " --fail-on-change --quiet --json");
    EXPECT_EQ(answer.status, status) << answer.out << answer.err;
    return nlohmann::json::parse(answer.out);
  };
  const auto same = ask(Day(6, "0.5"), 0);
  EXPECT_FALSE(same.at("changed"));
  EXPECT_FALSE(same.at("left").contains("diagnosis"));

  const auto rubs = ask(Day(7, "1"), 1);
  EXPECT_EQ(rubs.at("parameters").at(0).at("name"), "coulomb_friction@joint.friction_n_m");
  EXPECT_NEAR(rubs.at("parameters").at(0).at("now"), 1, 0.1);
  EXPECT_FALSE(rubs.at("left").contains("diagnosis"));

  const auto late = ask(Day(8, "0.5", "0.02"), 1);
  EXPECT_GT(late.at("left").at("now"), 3 * late.at("left").at("before").get<double>());
  const std::string command = late.at("left").at("diagnosis");
  EXPECT_NE(command.find("--with coulomb_friction@joint --params"), std::string::npos) << command;
}

}  // namespace
}  // namespace gapscope::testing
