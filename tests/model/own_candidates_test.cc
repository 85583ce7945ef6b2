// Candidates of an experiment's own: beside MuJoCo's native elements, by the names that commands use, in the exported
// model; and what is refused, with its line.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/model/own_robot.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

const std::string kCandidatesYaml = R"(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
parameters:
  hinge.damping: {unit: N m s/rad, nominal: 0.05, bounds: [0, 1]}
set: {joint/hinge/damping: hinge.damping}
)";
const std::string kCandidates = R"yaml(candidates:
  - name: soft_cable
    joint: hinge
    torque: "-k * (angle - rest)"
    parameters:
      rest: {unit: rad, bounds: [-2, 2], trials: [-0.5, 0.5]}
      k: {unit: N m/rad, bounds: [0, 1], trials: [0.1, 0.3]}
  - name: eccentric
    joint: hinge
    doc: "the gear runs out of true"
    torque: "a * sin(angle - phase)"
    parameters:
      a: {unit: N m, bounds: [0, 1], trials: [0.1]}
      phase: {unit: rad, bounds: [-3.2, 3.2], trials: [-1.6, 0, 1.6]}
  - name: leaky_drive
    joint: hinge
    torque: "-share * command"
    parameters: {share: {unit: 1, bounds: [0, 0.5], trials: [0.1]}}
  - name: heavier_tip
    set: {body/tip/mass: tip_kg}
    parameters: {tip_kg: {unit: kg, bounds: [0, 0.1], neutral: 0.02, trials: [0.03]}}
  - name: spring
    set: {joint/hinge/stiffness: k}
    parameters: {k: {unit: N m/rad, bounds: [0, 1], trials: [0.1]}}
  - name: sticky
    set: {joint/hinge/damping: hinge.damping * (1 + more)}
    parameters: {more: {unit: 1, bounds: [0, 10], trials: [1]}}
without: [cogging, quadratic_drag@wrist]
)yaml";

class OwnCandidatesTest : public ::testing::Test {
 protected:
  OwnCandidatesTest()
      : experiment_(MakeExperiment(scratch_, kOwnRobot, kCandidatesYaml + kCandidates)),
        recording_(MakeRecording(experiment_, 400, 0.001,
                                 [](int, double t) { return 0.2 * std::sin(9 * t) + (t > 0.2 ? 0.1 : 0); })) {}
  std::vector<double> With(const std::vector<EffectUse>& uses, const std::map<std::string, double>& set) {
    return Predict(*MakeModel(experiment_, uses), recording_, set)[0];
  }
  std::vector<double> Native(const std::string& from, const std::string& to) {
    std::string robot = kOwnRobot;
    robot.replace(robot.find(from), from.size(), to);
    const Scratch scratch;
    return Predict(*MakeModel(MakeExperiment(scratch, robot, kCandidatesYaml)), recording_)[0];
  }
  Scratch scratch_;
  Experiment experiment_;
  Recording recording_;
};

TEST_F(OwnCandidatesTest, MoveAsTheNativeElement) {
  constexpr double kRounding_rad = 1e-9;  // a massless body holds the plugin
  const auto cable = With({{"soft_cable", "hinge"}}, {{"soft_cable@hinge.k", 0.25}, {"soft_cable@hinge.rest", 0.3}});
  EXPECT_LT(LargestDifference(cable, Native("damping=\"0.05\"",
                                            "damping=\"0.05\" stiffness=\"0.25\" springref=\"17.188733853924695\"")),
            kRounding_rad);
  const auto heavy = With({{"heavier_tip", "tip"}}, {{"heavier_tip@tip.tip_kg", 0.05}});
  EXPECT_LT(LargestDifference(heavy, Native("mass=\"0.02\"", "mass=\"0.05\"")), kRounding_rad);
  // The command, less a share of it, is a motor of smaller gain.
  const auto leaky = With({{"leaky_drive", "hinge"}}, {{"leaky_drive@hinge.share", 0.25}});
  EXPECT_LT(LargestDifference(leaky, Native("joint=\"hinge\"/>", "joint=\"hinge\" gear=\"0.75\"/>")), kRounding_rad);
  const std::string sprung = "damping=\"0.05\" stiffness=\"0.25\"";
  EXPECT_LT(
      LargestDifference(With({{"spring", "hinge"}}, {{"spring@hinge.k", 0.25}}), Native("damping=\"0.05\"", sprung)),
      kRounding_rad);
  // Beside an effect of the catalogue on the same field both act.
  const auto both = With({{"spring", "hinge"}, {"cable_spring", "hinge"}},
                         {{"spring@hinge.k", 0.125}, {"cable_spring@hinge.stiffness_n_m_per_rad", 0.125}});
  EXPECT_LT(LargestDifference(both, Native("damping=\"0.05\"", sprung)), kRounding_rad);
  // A field that the experiment sets takes the candidate's expression, of the experiment's parameters too.
  const auto sticky = With({{"sticky", "hinge"}}, {{"sticky@hinge.more", 3}});
  EXPECT_LT(LargestDifference(sticky, With({}, {{"hinge.damping", 0.2}})), kRounding_rad);
  EXPECT_GT(LargestDifference(sticky, With({}, {})), 0.01);
}

TEST_F(OwnCandidatesTest, DoNothingAtTheirNeutralValues) {
  const auto plain = With({}, {});
  const auto model = MakeModel(experiment_);
  for (const Effect& effect : model->rig()->effects()) {
    if (effect.place != EffectPlace::kNamed) continue;
    EXPECT_LT(LargestDifference(With({{effect.name, effect.on}}, {}), plain), 1e-9) << effect.name;
  }
}

// A late command is the host's in a replay and the plugin's own in the exported model.
TEST_F(OwnCandidatesTest, AreInTheExportedModel) {
  const std::map<std::string, double> set = {{"eccentric@hinge.a", 0.1},
                                             {"eccentric@hinge.phase", 0.7},
                                             {"leaky_drive@hinge.share", 0.25},
                                             {"heavier_tip@tip.tip_kg", 0.05},
                                             {"command_delay@motor.delay_s", 0.0135}};
  const std::vector<std::vector<EffectUse>> sets = {
      {{"eccentric", "hinge"}},
      {{"heavier_tip", "tip"}},
      {{"leaky_drive", "hinge"}},
      {{"command_delay", "motor"}, {"eccentric", "hinge"}, {"leaky_drive", "hinge"}}};
  for (const auto& uses : sets) {
    const auto model = MakeModel(experiment_, uses);
    ASSERT_TRUE(model);
    std::map<std::string, double> values;
    for (const auto& [name, value] : set) {
      if (model->IndexOf(name) >= 0) values[name] = value;
    }
    const auto xml = model->ToXml(ValuesWith(*model, values), {}, {});
    ASSERT_TRUE(xml.ok()) << xml.error().Text();
    char message[1000] = "";
    const ModelPtr loaded(mj_loadXML(scratch_.Write("out.xml", xml.value()).c_str(), nullptr, message, sizeof message));
    ASSERT_TRUE(loaded) << message;
    const DataPtr d(mj_makeData(loaded.get()));
    std::vector<double> rolled;
    for (std::size_t k = 0; k < recording_.rows(); ++k) {
      rolled.push_back(d->qpos[loaded->jnt_qposadr[mj_name2id(loaded.get(), mjOBJ_JOINT, "hinge")]]);
      d->ctrl[0] = recording_.commands[0].values[k];
      mj_step(loaded.get(), d.get());
    }
    constexpr double kPrinted = 1e-5;  // what MuJoCo's writer leaves of a number
    const auto ours = Predict(*model, recording_, values)[0];
    EXPECT_LT(LargestDifference(ours, rolled), kPrinted * Largest(ours)) << uses.front().Text();
  }
}

TEST_F(OwnCandidatesTest, AreFoundByName) {
  const auto model = MakeModel(experiment_);
  const Rig& rig = *model->rig();
  const auto uses = AllUses(rig);
  const auto has = [&](const EffectUse& use) { return std::find(uses.begin(), uses.end(), use) != uses.end(); };
  EXPECT_TRUE(has({"soft_cable", "hinge"}) && has({"heavier_tip", "tip"}) && has({"quadratic_drag", "hinge"}));
  EXPECT_FALSE(has({"cogging", "hinge"}) || has({"quadratic_drag", "wrist"}));
  EXPECT_EQ(ParseEffects({"eccentric"}, rig).value(), (std::vector<EffectUse>{{"eccentric", "hinge"}}));
  EXPECT_EQ(UseWithParameter("heavier_tip@tip.tip_kg", rig), (EffectUse{"heavier_tip", "tip"}));
  EXPECT_EQ(EffectTitle("heavier_tip"), "heavier tip");
  for (const auto& [text, says] : {std::pair{"eccentrik", "did you mean 'eccentric'?"},
                                   {"cogging", "switched off for this experiment"},
                                   {"quadratic_drag@wrist", "take it out of 'without'"},
                                   {"eccentric@wrist", "allowed: hinge"}}) {
    const auto refused = ParseEffects({text}, rig);
    ASSERT_FALSE(refused.ok()) << text;
    EXPECT_NE(refused.error().Text().find(says), std::string::npos) << refused.error().Text();
  }
}

// What the catalogue's files state is seen from the expressions: sizes first, angles and rests of the first one.
TEST_F(OwnCandidatesTest, SayWhatTheirExpressionsSay) {
  const auto model = MakeModel(experiment_);
  const Effect &cable = EffectOf({"soft_cable", "hinge"}, *model->rig()),
               &eccentric = EffectOf({"eccentric", "hinge"}, *model->rig()),
               &leaky = EffectOf({"leaky_drive", "hinge"}, *model->rig());
  EXPECT_EQ(cable.parameters[0].key, "k");
  EXPECT_EQ(cable.parameters[1].role, ParameterRole::kPlace);
  EXPECT_EQ(cable.parameters[1].with, Parameter::With::kRest);
  EXPECT_EQ(eccentric.parameters[1].with, Parameter::With::kAngle);
  EXPECT_EQ(eccentric.parameters[1].start, -1.6);
  EXPECT_TRUE(cable.of_motion && eccentric.of_motion);
  EXPECT_FALSE(leaky.of_motion);
  EXPECT_EQ(eccentric.meaning, "the gear runs out of true");
}

TEST(OwnCandidateErrorsTest, SayWhatAndWhere) {
  struct Case {
    const char* from;
    const char* to;
    std::vector<const char*> says;
  };
  // Candidates begin in line 9: line 1 is "model:", the experiment has seven more.
  const std::vector<Case> cases = {
      {"a * sin(angle - phase)", "a * sin(angl - phase)", {"experiment.yaml:19:", "did you mean 'angle'?"}},
      {"a * sin(angle - phase)", "a * sin(angle - phase", {"experiment.yaml:19:", "bad expression"}},
      {"a * sin(angle - phase)", "a * sin(angle)", {"experiment.yaml:22:7", "'phase' does not enter"}},
      {"a * sin(angle - phase)", "1 + a * sin(angle - phase)", {"experiment.yaml:19:", "not zero at the neutral"}},
      {"a: {unit: N m, bounds: [0, 1]", "a: {unit: N m, bounds: [1, 0]", {"experiment.yaml:21:", "low below high"}},
      {"a: {unit: N m, bounds: [0, 1]", "a: {unit: N m, bounds: [0, .inf]", {"experiment.yaml:21:", "finite"}},
      {"a: {unit: N m, bounds: [0, 1]", "a: {unit: N m", {"experiment.yaml:21:", "has no bounds"}},
      {"a: {unit: N m, bounds",
       "a: {unit: Nm, bounds",
       {"experiment.yaml:21:", "unknown unit", "write the value in N m"}},
      {"a: {unit: N m, bounds", "a: {unit: N q, bounds", {"experiment.yaml:21:", "unknown unit", "as in N m s/rad"}},
      {"trials: [0.1]}\n      phase", "trials: [2]}\n      phase", {"experiment.yaml:21:", "'trials'", "outside its"}},
      {"trials: [0.1]}\n      phase", "trials: [0]}\n      phase", {"no values to be tried at", "add 'trials"}},
      {"phase: {unit", "angle: {unit", {"experiment.yaml:22:7", "means something else"}},
      {"name: eccentric", "name: backlash", {"experiment.yaml:16:", "the catalogue has an effect"}},
      {"name: eccentric", "name: soft_cable", {"experiment.yaml:16:", "stands twice"}},
      {"name: eccentric", "name: two@words", {"experiment.yaml:16:", "not a name of a candidate"}},
      {"name: eccentric\n    joint: hinge",
       "name: eccentric\n    joint: hing",
       {"experiment.yaml:16:", "did you mean 'hinge'?"}},
      {"name: eccentric\n    joint: hinge", "name: eccentric", {"neither a torque nor a change of fields"}},
      {"share: {unit: 1,", "share: {unit: s,", {"experiment.yaml:25:", "not in N m", "kg m^2 s^-1"}},
      {"sin(angle - phase)", "sin(angle - speed * phase)", {"experiment.yaml:19:", "1 beside s^-1"}},
      {"name: leaky_drive\n    joint: hinge", "name: leaky_drive\n    joint: wrist", {"has no drive"}},
      {"body/tip/mass", "body/tipp/mass", {"experiment.yaml:28:", "did you mean 'tip'?"}},
      {"body/tip/mass", "body/tip/mas", {"experiment.yaml:28:", "did you mean 'mass'?"}},
      {"body/tip/mass", "body/tip/ipos", {"experiment.yaml:28:", "has 3 numbers"}},
      {"neutral: 0.02", "neutral: 0.03", {"experiment.yaml:28:", "another one at the neutral"}},
      {"hinge.damping * (1", "hinge.dampin * (1", {"experiment.yaml:34:", "did you mean 'hinge.damping'?"}},
      {"without: [cogging", "without: [coging", {"experiment.yaml:36:11", "did you mean 'cogging'?"}},
      {"quadratic_drag@wrist", "quadratic_drag@wrst", {"experiment.yaml:36:", "did you mean 'wrist'?"}},
      {"without: [cogging, quadratic_drag@wrist]", "without: cogging", {"experiment.yaml:36:", "not a list"}},
  };
  for (const Case& c : cases) {
    std::string yaml = "model: robot.xml\n" + kCandidatesYaml + kCandidates;
    const std::size_t at = yaml.find(c.from);
    ASSERT_NE(at, std::string::npos) << c.from;
    yaml.replace(at, std::string(c.from).size(), c.to);
    const Scratch scratch;
    scratch.Write("robot.xml", kOwnRobot);
    const auto experiment = LoadExperiment(scratch.Write("experiment.yaml", yaml));
    std::string message = experiment.ok() ? "" : experiment.error().Text();
    if (experiment.ok()) {
      const auto model = Model::Load(experiment.value());
      message = model.ok() ? "" : model.error().Text();
    }
    for (const char* says : c.says) EXPECT_NE(message.find(says), std::string::npos) << c.to << ":\n" << message;
  }
}

}  // namespace
}  // namespace gapscope::testing
