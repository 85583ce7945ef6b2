// Every effect of the catalogue on every place it claims, on the rigs of the contract and on a servo with the motor
// plugin.
#include <gtest/gtest.h>

#include <cmath>
#include <map>
#include <set>

#include "tests/model/synthetic.h"
#include "tests/models/rig_facts.h"

namespace gapscope::testing {
namespace {

struct Rig {
  explicit Rig(const std::string& name) : experiment(ShippedExperiment(name)), model(MakeModel(experiment)) {
    const std::map<std::string, double> amplitude = {
        {"joint", 0.5}, {"qube", 1.5}, {"flexjoint", 2}, {"flexlink", 0.5}, {"xl330", 0.6}};
    recording = MakeRecording(
        experiment, 401, 0.002,
        [&](int c, double t) {
          const std::string& actuator = experiment.commands[static_cast<std::size_t>(c)].actuator;
          if (actuator == "motor.supply") return 7.4;
          if (actuator == "motor.enable") return 1.0;
          return c == 0 ? Exciting(t, amplitude.at(name)) : 0.0;
        },
        FactsOfRig(name).log_values);
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
  for (std::size_t s = 0; s < predicted.size(); ++s)
    change = std::max(change, LargestDifference(predicted[s], rig.base[s]) / Largest(rig.base[s]));
  return change;
}

// In the signal's own size. Most effects are the base model to the last bits; a plugin adds in another order.
constexpr double kNeutral = 1e-7;
// Dry friction keeps 1e-9 N m at neutral, so that its constraint row exists; the rigs' torques are down to 1e-3 N m.
constexpr double kNeutralFriction = 1e-6;
// A motor and a load side on stiff flanks or a stiff spring are near the base model, never it.
constexpr double kNearNeutral = 0.03;

bool IsFriction(const EffectUse& use, const Model& model) {
  const bool on_joint = mj_name2id(&model.compiled(), mjOBJ_JOINT, use.on.c_str()) >= 0;
  return use.effect.ends_with("friction") ||
         (on_joint && (use.effect == "direction_asymmetry" || use.effect == "quadratic_drag"));
}

class EffectsTest : public ::testing::TestWithParam<const char*> {};

TEST_P(EffectsTest, EachIsNeutralAtNeutralAndActsElsewhere) {
  const Rig rig(GetParam());
  auto uses = AllUses(*rig.model->rig());
  for (const auto& joint : rig.model->rig()->Joints())
    uses.push_back({"end_stop", joint});  // which only --with adds here
  std::set<std::string> names;
  for (const EffectUse& use : uses) {
    SCOPED_TRACE(use.Text());
    names.insert(use.effect);
    const auto model = MakeModel(rig.experiment, {use}, rig.scales);
    ASSERT_NE(model, nullptr);
    const bool split = use.effect == "backlash" || use.effect == "joint_compliance";
    // The neutral spring is the stiffest one allowed: RK4 needs a finer step for it than for the base model.
    const double step_s = split ? 1e-4 : 0;
    const double neutral = Change(rig, Predict(*model, rig.recording, {}, nullptr, step_s));
    if (std::getenv("GAPSCOPE_PRINT")) std::printf("%-10s %-40s neutral %.3g", GetParam(), use.Text().c_str(), neutral);
    EXPECT_LT(neutral, split ? kNearNeutral : IsFriction(use, *model) ? kNeutralFriction : kNeutral);
    const auto placed = PlacedParameters(use, *model->rig(), rig.scales);
    std::map<std::string, double> strong;
    for (const auto& p : placed) {
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
    const double acting = Change(rig, Predict(*model, rig.recording, strong, nullptr, step_s));
    if (std::getenv("GAPSCOPE_PRINT")) std::printf(" acting %.3g\n", acting);
    EXPECT_GT(acting, 1e-3) << "the strongest trial does nothing";
    EXPECT_GT(acting, 3 * neutral);
  }
  // Every effect of docs/reference/effects.md finds a place on one rig or another; on these at least the general ones.
  for (const char* name : {"command_delay", "actuator_lag", "torque_limit", "torque_bias", "quadratic_drag",
                           "sensor_delay", "backlash", "cogging"})
    EXPECT_TRUE(names.contains(name)) << name;
}

INSTANTIATE_TEST_SUITE_P(Rigs, EffectsTest, ::testing::Values("joint", "qube", "flexjoint", "flexlink", "xl330"),
                         [](const auto& test) { return std::string(test.param); });

// All pairs that meet on the driven joint and its motor: where plugins, springs and splits could get in each other's
// way.
class PairsTest : public ::testing::TestWithParam<const char*> {};

TEST_P(PairsTest, CompileAndRun) {
  const Rig rig(GetParam());
  const std::string motor = rig.experiment.commands.front().actuator;
  const std::string joint = mj_id2name(&rig.model->compiled(), mjOBJ_JOINT, rig.model->compiled().actuator_trnid[0]);
  struct Candidate {
    EffectUse use;
    std::vector<PlacedParameter> parameters;
  };
  std::vector<Candidate> candidates;
  for (const EffectUse& use : AllUses(*rig.model->rig())) {
    if (use.on != motor && use.on != joint) continue;
    candidates.push_back({use, PlacedParameters(use, *rig.model->rig(), rig.scales)});
  }
  Recording shorter = rig.recording;
  shorter.time_s.resize(21);
  int built = 0;
  std::set<std::string> refused;
  for (std::size_t i = 0; i < candidates.size(); ++i) {
    for (std::size_t j = i + 1; j < candidates.size(); ++j) {
      const std::string both = candidates[i].use.Text() + " + " + candidates[j].use.Text();
      SCOPED_TRACE(both);
      const auto model = Model::Build(rig.model->rig(), {candidates[i].use, candidates[j].use}, rig.scales);
      if (!model.ok()) {
        EXPECT_NE(model.error().Text().find("is split twice"), std::string::npos) << model.error().Text();
        refused.insert(both);
        continue;
      }
      ++built;
      std::map<std::string, double> start;
      for (const Candidate& candidate : {candidates[i], candidates[j]}) {
        for (const auto& p : candidate.parameters) start[p.name] = p.start;
      }
      const auto predicted = Predict(*model.value(), shorter, start);
      for (const double y : predicted[0]) ASSERT_TRUE(std::isfinite(y));
    }
  }
  // The one pair that has no meaning.
  EXPECT_EQ(refused, std::set<std::string>{"backlash@" + joint + " + joint_compliance@" + joint});
  EXPECT_GT(built, 100);
}

// A native servo with a feed-forward motor beside it, and a servo that is a plugin already.
INSTANTIATE_TEST_SUITE_P(Rigs, PairsTest, ::testing::Values("joint", "xl330"),
                         [](const auto& test) { return std::string(test.param); });

// A voltage amplifier with two gains is the base model on other voltages; a servo has no voltage to scale.
TEST(DirectionAsymmetryTest, OfTheVoltageIsTheBaseModelOnScaledVoltages) {
  const Rig rig("qube");
  const EffectUse use{"direction_asymmetry", "motor"};
  const auto model = MakeModel(rig.experiment, {use}, rig.scales);
  Recording scaled = rig.recording;
  for (double& u : scaled.commands[0].values) u *= u > 0 ? 1.25 : 0.75;
  const auto expected = Predict(*rig.model, scaled);
  const auto actual =
      Predict(*model, rig.recording, {{use.Text() + ".asymmetry", 0.25}, {use.Text() + ".command_share", 1}});
  for (std::size_t s = 0; s < expected.size(); ++s)
    EXPECT_LT(LargestDifference(actual[s], expected[s]), 1e-9 * Largest(expected[s]));
  const auto of_torque = Predict(*model, rig.recording, {{use.Text() + ".asymmetry", 0.25}});
  EXPECT_GT(LargestDifference(of_torque[0], expected[0]), 1e-3 * Largest(expected[0]));
  const Rig servo("xl330");
  const auto placed = PlacedParameters(use, *MakeModel(servo.experiment, {use}, servo.scales)->rig(), servo.scales);
  EXPECT_EQ(placed[1].low, placed[1].high);
}

// One name, two effects: what is told of it depends on the place.
TEST(CatalogueTest, AsymmetryOfAJointIsFrictionAndOfAMotorItsGain) {
  const auto model = MakeModel(ShippedExperiment("qube"));
  const Effect &of_joint = EffectOf({"direction_asymmetry", "arm"}, *model->rig()),
               &of_motor = EffectOf({"direction_asymmetry", "motor"}, *model->rig());
  EXPECT_NE(of_joint.meaning.find("friction"), std::string::npos);
  EXPECT_NE(of_motor.meaning.find("gain"), std::string::npos);
}

TEST(CatalogueTest, EveryEffectFindsAPlaceSomewhere) {
  std::set<std::string> placed, all;
  for (const char* rig : {"joint", "qube", "flexjoint", "flexlink", "xl330"}) {
    for (const auto& use : AllUses(*MakeModel(ShippedExperiment(rig))->rig())) placed.insert(use.effect);
  }
  // None of these joints has a range, nor has a rig two drives: tree_effects_test.cc.
  for (const char* effect : {"end_stop", "mount_tilt", "payload"}) EXPECT_TRUE(placed.insert(effect).second) << effect;
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

// A cable hangs where it was mounted, however little the joint moved in the logs.
TEST(CatalogueTest, ACablesRestReachesHalfATurn) {
  const auto model = MakeModel(ShippedExperiment("qube"));
  for (const double moved : {0.1, 2.0}) {
    const auto placed = PlacedParameters({"cable_spring", "arm"}, *model->rig(), {{"arm", {.angle_rad = moved}}});
    ASSERT_EQ(placed[1].key, "rest_rad");
    EXPECT_DOUBLE_EQ(placed[1].high, std::max(3.2, 4 * moved));
    EXPECT_DOUBLE_EQ(placed[1].low, -placed[1].high);
    EXPECT_DOUBLE_EQ(placed[1].trials.back(), moved) << "trials stay where the logs are";
  }
}

}  // namespace
}  // namespace gapscope::testing
