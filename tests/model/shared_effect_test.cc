// One size for all drives, or all signals: what it is equal to, where it is offered, and that a drive's own delay is
// its own.
#include <gtest/gtest.h>

#include <algorithm>
#include <set>

#include "tests/model/synthetic.h"
#include "tests/model/two_links.h"

namespace gapscope::testing {
namespace {

// A double pendulum; its second link weighs less, so that the two drives differ.
constexpr const char* kArm = R"(<mujoco>
  <compiler angle="radian"/>
  <option timestep="0.002" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body name="upper"><joint name="shoulder" axis="0 -1 0" damping="0.02"/>
      <inertial pos="0 0 -0.15" mass="1" diaginertia="0.01 0.01 0.001"/>
      <body name="lower" pos="0 0 -0.3"><joint name="elbow" axis="0 -1 0" damping="0.02"/>
        <inertial pos="0 0 -0.1" mass="0.3" diaginertia="0.002 0.002 0.001"/></body></body>
  </worldbody>
  <actuator><motor name="first" joint="shoulder"/><motor name="second" joint="elbow"/></actuator>
</mujoco>)";

class SharedEffectTest : public ::testing::Test {
 protected:
  explicit SharedEffectTest(const std::string& mjcf = kArm)
      : experiment_(MakeExperiment(scratch_, mjcf, kTwoLinks)),
        base_(MakeModel(experiment_)),
        recording_(MakeRecording(experiment_, 400, 0.002, [](int c, double t) {
          return c == 0 ? Exciting(t, 2) - Exciting(0, 2) : Exciting(t, 0.5, 1, 6) - Exciting(0, 0.5, 1, 6);
        })) {
    const auto motion = Predict(*base_, recording_);
    for (std::size_t s = 0; s < motion.size(); ++s) recording_.measured[s].values = motion[s];
    scales_ = EstimateScales(*base_, {recording_});
  }

  const gapscope::Rig& rig() const { return *base_->rig(); }

  std::vector<EffectUse> Parsed(const std::vector<std::string>& texts) const {
    const auto uses = ParseEffects(texts, rig());
    EXPECT_TRUE(uses.ok()) << uses.error().Text();
    return uses.ok() ? uses.value() : std::vector<EffectUse>{};
  }
  std::string Refused(const std::vector<std::string>& texts) const {
    const auto uses = ParseEffects(texts, rig());
    return uses.ok() ? "" : uses.error().Text();
  }
  // Trajectories with these effects; their parameters, by the order of their entry, have these values.
  std::vector<std::vector<double>> Motion(const std::vector<std::string>& texts, const std::vector<double>& values) {
    const auto uses = Parsed(texts);
    const auto model = MakeModel(experiment_, uses, scales_);
    std::map<std::string, double> set;
    for (const EffectUse& use : uses) {
      const auto placed = PlacedParameters(use, rig(), scales_);
      for (std::size_t i = 0; i < std::min(values.size(), placed.size()); ++i) set[placed[i].name] = values[i];
    }
    return Predict(*model, recording_, set);
  }

  Scratch scratch_;
  Experiment experiment_;
  std::shared_ptr<const Model> base_;
  Recording recording_;
  ScaleTable scales_;
};

TEST_F(SharedEffectTest, IsTheSameEffectOnEachPlaceWithOneValue) {
  struct Case {
    const char* effect;
    std::vector<std::string> places;
    std::vector<double> values;
  };
  const std::vector<std::string> drives = {"first", "second"}, joints = {"shoulder", "elbow"}, signals = {"q", "p"};
  const auto plain = Predict(*base_, recording_);
  for (const Case& test : {Case{"command_delay", drives, {0.0063}}, Case{"actuator_lag", drives, {0.02, 0.2}},
                           Case{"torque_constant_droop", drives, {0.4, 2}}, Case{"supply_sag", drives, {0.2, 1, 1.1}},
                           Case{"dead_zone", drives, {0.07}}, Case{"coulomb_friction", joints, {0.05}},
                           Case{"load_friction", joints, {0.1}}, Case{"torque_bias", joints, {0.04}},
                           Case{"quadratic_drag", joints, {0.01}}, Case{"joint_compliance", joints, {80, 0.3, 0.1}},
                           Case{"sensor_delay", signals, {0.0063}}}) {
    const std::string effect = test.effect;
    SCOPED_TRACE(effect);
    ASSERT_EQ(Parsed({effect + "@all"}), (std::vector<EffectUse>{{effect, "all"}}));
    const auto shared = Motion({effect + "@all"}, test.values);
    const auto each = Motion({effect + "@" + test.places[0], effect + "@" + test.places[1]}, test.values);
    EXPECT_EQ(shared, each);
    EXPECT_GT(LargestDifference(shared[0], plain[0]), 1e-4);
    EXPECT_GT(LargestDifference(shared[1], plain[1]), 1e-4);
  }
}

TEST_F(SharedEffectTest, OneParameterWithTheLargestDrivesBounds) {
  const auto placed = PlacedParameters({"coulomb_friction", "all"}, rig(), scales_);
  ASSERT_EQ(placed.size(), 1u);
  EXPECT_EQ(placed[0].name, "coulomb_friction@all.friction_n_m");
  const double large = scales_.at("shoulder").torque_n_m, small = scales_.at("elbow").torque_n_m;
  EXPECT_GT(large, small);
  EXPECT_EQ(placed[0].high, large);
  const auto model = MakeModel(experiment_, {{"torque_constant_droop", "all"}}, scales_);
  EXPECT_EQ(model->FreeParameters().size(), 2u);
  // Each drive's loss counts from its own torque.
  for (const auto& [drive, torque] : {std::pair{"first", large}, {"second", small}})
    EXPECT_EQ(model->Nominal()[model->Find(ScaleName(drive, RigSize::kTorque), "").value()], torque);
}

TEST_F(SharedEffectTest, IsOfferedWhereOneSizeCanBeMeant) {
  std::set<std::string> shared;
  for (const EffectUse& use : AllUses(rig())) {
    if (use.on != "all") continue;
    EXPECT_TRUE(shared.insert(use.effect).second) << use.effect << " twice";
  }
  // Times and shares, on motors; nothing here is a servo.
  EXPECT_EQ(shared, (std::set<std::string>{"actuator_lag", "command_delay", "direction_asymmetry", "load_friction",
                                           "sensor_delay", "torque_constant_droop"}));
  EXPECT_EQ(ActuatorModel(rig()).front(), (EffectUse{"command_delay", "first"}));
  EXPECT_EQ(UseWithParameter("coulomb_friction@all.friction_n_m", rig()), (EffectUse{"coulomb_friction", "all"}));
  EXPECT_EQ(UseWithParameter("command_delay@all.delay_s", rig()), (EffectUse{"command_delay", "all"}));
  // On motors first, where the name stands twice.
  EXPECT_EQ(PlacesOf({"direction_asymmetry", "all"}, rig()), (std::vector<std::string>{"first", "second"}));
}

TEST_F(SharedEffectTest, BesideOneOfItsPlacesIsRefused) {
  const std::string message = Refused({"command_delay@second", "actuator_lag", "command_delay@all"});
  for (const char* part : {"--with command_delay@all --with command_delay@second", "one of the two",
                           "command_delay@first, command_delay@second"})
    EXPECT_NE(message.find(part), std::string::npos) << message;
  const auto built = Model::Build(base_->rig(), {{"sensor_delay", "all"}, {"sensor_delay", "p"}}, scales_);
  ASSERT_FALSE(built.ok());
  EXPECT_NE(built.error().Text().find("sensor_delay@q, sensor_delay@p"), std::string::npos);
  // Friction by direction on a joint is not what the motors do.
  EXPECT_EQ(Refused({"direction_asymmetry@all", "direction_asymmetry@elbow"}), "");
  EXPECT_NE(Refused({"command_delay@al"}).find("allowed: first, second, all"), std::string::npos)
      << Refused({"command_delay@al"});
  EXPECT_NE(Refused({"command_delay@all", "command_delay@all"}).find("stands twice"), std::string::npos);
}

TEST_F(SharedEffectTest, AnExportedModelHasItOnEveryDrive) {
  const auto model = MakeModel(experiment_, Parsed({"command_delay@all", "coulomb_friction@all"}), scales_);
  const std::map<std::string, double> set = {{"command_delay@all.delay_s", 0.006},
                                             {"coulomb_friction@all.friction_n_m", 0.05}};
  const auto xml = model->ToXml(ValuesWith(*model, set), {}, scales_);
  ASSERT_TRUE(xml.ok()) << xml.error().Text();
  char message[1000] = "";
  const ModelPtr loaded(mj_loadXML(scratch_.Write("model.xml", xml.value()).c_str(), nullptr, message, sizeof message));
  ASSERT_TRUE(loaded) << message;
  for (const char* name : {"first.command_delay_s", "second.command_delay_s"}) {
    const int id = mj_name2id(loaded.get(), mjOBJ_NUMERIC, name);
    ASSERT_GE(id, 0) << name;
    EXPECT_EQ(loaded->numeric_data[loaded->numeric_adr[id]], 0.006) << name;
  }
  const auto ours = Predict(*model, recording_, set);
  const DataPtr d(mj_makeData(loaded.get()));
  std::vector<double> theirs;
  for (std::size_t k = 0; k < recording_.rows(); ++k) {
    theirs.push_back(d->qpos[1]);
    for (std::size_t c = 0; c < 2; ++c) d->ctrl[c] = recording_.commands[c].values[k];
    mj_step(loaded.get(), d.get());
  }
  EXPECT_LT(LargestDifference(ours[1], theirs), 1e-5 * Largest(theirs));
}

// Two discs that feel nothing of each other.
class OwnDelayTest : public SharedEffectTest {
 protected:
  OwnDelayTest()
      : SharedEffectTest(R"(<mujoco><option timestep="0.002" integrator="RK4" gravity="0 0 0"/><worldbody>
          <body><joint name="shoulder" damping="0.05"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 0.02"/></body>
          <body><joint name="elbow" damping="0.05"/><inertial pos="0 0 0" mass="1" diaginertia="1 1 0.02"/></body>
        </worldbody><actuator><motor name="first" joint="shoulder"/><motor name="second" joint="elbow"/></actuator>
        </mujoco>)") {}
};

TEST_F(OwnDelayTest, OneDrivesDelayIsNotTheOthers) {
  const auto plain = Predict(*base_, recording_);
  const auto late = Motion({"command_delay@second"}, {7 * 0.002});
  EXPECT_EQ(late[0], plain[0]);
  // What the drive would do under its command seven rows later.
  Recording shifted = recording_;
  auto& v = shifted.commands[1].values;
  std::rotate(v.begin(), v.end() - 7, v.end());
  std::fill_n(v.begin(), 7, recording_.commands[1].values[0]);
  EXPECT_LT(LargestDifference(late[1], Predict(*base_, shifted)[1]), 1e-12);
  EXPECT_GT(LargestDifference(late[1], plain[1]), 1e-3);
}

TEST_F(OwnDelayTest, AShiftOfAllCommandsIsLeftWhereOneOfThemIsNotLate) {
  const auto covers = [&](const char* text) { return MakeModel(experiment_, Parsed({text}))->DelaysEveryCommand(); };
  EXPECT_FALSE(base_->DelaysEveryCommand());
  EXPECT_FALSE(covers("command_delay@second"));
  EXPECT_TRUE(covers("command_delay@all"));
}

TEST(SharedEffectPlacesTest, OneDriveIsThatDrive) {
  // Two signals, one drive: what all signals share is what the drive does.
  const auto model = MakeModel(ShippedExperiment("qube"));
  for (const EffectUse& use : AllUses(*model->rig())) EXPECT_NE(use.on, "all") << use.Text();
  const auto uses = ParseEffects({"command_delay@all", "coulomb_friction@all", "sensor_delay@all"}, *model->rig());
  ASSERT_TRUE(uses.ok()) << uses.error().Text();
  EXPECT_EQ(uses.value(),
            (std::vector<EffectUse>{{"command_delay", "motor"}, {"coulomb_friction", "arm"}, {"sensor_delay", "all"}}));
  const auto twice = ParseEffects({"command_delay@all", "command_delay@motor"}, *model->rig());
  ASSERT_FALSE(twice.ok());
  EXPECT_NE(twice.error().Text().find("stands twice"), std::string::npos);
  const auto passive = ParseEffects({"backlash@pendulum"}, *model->rig());
  EXPECT_FALSE(passive.ok());
}

TEST(SharedEffectPlacesTest, CommandsOfTwoUnitsHaveNoCommonSize) {
  const Scratch scratch;
  const auto model =
      MakeModel(MakeExperiment(scratch, kArm, Replaced(kTwoLinks, "column: v, unit: N m", "column: v, unit: V")));
  const auto refused = ParseEffects({"dead_zone@all"}, *model->rig());
  ASSERT_FALSE(refused.ok());
  EXPECT_NE(refused.error().Text().find("allowed: first, second"), std::string::npos) << refused.error().Text();
  EXPECT_EQ(refused.error().Text().find("all\n"), std::string::npos);
  // Their delays have one.
  EXPECT_TRUE(ParseEffects({"command_delay@all"}, *model->rig()).ok());
}

}  // namespace
}  // namespace gapscope::testing
