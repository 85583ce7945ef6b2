// An effect is known by what its own file says: one that no other file names is found in --with, in the help, in a
// diagnosis, in the report and in the exported model.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

const std::string kSource = GAPSCOPE_SOURCE_DIR;

class StrangeEffectTest : public ::testing::Test {
 protected:
  // Two seconds of the demo's log.
  StrangeEffectTest() {
    const std::string log = ReadAll(kSource + "/demo/qube.csv");
    std::size_t end = 0;
    for (int row = 0; row < 1000; ++row) end = log.find('\n', end) + 1;
    log_ = scratch_.Write("log.csv", log.substr(0, end));
  }
  Answer Run(const std::string& command, const std::string& flags) {
    return scratch_.Shell("'" GAPSCOPE_STRANGE_PROGRAM "' " + command + " '" + kSource +
                          "/models/qube/experiment.yaml' '" + log_ + "' --quiet --json " + flags);
  }
  Scratch scratch_;
  std::string log_;
};

TEST_F(StrangeEffectTest, IsInTheHelpAndAmongWhatIsAllowed) {
  EXPECT_NE(Run("replay", "--help").out.find("creaking_hinge"), std::string::npos);
  const Answer refused = Run("replay", "--with creeking_hinge");
  EXPECT_EQ(refused.status, 2);
  EXPECT_NE(refused.err.find("did you mean 'creaking_hinge'?"), std::string::npos) << refused.err;
}

TEST_F(StrangeEffectTest, IsReplayedReportedAndExported) {
  const std::string out = scratch_.Path("out"), with = "--with creaking_hinge@arm --set creaking_hinge@arm.loop_n_m=";
  const Answer plain = Run("replay", ""), creaking = Run("replay", with + "0.0009765625 --out '" + out + "'");
  ASSERT_EQ(creaking.status, 0) << creaking.err;
  const auto result = nlohmann::json::parse(creaking.out);
  EXPECT_NE(result["error"], nlohmann::json::parse(plain.out)["error"]);
  EXPECT_EQ(result["effects"][0], nlohmann::json({{"name", "creaking_hinge"}, {"on", "arm"}}));
  EXPECT_EQ(result["parameters"]["creaking_hinge@arm.loop_n_m"], 0.0009765625);
  EXPECT_NE(ReadAll(out + "/report.html").find("a hinge that creaks"), std::string::npos);
  const std::string xml = ReadAll(out + "/model.xml");
  EXPECT_NE(xml.find("name=\"arm.spring.hysteresis_n_m\" size=\"1\" data=\"0.000976562\""), std::string::npos) << xml;
}

TEST_F(StrangeEffectTest, IsACandidateOfADiagnosis) {
  const Answer answer = Run("diagnose", "--budget 10");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto candidates = nlohmann::json::parse(answer.out)["candidates"];
  EXPECT_TRUE(std::any_of(candidates.begin(), candidates.end(), [](const auto& candidate) {
    return candidate["name"] == "creaking_hinge" && candidate.value("on", "") == "arm";
  })) << candidates;
}

}  // namespace
}  // namespace gapscope::testing
