// `gapscope design` as a user runs it.
#include <gtest/gtest.h>
#include <sys/wait.h>

#include <filesystem>
#include <fstream>
#include <nlohmann/json.hpp>
#include <sstream>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

class DesignCliTest : public ::testing::Test {
 protected:
  Answer Run(const std::string& arguments) const {
    return scratch_.Shell("'" GAPSCOPE_PROGRAM "' design " + arguments);
  }
  std::string Rig(const std::string& name) {
    return "'" + std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + name + "/experiment.yaml'";
  }
  Scratch scratch_;
};

TEST_F(DesignCliTest, ChirpJsonIsUnrounded) {
  const Answer answer =
      Run("chirp --inertia-kg-m2 0.159221308 --natural-frequency-hz 5 --damping-ratio 0.707,1.2,2 --speed-limit-rpm "
          "116 --amplitude-factor 0.8 --end-over-bandwidth 2,3,5 --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["schema"], "gapscope.design.chirp/1");
  ASSERT_EQ(json["rows"].size(), 3u);
  const auto& row = json["rows"][1];
  EXPECT_EQ(row["damping_ratio"], 1.2);
  // J w^2 with w = 10 pi, and what follows, in closed form.
  const double pi = 3.14159265358979323846, kp = 0.159221308 * 100 * pi * pi, z2 = 1.44;
  EXPECT_NEAR(row["kp_n_m_per_rad"].get<double>(), kp, 1e-12 * kp);
  const double bandwidth = 5 * std::sqrt(1 - 2 * z2 + std::sqrt(4 * z2 * z2 - 4 * z2 + 2));
  EXPECT_NEAR(row["bandwidth_hz"].get<double>(), bandwidth, 1e-12);
  ASSERT_EQ(row["chirps"].size(), 3u);
  EXPECT_NEAR(row["chirps"][2]["end_frequency_hz"].get<double>(), 5 * bandwidth, 1e-11);
  EXPECT_NEAR(row["chirps"][2]["amplitude_deg"].get<double>(), 0.8 * 116 * 6 / (2 * pi * 5 * bandwidth), 1e-11);
}

TEST_F(DesignCliTest, SquareOfTheFlexibleJointIsWritten) {
  const std::string file = scratch_.Path("square.csv");
  const Answer answer = Run("square " + Rig("flexjoint") + " --out '" + file + "' --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_NEAR(1 / json["low_hz"].get<double>(), 0.63, 1e-12);
  for (const auto& limit : json["limits"])
    EXPECT_LE(limit["reached"].get<double>(), 0.9001 * limit["limit"].get<double>()) << limit;
  std::ifstream csv(file);
  std::string header;
  std::getline(csv, header);
  EXPECT_EQ(header.substr(0, 17), "time_s,voltage_v,");
}

TEST_F(DesignCliTest, InputsPastTheLimitsAreRefusedWithTheAmplitudeThatKeepsThem) {
  const std::string file = scratch_.Path("never.csv");
  const Answer answer = Run("square " + Rig("flexjoint") + " --amplitude 9 --out '" + file + "'");
  EXPECT_EQ(answer.status, 2);
  EXPECT_NE(answer.err.find("link angle"), std::string::npos) << answer.err;
  const std::size_t at = answer.err.find("--amplitude ");
  ASSERT_NE(at, std::string::npos) << answer.err;
  EXPECT_FALSE(std::filesystem::exists(file));
  const double smaller = std::stod(answer.err.substr(at + 12));
  EXPECT_EQ(Run("square " + Rig("flexjoint") + " --amplitude " + std::to_string(smaller)).status, 0);
}

TEST_F(DesignCliTest, OptimalPrintsACommandThatWorks) {
  const Answer answer = Run("optimal " + Rig("flexlink") +
                            " --separate coulomb_friction@hub --separate torque_bias@hub --duration 3 --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["schema"], "gapscope.design.optimal/1");
  EXPECT_EQ(json["targets"].size(), 2u);
  EXPECT_GT(json["inputs"][0]["score"].get<double>(), 1);
  std::string command = json["command"];
  ASSERT_EQ(command.rfind("gapscope design ", 0), 0u);
  command = command.substr(std::string("gapscope design ").size());
  command.replace(command.find("input.csv"), 9, scratch_.Path("input.csv"));
  EXPECT_EQ(Run(command).status, 0) << command;
  EXPECT_TRUE(std::filesystem::exists(scratch_.Path("input.csv")));
}

// The Qube report's law and poles (docs/results/documents.md), with the arm of 0.04 kg that its gains imply.
TEST_F(DesignCliTest, StateFeedbackOfTheQubeReport) {
  const std::string up = Rig("qube") + " --at pendulum=3.141592653589793 --set arm.mass=0.04 --json";
  const Answer lqr = Run("lqr " + up + " --q 10,10,1,10 --r 1");
  ASSERT_EQ(lqr.status, 0) << lqr.err;
  const auto json = nlohmann::json::parse(lqr.out);
  EXPECT_EQ(json["schema"], "gapscope.design.feedback/1");
  EXPECT_NEAR(json["gain"][0].get<double>(), -std::sqrt(10.0), 1e-4);  // sqrt(q / r): printed as 3.1623
  EXPECT_NEAR(json["gain"][1].get<double>(), 53.2574, 0.01 * 53.2574);
  EXPECT_NEAR(json["closed_loop_poles"][3][0].get<double>(), -115.67, 0.01 * 115.67);
  const Answer poles = Run("poles " + up + " --poles=-2,-2.2,-15,-115");
  ASSERT_EQ(poles.status, 0) << poles.err;
  EXPECT_NEAR(nlohmann::json::parse(poles.out)["gain"][1].get<double>(), 74.6922, 0.01 * 74.6922);
  EXPECT_EQ(Run("poles " + up + " --poles=-2,-3+4i,-15,-115").status, 2);
  EXPECT_EQ(Run("poles " + up + " --poles=-2,x,-15,-115").status, 2);
  EXPECT_EQ(Run("lqr " + up + " --q 1,2").status, 2);
  EXPECT_EQ(Run("lqr " + Rig("qube") + " --at pendulum=1 --q 1,1,1,1").status, 2);
}

TEST_F(DesignCliTest, BadArgumentsAreBadInput) {
  const std::string rig = Rig("flexjoint");
  for (const std::string& arguments :
       {std::string("chirp"),
        std::string("chirp --inertia-kg-m2 nan --natural-frequency-hz 5 --damping-ratio 1 --speed-limit-rpm 100"),
        std::string("square nowhere.yaml"), "square " + rig + " --set link.stifness=1",
        "square " + rig + " --set cable_spring@base.stifness=1", "square " + rig + " --period 0.001", "optimal " + rig,
        "optimal " + rig + " --separate cable_spring@base",
        "optimal " + rig + " --separate cable_spring@base --separate cable_spring@base",
        "optimal " + rig + " --separate cable_spring@nowhere --separate none",
        "optimal " + rig + " --parameter motor.gear_ratio", "square " + Rig("xl330")}) {
    const Answer answer = Run(arguments);
    EXPECT_EQ(answer.status, 2) << arguments << "\n" << answer.err;
    EXPECT_NE(answer.err, "") << arguments;
    EXPECT_EQ(answer.out, "") << arguments;
  }
}

}  // namespace
}  // namespace gapscope::testing
