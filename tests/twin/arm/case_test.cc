// Cases of arms: labels, and the same bytes for the same arguments.
#include "tests/twin/arm/case.h"

#include <gtest/gtest.h>

#include <nlohmann/json.hpp>

namespace gapscope::twin {
namespace {

CaseRequest Request(Kind kind, const std::string& effect) {
  CaseRequest request;
  request.seed = 21;
  request.index = 4;
  request.kind = kind;
  request.effect = effect;
  return request;
}

ArmCase Made(const CaseRequest& request, ArmRig rig) {
  ArmCase c;
  std::string problem;
  EXPECT_TRUE(MakeArmCase(request, rig, &c, &problem)) << problem;
  return c;
}

TEST(ArmCaseTest, SameArgumentsSameBytes) {
  const CaseRequest request = Request(Kind::kRough, "coulomb_friction@elbow");
  const ArmCase a = Made(request, ArmRig::kArm2), b = Made(request, ArmRig::kArm2);
  EXPECT_EQ(LabelText(LabelOf(a), {}), LabelText(LabelOf(b), {}));
  const ArmRecord first = MakeArmRecords(a, true, 1e-3)[0], second = MakeArmRecords(b, true, 1e-3)[0];
  EXPECT_EQ(CsvText(first.names, first.rows), CsvText(second.names, second.rows));
}

TEST(ArmCaseTest, RoughLabelHoldsEffectAndRoughnessOnEveryJoint) {
  const ArmCase c = Made(Request(Kind::kRough, "payload"), ArmRig::kArm2);
  const auto label = nlohmann::json::parse(LabelText(LabelOf(c), {"log_0.csv"}));
  EXPECT_EQ(label["schema"], "gapscope.twin.label/1");
  EXPECT_EQ(label["rig"], "arm2");
  EXPECT_EQ(label["effects"][0]["name"], "payload");
  EXPECT_EQ(label["effects"][0]["on"], "forearm");
  EXPECT_GT(label["effects"][0]["parameters"]["mass_kg"], 0);
  EXPECT_GE(label["effects"][0]["effect_to_floor_refit"], 2.4);
  EXPECT_TRUE(label["effects"][0].contains("stands_clear"));
  ASSERT_EQ(label["roughness"].size(), 2u);
  EXPECT_EQ(label["roughness"][0]["on"], "shoulder");
  EXPECT_GT(label["roughness"][1]["to_floor_refit"], 0.5);
  EXPECT_TRUE(label["base"].contains("forearm.mass"));
  EXPECT_TRUE(label["sensors"].contains("elbow_rad"));
  EXPECT_EQ(label["logs"].size(), 4u);
}

TEST(ArmCaseTest, AbsentEffectPlaceOrKindIsSaid) {
  ArmCase c;
  std::string problem;
  EXPECT_FALSE(MakeArmCase(Request(Kind::kSingle, "coulomb_friction@wrist1"), ArmRig::kArm2, &c, &problem));
  EXPECT_EQ(problem, "effect 'coulomb_friction@wrist1' does not exist on rig arm2");
  problem.clear();
  EXPECT_FALSE(MakeArmCase(Request(Kind::kAmbiguous, ""), ArmRig::kArm2, &c, &problem));
  EXPECT_NE(problem.find("none, single, pair, triple, rough"), std::string::npos) << problem;
}

}  // namespace
}  // namespace gapscope::twin
