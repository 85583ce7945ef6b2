// The exported MJCF: any MuJoCo with the plugin library loads it, and it moves as the tuned model does.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "src/model/apply.h"
#include "tests/model/synthetic.h"
#include "tests/models/rig_facts.h"

namespace gapscope::testing {
namespace {

ModelPtr Load(const std::string& xml) {
  const Scratch scratch;
  char message[1000] = "";
  ModelPtr model(mj_loadXML(scratch.Write("model.xml", xml).c_str(), nullptr, message, sizeof message));
  EXPECT_TRUE(model) << message;
  return model;
}

// Plain MuJoCo: the command of each row is held to the next.
std::vector<double> Roll(const mjModel* m, const Model& model, const Recording& recording, int steps) {
  const DataPtr d(mj_makeData(m));
  const int qpos =
      m->jnt_qposadr[mj_name2id(m, mjOBJ_JOINT, mj_id2name(&model.compiled(), mjOBJ_JOINT, model.source(0).joint))];
  std::vector<double> q;
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    q.push_back(d->qpos[qpos]);
    for (std::size_t c = 0; c < recording.commands.size(); ++c) {
      const int id = mj_name2id(m, mjOBJ_ACTUATOR, recording.commands[c].actuator.c_str());
      d->ctrl[m->actuator_ctrladr[id]] = recording.commands[c].values[k];
    }
    for (int i = 0; i < steps; ++i) mj_step(m, d.get());
  }
  return q;
}

struct Export {
  const char* rig;
  std::vector<const char*> effects;
  std::map<std::string, double> set = {};  // other values than where a fit starts
};

const std::map<std::string, double> kCubicCable = {{"cable_spring@arm.rest_rad", 0.3},
                                                   {"cable_spring@arm.stiffness_cubic_n_m_per_rad3", 0.01}};

// Within the arm's first swing.
const std::map<std::string, double> kStop = {{"end_stop@arm.angle_rad", 0.02},
                                             {"end_stop@arm.stiffness_n_m_per_rad", 0.5}};

// All of them reached.
const std::map<std::string, double> kSag = {{"supply_sag@motor.limit_n_m", 10}, {"supply_sag@motor.sag_fraction", 1}};
const std::map<std::string, double> kPower = {{"torque_speed_curve@motor.power_w", 4}};
const std::map<std::string, double> kPayload = {{"payload@pendulum.mass_kg", 0.02}, {"payload@pendulum.z_m", -0.1}};
const std::map<std::string, double> kTilt = {{"mount_tilt@model.x_rad", 0.2}, {"mount_tilt@model.y_rad", 0.1}};

class ToXmlTest : public ::testing::TestWithParam<Export> {
 protected:
  void SetUp() override {
    const auto& [rig, texts, changed] = GetParam();
    const Experiment experiment = ShippedExperiment(rig);
    const auto base = MakeModel(experiment);
    const auto uses = ParseEffects({texts.begin(), texts.end()}, *base->rig());
    ASSERT_TRUE(uses.ok()) << uses.error().Text();
    recording_ = MakeRecording(
        experiment, 301, base->compiled().opt.timestep,
        [&](int c, double t) {
          const std::string& actuator = experiment.commands[static_cast<std::size_t>(c)].actuator;
          return actuator == "motor.supply"   ? 7.4
                 : actuator == "motor.enable" ? 1.0
                 : c == 0                     ? Exciting(t, 0.5) - Exciting(0, 0.5)
                                              : 0.0;
        },
        FactsOfRig(rig).log_values);
    scales_ = EstimateScales(*base, {recording_});
    model_ = MakeModel(experiment, uses.value(), scales_);
    ASSERT_NE(model_, nullptr);
    for (const EffectUse& use : uses.value()) {
      for (const auto& p : PlacedParameters(use, *model_->rig(), scales_)) set_[p.name] = p.start;
    }
    for (const auto& [name, value] : changed) set_.at(name) = value;
  }
  void ExpectToMoveAlike(const std::string& xml) const {
    const ModelPtr loaded = Load(xml);
    ASSERT_TRUE(loaded);
    const std::vector<double> ours = Predict(*model_, recording_, set_)[0],
                              theirs = Roll(loaded.get(), *model_, recording_, 1);
    // The XML holds what MuJoCo's writer prints; a delay is the log's shift here and the motor's own there.
    constexpr double kPrinted = 1e-5;
    EXPECT_LT(LargestDifference(ours, theirs), kPrinted * Largest(ours));
    if (GetParam().set.empty()) return;
    const std::vector<double> without = Predict(*MakeModel(model_->experiment()), recording_)[0];
    EXPECT_GT(LargestDifference(ours, without), 100 * kPrinted * Largest(ours));
  }

  // Whether plugins are the only form that the model's effects have.
  static bool NeedsPlugins() {
    const std::set<std::string> natives = {
        "coulomb_friction", "cable_spring@arm", "coulomb_friction@arm", "spring_hardening", "quadratic_drag@link",
        "end_stop@arm",     "backlash",         "joint_compliance",     "payload@pendulum", "mount_tilt@model"};
    return GetParam().rig == std::string("xl330") ||
           !std::ranges::all_of(GetParam().effects, [&](const char* effect) { return natives.contains(effect); });
  }

  Recording recording_;
  ScaleTable scales_;
  std::shared_ptr<const Model> model_;
  std::map<std::string, double> set_;
};

TEST_P(ToXmlTest, ReplaysLikeTheModelItWasMadeFrom) {
  const auto xml = model_->ToXml(ValuesWith(*model_, set_), recording_.values, scales_);
  ASSERT_TRUE(xml.ok()) << xml.error().Text();
  EXPECT_EQ(xml.value().find("gapscope") != std::string::npos, NeedsPlugins());
  ExpectToMoveAlike(xml.value());
}

TEST_P(ToXmlTest, TheUsersOwnMjcfWithTheChangesReplaysSoToo) {
  const Scratch scratch;
  const auto applied = ApplyToMjcf(*model_, ValuesWith(*model_, set_), {.out = scratch.Path("model.xml"), .notes = {}});
  ASSERT_TRUE(applied.ok()) << applied.error().Text();
  // What only a log knows is in no file.
  if (applied.value().left_out.empty()) ExpectToMoveAlike(applied.value().text);
}

TEST(ToXmlTest, AModelOfOverAMegabyteIsWrittenWhole) {
  const Scratch scratch;
  const std::string long_text(3 << 20, 'x');
  const Experiment experiment =
      MakeExperiment(scratch, "<mujoco><custom><text name=\"long\" data=\"" + long_text + R"("/></custom>
        <worldbody><body><joint name="hinge"/><geom size="0.1"/></body></worldbody></mujoco>)",
                     "measured:\n  - {signal: q, column: q, joint: hinge, unit: rad}\n");
  const auto model = MakeModel(experiment);
  ASSERT_NE(model, nullptr);
  const auto xml = model->ToXml({}, {}, {});
  ASSERT_TRUE(xml.ok()) << xml.error().Text();
  EXPECT_GT(xml.value().size(), long_text.size());
  const ModelPtr loaded = Load(xml.value());
  ASSERT_TRUE(loaded);
  EXPECT_EQ(std::string(loaded->text_data), long_text);
}

INSTANTIATE_TEST_SUITE_P(
    Exports, ToXmlTest,
    ::testing::Values(
        Export{"joint", {}}, Export{"qube", {}}, Export{"flexjoint", {}}, Export{"flexlink", {}}, Export{"xl330", {}},
        Export{"joint", {"coulomb_friction"}}, Export{"joint", {"stribeck_friction", "torque_limit"}},
        Export{"joint", {"command_delay"}}, Export{"joint", {"actuator_lag", "cogging"}}, Export{"joint", {"backlash"}},
        Export{"flexjoint", {"joint_compliance"}}, Export{"joint", {"torque_delay", "load_friction"}},
        Export{"qube", {"cable_spring@arm", "coulomb_friction@arm"}}, Export{"qube", {"cable_spring@arm"}, kCubicCable},
        Export{"qube", {"cable_spring@arm", "gravity_offset@arm"}, kCubicCable},
        Export{"qube", {"dead_zone", "gravity_offset@arm"}}, Export{"qube", {"end_stop@arm", "torque_bias@arm"}, kStop},
        Export{"qube", {"end_stop@arm"}, kStop}, Export{"flexjoint", {"spring_hardening", "quadratic_drag@link"}},
        Export{"joint", {"supply_sag"}, kSag}, Export{"joint", {"torque_speed_curve"}, kPower},
        Export{"joint", {"torque_constant_droop", "direction_asymmetry@joint"}},
        Export{"qube", {"payload@pendulum"}, kPayload}, Export{"qube", {"mount_tilt@model"}, kTilt},
        Export{"xl330", {"load_friction", "torque_delay"}}),
    [](const auto& test) {
      std::string name = test.param.rig;
      for (const char* effect : test.param.effects) name += std::string("_") + effect;
      if (!test.param.set.empty()) name += "_cubic";
      std::replace(name.begin(), name.end(), '@', '_');
      return name;
    });

}  // namespace
}  // namespace gapscope::testing
