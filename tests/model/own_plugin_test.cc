// Candidates whose torque a plugin of the user's makes: the example beside the same formula, and plugins that fail.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "src/model/plugin_library.h"
#include "tests/model/own_robot.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

const std::string kYaml = R"yaml(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
candidates:
  - name: formula
    joint: hinge
    torque: "amplitude_n_m * sin(angle - phase_rad)"
    parameters: &gear
      amplitude_n_m: {unit: N m, bounds: [0, 1], trials: [0.1]}
      phase_rad: {unit: rad, bounds: [-3.2, 3.2], trials: [-1.6, 0, 1.6]}
  - name: gear
    joint: hinge
    plugin: acme.gear
    config: {table: "1 2 3"}
    parameters: *gear
)yaml";

std::string Faulty(const std::string& plugin) {
  return "  - name: " + plugin + "\n    joint: hinge\n    plugin: faulty." + plugin +
         "\n    parameters: {size: {unit: N m, bounds: [0, 1], trials: [0.1]}}\n";
}

class OwnPluginTest : public ::testing::Test {
 protected:
  static void SetUpTestSuite() {
    const auto loaded = LoadPluginLibraries({GAPSCOPE_EXAMPLE_PLUGIN, GAPSCOPE_FAULTY_PLUGINS});
    ASSERT_TRUE(loaded.ok());
    EXPECT_TRUE(loaded.value().empty()) << loaded.value().front();
  }
  // The rig's error, or "".
  std::string ErrorOf(const std::string& yaml) {
    const auto rig = Rig::Load(MakeExperiment(scratch_, kOwnRobot, yaml));
    return rig.ok() ? "" : rig.error().Text();
  }
  std::string WhyLeftOut(const std::string& plugin) {
    const auto rig = Rig::Load(MakeExperiment(scratch_, kOwnRobot, kYaml + Faulty(plugin)));
    if (!rig.ok()) return "error: " + rig.error().Text();
    const auto& effects = rig.value()->effects();
    EXPECT_TRUE(std::any_of(effects.begin(), effects.end(), [](const Effect& e) { return e.name == "gear"; }));
    EXPECT_FALSE(std::any_of(effects.begin(), effects.end(), [&](const Effect& e) { return e.name == plugin; }));
    const auto& left_out = rig.value()->left_out();
    return left_out.size() == 1 && left_out[0].name == plugin ? left_out[0].why : "not left out";
  }
  Scratch scratch_;
};

TEST_F(OwnPluginTest, MovesAsTheSameFormula) {
  const Experiment experiment = MakeExperiment(scratch_, kOwnRobot, kYaml);
  const Recording recording =
      MakeRecording(experiment, 400, 0.001, [](int, double t) { return 0.2 * std::sin(9 * t); });
  const auto with = [&](const std::string& name, double amplitude) {
    return Predict(*MakeModel(experiment, {{name, "hinge"}}), recording,
                   {{name + "@hinge.amplitude_n_m", amplitude}, {name + "@hinge.phase_rad", 0.7}})[0];
  };
  EXPECT_LT(LargestDifference(with("gear", 0.4), with("formula", 0.4)), 1e-12);
  EXPECT_GT(LargestDifference(with("gear", 0.4), with("gear", 0)), 0.01);
  EXPECT_LT(LargestDifference(with("gear", 0), Predict(*MakeModel(experiment), recording)[0]), 1e-9);
}

// What a formula's text says of its parameters shows in the torques that a plugin makes.
TEST_F(OwnPluginTest, SaysWhatTheSameFormulaSays) {
  const auto rig = Rig::Load(MakeExperiment(scratch_, kOwnRobot, kYaml)).value();
  const Effect &gear = EffectOf({"gear", "hinge"}, *rig), &formula = EffectOf({"formula", "hinge"}, *rig);
  ASSERT_EQ(gear.parameters.size(), 2u);
  for (std::size_t i = 0; i < 2; ++i) {
    EXPECT_EQ(gear.parameters[i].key, formula.parameters[i].key);
    EXPECT_EQ(gear.parameters[i].role, formula.parameters[i].role);
    EXPECT_EQ(gear.parameters[i].with, formula.parameters[i].with);
    EXPECT_EQ(gear.parameters[i].of_torque, formula.parameters[i].of_torque);
  }
  EXPECT_TRUE(gear.of_motion);
}

TEST_F(OwnPluginTest, IsInTheExportedModel) {
  const auto model = MakeModel(MakeExperiment(scratch_, kOwnRobot, kYaml), {{"gear", "hinge"}});
  const auto xml = model->ToXml(ValuesWith(*model, {{"gear@hinge.amplitude_n_m", 0.25}}), {}, {});
  ASSERT_TRUE(xml.ok()) << xml.error().Text();
  char message[1000] = "";
  const ModelPtr loaded(mj_loadXML(scratch_.Write("out.xml", xml.value()).c_str(), nullptr, message, sizeof message));
  ASSERT_TRUE(loaded) << message;
  EXPECT_EQ(
      loaded
          ->numeric_data[loaded->numeric_adr[mj_name2id(loaded.get(), mjOBJ_NUMERIC, "hinge.own.gear.amplitude_n_m")]],
      0.25);
  const int text = mj_name2id(loaded.get(), mjOBJ_TEXT, "hinge.own.gear.table");
  ASSERT_GE(text, 0);
  EXPECT_STREQ(loaded->text_data + loaded->text_adr[text], "1 2 3");
}

TEST_F(OwnPluginTest, OneThatFailsIsLeftOut) {
  EXPECT_EQ(WhyLeftOut("crashes"), "it crashes: Segmentation fault");
  EXPECT_NE(WhyLeftOut("fatal").find("the table is empty"), std::string::npos);
  EXPECT_NE(WhyLeftOut("refuses").find("the plugin 'faulty.refuses' refuses the model"), std::string::npos);
  EXPECT_NE(WhyLeftOut("drives").find("is not passive"), std::string::npos);
  EXPECT_NE(WhyLeftOut("absent").find("no library that is loaded registers the plugin 'faulty.absent'"),
            std::string::npos);
  const auto rig = Rig::Load(MakeExperiment(scratch_, kOwnRobot, kYaml + Faulty("crashes"))).value();
  const auto asked = ParseEffects({"crashes"}, *rig);
  ASSERT_FALSE(asked.ok());
  EXPECT_NE(asked.error().Text().find("'crashes' is left out: it crashes"), std::string::npos);
}

TEST_F(OwnPluginTest, ErrorsSayWhatAndWhere) {
  const auto says = [&](const std::string& yaml, const std::string& text) {
    const std::string error = ErrorOf(yaml);
    EXPECT_NE(error.find(text), std::string::npos) << error;
    EXPECT_NE(error.find("experiment.yaml:"), std::string::npos) << error;
  };
  says(kYaml + Faulty("idle"), "the parameter 'size' does nothing in the plugin 'faulty.idle'");
  says(kYaml + Faulty("pushes"), "the torque of 'pushes' is not zero at the neutral values");
  const auto refused = [&](std::string yaml, const std::string& from, const std::string& to, const std::string& text) {
    yaml.replace(yaml.find(from), from.size(), to);
    scratch_.Write("robot.xml", kOwnRobot);
    const auto read = LoadExperiment(scratch_.Write("experiment.yaml", "model: robot.xml\n" + yaml));
    ASSERT_FALSE(read.ok()) << to;
    EXPECT_NE(read.error().Text().find(text), std::string::npos) << read.error().Text();
  };
  refused(kYaml, "config: {table: \"1 2 3\"}", "config: {joint: wrist}", "'joint' is the candidate's");
  refused(kYaml, "config: {table: \"1 2 3\"}", "config: {amplitude_n_m: 2}", "means something else");
  refused(kYaml, "plugin: acme.gear", "torque: \"amplitude_n_m\"", "'config' is of a plugin");
  refused(kYaml, "plugin: acme.gear", "plugin: acme.gear\n    torque: \"angle\"", "neither a torque nor a change");
}

TEST(PluginLibraryTest, WhatDoesNotLoadIsLeftOut) {
  const Scratch scratch;
  const auto text = LoadPluginLibraries({scratch.Write("text.so", "no library")});
  ASSERT_TRUE(text.ok());
  ASSERT_EQ(text.value().size(), 1u);
  EXPECT_NE(text.value()[0].find("text.so' is left out: "), std::string::npos) << text.value()[0];
  const auto missing = LoadPluginLibraries({scratch.Write("text.so", "") + ".not"});
  ASSERT_FALSE(missing.ok());
  EXPECT_NE(missing.error().Text().find("no such plugin library"), std::string::npos);
}

}  // namespace
}  // namespace gapscope::testing
