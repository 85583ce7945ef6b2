// From what a search found to a verdict.
#include "src/diagnose/verdict.h"

#include <gtest/gtest.h>

#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

// A search that accepted a cable spring, whose blocks hold so many times the noise in every half second before and
// after.
struct Found {
  Rig rig;
  SearchResult result;

  Found(double before, double after, const std::string& name = "qube") : rig(LoadRig(name)) {
    result.base = Make({}, before);
    result.nominal = Make({}, before);
    result.first.children.push_back(Make({{"cable_spring", "arm"}}, after));
    result.single = result.chosen = result.first.children.front().get();
  }
  std::unique_ptr<Candidate> Make(const std::vector<EffectUse>& effects, double floors) const {
    auto candidate = std::make_unique<Candidate>();
    candidate->effects = effects;
    candidate->model = rig.model;
    candidate->train_blocks = candidate->held_out_blocks = std::vector<double>(40, floors * floors);
    candidate->held_out_cost = 40 * floors * floors;
    candidate->held_out_floors = floors;
    return candidate;
  }
};

Verdict VerdictOf(double floors_before, double floors_left, double free_run_removed) {
  Found found(floors_before, floors_left);
  found.result.free_run_before = 1;
  found.result.free_run_left = 1 - free_run_removed;
  return Judge(found.result).verdict;
}

TEST(VerdictTest, AnEffectThatLeavesLittleIsTheCause) { EXPECT_EQ(VerdictOf(10, 1.5, 0), Verdict::kEffects); }

TEST(VerdictTest, WhatStandsForAnotherCauseHelpsWindowsOrFreeRunsOnly) {
  // Half of the excess in windows, and nothing or less in a free run: something else is missing.
  EXPECT_EQ(VerdictOf(10, 5.5, 0.05), Verdict::kUnknown);
  EXPECT_EQ(VerdictOf(10, 5.5, -2), Verdict::kUnknown);
  EXPECT_EQ(VerdictOf(10, 9.5, 0.5), Verdict::kUnknown);
  // Nearly half in both: the cause, with more beside it.
  EXPECT_EQ(VerdictOf(10, 5.5, 0.45), Verdict::kEffects);
  // Most of it in one of them.
  EXPECT_EQ(VerdictOf(10, 3.5, -0.2), Verdict::kEffects);
}

// Found beside the second effect, another one does what the first one does: the pair is not told apart in its first
// effect.
TEST(VerdictTest, APairsFirstEffectMayHaveRivals) {
  Found found(10, 2);
  SearchResult& result = found.result;
  result.second.children.push_back(found.Make({{"cable_spring", "arm"}, {"command_delay", "motor"}}, 1.1));
  result.chosen = result.second.children.front().get();
  EXPECT_EQ(Judge(result).verdict, Verdict::kEffects);
  result.exchange.children.push_back(
      found.Make({{"command_delay", "motor"}, {"cable_spring", "arm"}}, 1.1));  // the same pair
  result.exchange.children.push_back(
      found.Make({{"command_delay", "motor"}, {"coulomb_friction", "arm"}}, 5));  // far behind
  EXPECT_EQ(Judge(result).verdict, Verdict::kEffects);
  result.exchange.children.push_back(found.Make({{"command_delay", "motor"}, {"gravity_offset", "arm"}}, 1.1));
  const Judgement judgement = Judge(result);
  EXPECT_EQ(judgement.verdict, Verdict::kAmbiguous);
  EXPECT_EQ(judgement.groups,
            (std::vector<std::vector<EffectUse>>{{{"cable_spring", "arm"}, {"gravity_offset", "arm"}}}));
}

// Where one sensor is all that is measured, a late sensor and a late command are the same motion, whatever their fits
// cost.
TEST(VerdictTest, OneSignalCannotTellALateSensorFromALateCommand) {
  Found found(10, 2);
  SearchResult& result = found.result;
  result.first.children.push_back(found.Make({{"sensor_delay", "arm_rad"}}, 1.1));
  result.first.children.push_back(found.Make({{"command_delay", "motor"}}, 1.5));
  result.first.screen.push_back({.use = {"command_delay", "motor"}, .trial = {}, .child = {}, .left_out = {}});
  result.single = result.chosen = result.first.children[1].get();
  EXPECT_EQ(Judge(result).verdict, Verdict::kEffects);
  result.one_signal = true;
  const Judgement judgement = Judge(result);
  EXPECT_EQ(judgement.verdict, Verdict::kAmbiguous);
  EXPECT_EQ(judgement.groups,
            (std::vector<std::vector<EffectUse>>{{{"sensor_delay", "arm_rad"}, {"command_delay", "motor"}}}));
}

// On a joint that a spring holds, a constant torque moves the rest, as a zero offset does: Coulomb friction is then
// friction of any two levels with that mean.
TEST(VerdictTest, OnASpringAZeroOffsetHidesInWhichDirectionFrictionIsLarger) {
  Found found(10, 2);
  SearchResult& result = found.result;
  result.first.children.push_back(found.Make({{"coulomb_friction", "arm"}}, 1.1));
  result.single = result.chosen = result.first.children[1].get();
  result.first.screen.push_back({.use = {"direction_asymmetry", "arm"}, .trial = {}, .child = {}, .left_out = {}});
  result.first.screen.push_back(
      {.use = {"torque_bias", "arm"}, .trial = {.absorbed = 1, .valid = false}, .child = {}, .left_out = "not tested"});
  EXPECT_EQ(Judge(result).verdict, Verdict::kEffects);
  result.first.screen.back().trial = {.absorbed = 0.98, .valid = true};  // a pendulum's rest, or a hub without a spring
  EXPECT_EQ(Judge(result).verdict, Verdict::kEffects);
  result.first.screen.back().trial.absorbed = 0.99999;
  const Judgement judgement = Judge(result);
  EXPECT_EQ(judgement.verdict, Verdict::kAmbiguous);
  EXPECT_EQ(judgement.groups,
            (std::vector<std::vector<EffectUse>>{{{"coulomb_friction", "arm"}, {"direction_asymmetry", "arm"}}}));
}

// On a servo likewise, unless its torque is measured: that shows the load.
TEST(VerdictTest, OnAServoOnlyItsTorqueTellsFrictionByDirection) {
  Found found(10, 2, "joint");
  SearchResult& result = found.result;
  result.first.children.push_back(found.Make({{"coulomb_friction", "joint"}}, 1.1));
  result.single = result.chosen = result.first.children[1].get();
  result.first.screen.push_back({.use = {"direction_asymmetry", "joint"}, .trial = {}, .child = {}, .left_out = {}});
  EXPECT_EQ(Judge(result).verdict, Verdict::kAmbiguous);
  result.torque = true;
  EXPECT_EQ(Judge(result).verdict, Verdict::kEffects);
}

TEST(VerdictTest, ProbabilitiesAddUpToOne) {
  const Found found(10, 2);
  const Judgement judgement = Judge(found.result);
  ASSERT_EQ(judgement.probabilities.size(), judgement.explanations.size());
  double sum = 0;
  for (const double p : judgement.probabilities) sum += p;
  EXPECT_NEAR(sum, 1, 1e-12);
  EXPECT_GT(judgement.probabilities.back(), judgement.probabilities.front());
}

}  // namespace
}  // namespace gapscope::testing
