// Every effect of the catalogue on every place it claims, on the rigs of the contract and on a servo with the motor plugin.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

struct Rig {
  explicit Rig(const std::string& name) : experiment(ShippedExperiment(name)), model(MakeModel(experiment)) {
    const std::map<std::string, double> amplitude = {{"joint", 0.5}, {"qube", 1.5}, {"flexjoint", 2}, {"flexlink", 0.5}, {"xl330", 0.6}};
    recording = MakeRecording(
        experiment, 401, 0.002,
        [&](int c, double t) {
          const std::string& actuator = experiment.commands[static_cast<std::size_t>(c)].actuator;
          if (actuator == "motor.supply") return 7.4;
          if (actuator == "motor.enable") return 1.0;
          return c == 0 ? Exciting(t, amplitude.at(name)) : 0.0;
        },
        ShippedLogValues(name));
    base = Predict(*model, recording);
    // The rig's own size from its own motion.
    for (std::size_t s = 0; s < base.size(); ++s) recording.measured[s].values = base[s];
    scales = EstimateScales(*model, {recording});
  }
  Experiment experiment;
  std::shared_ptr<const Model> model;
  Recording recording;
  std::vector<std::vector<double>> base;
  ScaleTable scales;
};

// Largest difference of any signal, in that signal's own largest value.
double Change(const Rig& rig, const std::vector<std::vector<double>>& predicted) {
  double change = 0;
  for (std::size_t s = 0; s < predicted.size(); ++s) change = std::max(change, LargestDifference(predicted[s], rig.base[s]) / Largest(rig.base[s]));
  return change;
}

class EffectsTest : public ::testing::TestWithParam<const char*> {};

TEST_P(EffectsTest, EachIsNeutralAtNeutralAndActsElsewhere) {
  const Rig rig(GetParam());
  const auto uses = rig.model->PossibleEffects();
  ASSERT_TRUE(uses.ok()) << uses.error().Text();
  std::set<std::string> names;
  for (const EffectUse& use : uses.value()) {
    SCOPED_TRACE(use.Text());
    names.insert(use.effect);
    const auto model = MakeModel(rig.experiment, {use}, rig.scales);
    ASSERT_NE(model, nullptr);
    // Exact but for effects that add a friction row (its neutral level is 1e-9 N m) or an affine plugin's own order of additions.
    constexpr double kNeutral = 1e-7;
    // A motor and a load side on stiff flanks or a stiff spring are near the base model, never it.
    const bool split = use.effect == "backlash" || use.effect == "joint_compliance";
    const double neutral = Change(rig, Predict(*model, rig.recording));
    RecordProperty(use.Text(), std::to_string(neutral));
    if (std::getenv("GAPSCOPE_PRINT")) std::printf("%-10s %-40s neutral %.3g", GetParam(), use.Text().c_str(), neutral);
    EXPECT_LT(neutral, split ? 0.05 : kNeutral);
    const auto placed = model->EffectParameters(use, rig.scales);
    ASSERT_TRUE(placed.ok());
    std::map<std::string, double> strong;
    for (const auto& p : placed.value()) {
      EXPECT_LE(p.low, p.neutral) << p.name;
      EXPECT_GE(p.high, p.neutral) << p.name;
      EXPECT_LE(p.low, p.start) << p.name;
      EXPECT_GE(p.high, p.start) << p.name;
      EXPECT_GE(model->IndexOf(p.name), 0) << p.name;
      for (const double trial : p.trials) {
        EXPECT_LE(p.low, trial) << p.name;
        EXPECT_GE(p.high, trial) << p.name;
      }
      strong[p.name] = p.trials.empty() ? p.start : p.trials.back();
    }
    const double acting = Change(rig, Predict(*model, rig.recording, strong));
    if (std::getenv("GAPSCOPE_PRINT")) std::printf(" acting %.3g\n", acting);
    EXPECT_GT(acting, 1e-3) << "the strongest trial does nothing";
    EXPECT_GT(acting, 3 * neutral);
  }
  // Every effect of diagnosis.md finds a place on one rig or another; on these at least the general ones.
  for (const char* name : {"command_delay", "actuator_lag", "torque_limit", "torque_bias", "quadratic_drag", "sensor_delay", "backlash", "cogging"}) EXPECT_TRUE(names.contains(name)) << name;
}

TEST_P(EffectsTest, PairsCompileAndRun) {
  const Rig rig(GetParam());
  const auto all = rig.model->PossibleEffects();
  ASSERT_TRUE(all.ok());
  // All pairs that meet on the driven joint and its motor: where plugins, springs and splits could get in each other's way.
  const std::string motor = rig.experiment.commands.front().actuator;
  const std::string joint = mj_id2name(&rig.model->compiled(), mjOBJ_JOINT, rig.model->compiled().actuator_trnid[0]);
  std::vector<EffectUse> uses;
  for (const EffectUse& use : all.value()) {
    if (use.on == motor || use.on == joint) uses.push_back(use);
  }
  Recording shorter = rig.recording;
  shorter.time_s.resize(21);
  int built = 0, refused = 0;
  for (std::size_t i = 0; i < uses.size(); ++i) {
    for (std::size_t j = i + 1; j < uses.size(); ++j) {
      const std::string both = uses[i].Text() + " + " + uses[j].Text();
      const auto model = Model::Build(rig.experiment, {uses[i], uses[j]}, rig.scales);
      if (!model.ok()) {
        // The one pair that has no meaning: a joint split twice.
        EXPECT_NE(model.error().Text().find("is split twice"), std::string::npos) << both << ": " << model.error().Text();
        ++refused;
        continue;
      }
      ++built;
      std::map<std::string, double> start;
      for (const EffectUse& use : {uses[i], uses[j]}) {
        const auto placed = model.value()->EffectParameters(use, rig.scales);
        ASSERT_TRUE(placed.ok());
        for (const auto& p : placed.value()) start[p.name] = p.start;
      }
      SCOPED_TRACE(both);
      const auto predicted = Predict(*model.value(), shorter, start);
      for (const double y : predicted[0]) ASSERT_TRUE(std::isfinite(y));
    }
  }
  EXPECT_EQ(refused, 1);
  EXPECT_GT(built, 50);
}

INSTANTIATE_TEST_SUITE_P(Rigs, EffectsTest, ::testing::Values("joint", "qube", "flexjoint", "flexlink", "xl330"), [](const auto& test) { return std::string(test.param); });

TEST(CatalogueTest, EveryEffectFindsAPlaceSomewhere) {
  std::set<std::string> placed, all;
  for (const char* rig : {"joint", "qube", "flexjoint", "flexlink", "xl330"}) {
    const auto uses = MakeModel(ShippedExperiment(rig))->PossibleEffects();
    for (const auto& use : uses.value()) placed.insert(use.effect);
  }
  for (const Effect& effect : Catalogue()) {
    all.insert(effect.name);
    EXPECT_FALSE(effect.meaning.empty() || effect.signature.empty() || effect.told_apart.empty()) << effect.name;
    EXPECT_FALSE(effect.parameters.empty()) << effect.name;
  }
  EXPECT_EQ(placed, all);
  for (const Effect& effect : Catalogue()) {
    for (const auto& partner : effect.partners) EXPECT_TRUE(all.contains(partner)) << effect.name << ": " << partner;
  }
}

}  // namespace
}  // namespace gapscope::testing
