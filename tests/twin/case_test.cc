// Whole cases: repeatable, labelled, within what a rig tolerates.
#include "tests/twin/case.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "tests/twin/output.h"

namespace gapscope::twin {
namespace {

Case Make(CaseRequest request) {
  Case made;
  std::string problem;
  EXPECT_TRUE(MakeCase(request, &made, &problem)) << problem;
  return made;
}

CaseRequest Single(const char* rig, const char* effect, double severity) {
  CaseRequest request;
  request.seed = 3;
  request.kind = Kind::kSingle;
  request.rig = rig;
  request.effect = effect;
  request.severity = severity;
  return request;
}

TEST(CaseTest, SameRequestSameBytes) {
  const CaseRequest request = Single("flexlink", "coulomb_friction", 1);
  const Case a = Make(request), b = Make(request);
  EXPECT_EQ(LabelText(a, {}), LabelText(b, {}));
  EXPECT_EQ(CsvText(MakeRecords(a, true, 5e-4)[0]), CsvText(MakeRecords(b, true, 5e-4)[0]));
}

TEST(CaseTest, LabelNamesWhatWasDone) {
  const Case c = Make(Single("flexlink", "sensor_delay@deflection_rad", 2));
  const auto label = nlohmann::json::parse(LabelText(c, {"log_0.csv"}));
  EXPECT_EQ(label["rig"], "flexlink");
  EXPECT_EQ(label["kind"], "single");
  EXPECT_EQ(label["expected_verdicts"][0], "effects");
  EXPECT_EQ(label["effects"][0]["on"], "deflection_rad");
  EXPECT_DOUBLE_EQ(label["effects"][0]["parameters"]["delay_s"], c.truth.sensor_delay_s[1]);
  EXPECT_GT(label["effect_to_floor"], 1);
  EXPECT_EQ(label["logs"].size(), c.logs.size());
  EXPECT_EQ(label["base"].size(), 6u);
}

TEST(CaseTest, BaseStaysWithinItsSpread) {
  for (const Rig rig : kRigs) {
    Random random(5, 0, RigName(rig));
    for (int i = 0; i < 50; ++i) {
      const Base base = DrawBase(rig, &random), nominal = NominalBase(rig);
      for (const BaseParameter& p : BaseParameters(rig)) {
        const double ratio = base.*p.field / (nominal.*p.field);
        if (p.relative_spread == 0) {
          EXPECT_EQ(ratio, 1) << p.name;
        }
        EXPECT_LE(std::abs(ratio - 1), p.name == "pendulum.length" ? 0.05 : 0.205) << p.name;
      }
    }
  }
}

TEST(CaseTest, SevererIsFartherAndRefitNeverWorse) {
  const Case weak = Make(Single("flexlink", "command_delay", 1));
  Plant severe = weak.truth;
  severe.drive.command_delay_s *= 4;
  const Gap strong = MeasureGap(CoarseRecords(severe, weak.logs, weak.sensors, {}), weak.base, weak.Floor(),
                                BaseDirections(weak.rig), true, {});
  EXPECT_GT(strong.raw, 2 * weak.gap.raw);
  EXPECT_LE(weak.gap.refit, weak.gap.raw);
  EXPECT_LE(strong.refit, strong.raw);
}

// A limit that a log does not reach is nothing there.
TEST(CaseTest, AGapIsToldLogByLog) {
  const Case c = Make(Single("flexlink", "command_delay", 1));
  Plant limited = c.base;
  limited.drive.torque_limit_n_m = 1e3;
  const Gap none = MeasureGap(CoarseRecords(limited, c.logs, c.sensors, {}), c.base, c.Floor(), {}, false, {});
  ASSERT_EQ(none.logs.size(), c.logs.size());
  EXPECT_LT(*std::max_element(none.logs.begin(), none.logs.end()), 1e-6);
  double square = 0;
  for (const double gap : c.gap.logs) square += gap * gap / static_cast<double>(c.gap.logs.size());
  EXPECT_NEAR(std::sqrt(square) / c.gap.raw, 1, 0.3) << "logs differ in length by no more than that";
  EXPECT_GT(*std::max_element(c.gap.logs.begin(), c.gap.logs.end()), c.gap.raw);
}

TEST(CaseTest, WithoutEffectThereIsNoGap) {
  CaseRequest request;
  request.kind = Kind::kNone;
  request.rig = "flexjoint";
  const Case c = Make(request);
  const auto records = CoarseRecords(c.truth, c.logs, c.sensors, {});
  EXPECT_LT(MeasureGap(records, c.base, c.Floor(), {}, false, {}).raw, 1e-6);
}

// Wrong base parameters are taken up by the linearised refit: they are no effect.
TEST(CaseTest, RefitTakesUpWrongParameters) {
  CaseRequest request;
  request.kind = Kind::kNone;
  request.rig = "flexlink";
  const Case c = Make(request);
  const auto records = CoarseRecords(c.truth, c.logs, c.sensors, {});
  Plant wrong = c.base;
  wrong.base.link_stiffness_n_m_per_rad *= 1.02;
  wrong.base.inertia_kg_m2 *= 0.98;
  const Gap gap = MeasureGap(records, wrong, c.Floor(), BaseDirections(c.rig), true, {});
  EXPECT_GT(gap.raw, 1);
  EXPECT_LT(gap.refit, 0.1 * gap.raw);
}

TEST(CaseTest, SearchedSeverityReachesItsRange) {
  CaseRequest request = Single("flexlink", "dead_zone", 0);
  const Case c = Make(request);
  EXPECT_GT(c.effects[0].gap.refit, 2.4);
  EXPECT_LT(c.effects[0].gap.refit, 130);
}

TEST(CaseTest, AmbiguousGroupIsMeasured) {
  CaseRequest request;
  request.kind = Kind::kAmbiguous;
  request.rig = "joint";
  request.seed = 5;
  const Case c = Make(request);
  ASSERT_GE(c.group.size(), 2u);
  for (const Case::Member& m : c.group) EXPECT_LT(m.distance_to_floor, 1) << m.name;
  EXPECT_GT(c.gap.refit, 2);
  for (const LogSpec& log : c.logs) EXPECT_FALSE(log.torque_column || log.speed_column);
}

TEST(CaseTest, EveryOutsideEffectChangesTheLog) {
  CaseRequest request;
  request.rig = "flexlink";
  request.kind = Kind::kNone;
  const Case none = Make(request);
  const Motion motion = MotionOf(none.base, none.logs);
  const std::vector<LogSpec> logs(none.logs.begin(), none.logs.begin() + 2);
  for (const std::string& name : OutsideNames()) {
    Plant plant = none.base;
    EXPECT_FALSE(AddOutside(name, 3, 7, motion, &plant).empty());
    const auto records = CoarseRecords(plant, logs, none.sensors, {});
    EXPECT_GT(MeasureGap(records, none.base, none.Floor(), {}, false, {}).raw, 0.5) << name;
  }
}

TEST(CaseTest, UnknownNamesAreRefused) {
  Case made;
  std::string problem;
  EXPECT_FALSE(MakeCase(Single("flexlink", "torque_delay", 1), &made, &problem));
  EXPECT_NE(problem.find("torque_delay"), std::string::npos);
  EXPECT_FALSE(MakeCase(Single("crane", "dead_zone", 1), &made, &problem));
  EXPECT_NE(problem.find("crane"), std::string::npos);
}

}  // namespace
}  // namespace gapscope::twin
