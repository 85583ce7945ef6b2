// Rough cases: repeatable, their label as measured; three effects at once.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/twin/case.h"
#include "tests/twin/output.h"

namespace gapscope::twin {
namespace {

Case Make(Kind kind, const char* rig, const char* effect, std::uint64_t index) {
  CaseRequest request;
  request.seed = 6;
  request.index = index;
  request.kind = kind;
  request.rig = rig;
  request.effect = effect;
  Case made;
  std::string problem;
  EXPECT_TRUE(MakeCase(request, &made, &problem)) << problem;
  return made;
}

TEST(RoughCaseTest, SameRequestSameBytes) {
  const Case a = Make(Kind::kRough, "joint", "dead_zone", 1), b = Make(Kind::kRough, "joint", "dead_zone", 1);
  EXPECT_EQ(LabelText(a, {}), LabelText(b, {}));
  EXPECT_EQ(CsvText(MakeRecords(a, true, 5e-4)[0]), CsvText(MakeRecords(b, true, 5e-4)[0]));
}

TEST(RoughCaseTest, TheLabelsFloorsAreAsMeasured) {
  const Case c = Make(Kind::kRough, "joint", "dead_zone", 2);
  ASSERT_EQ(c.effects.size(), 1u);
  ASSERT_EQ(c.roughness.size(), 1u);
  const auto records = CoarseRecords(c.truth, c.logs, c.sensors, {});
  const auto directions = BaseDirections(c.rig);
  Plant without = c.truth;
  without.drive.dead_zone = 0;
  const double effect = MeasureGap(records, without, c.Floor(), directions, true, {}).refit;
  EXPECT_NEAR(c.effects[0].gap.refit / effect, 1, 0.1);
  // About the plant without roughness, in the logs that a diagnosis is given.
  Plant smooth = c.truth;
  smooth.rough = {};
  const std::vector<Record> given(records.begin(), records.end() - (records.size() > 3 ? 1 : 0));
  const double rough = MeasureGap(given, smooth, c.Floor(), directions, true, {}).refit;
  EXPECT_NEAR(c.rough_refit / rough, 1, 0.1);
  EXPECT_GT(c.roughness[0].alone, 1.2);
  EXPECT_LT(c.roughness[0].alone, 90);
  EXPECT_LE(c.effects[0].beside_torques, c.effects[0].gap.refit);
  const auto label = nlohmann::json::parse(LabelText(c, {}));
  EXPECT_EQ(label["kind"], "rough");
  EXPECT_EQ(label["roughness"][0]["on"], "joint");
  EXPECT_EQ(label["roughness"][0]["terms"].size(), c.truth.rough[0].terms.size());
  EXPECT_EQ(label["effects"][0]["stands_clear"], c.effects[0].clear);
}

TEST(RoughCaseTest, EveryJointIsRough) {
  const Case c = Make(Kind::kRough, "flexlink", "coulomb_friction@hub", 3);
  EXPECT_EQ(c.roughness.size(), 2u);
  EXPECT_TRUE(c.truth.rough[0].Any() && c.truth.rough[1].Any());
  EXPECT_FALSE(c.base.rough[0].Any());
}

TEST(TripleCaseTest, HoldsThreeEffectsThatShow) {
  const Case c = Make(Kind::kTriple, "flexlink", "", 4);
  ASSERT_EQ(c.effects.size(), 3u);
  for (const EffectLabel& e : c.effects) EXPECT_GT(e.gap.refit, 2.3) << e.choice.name;
  EXPECT_FALSE(c.truth.rough[0].Any());
}

}  // namespace
}  // namespace gapscope::twin
