// What does not build says why, and where in which file.
#include <gtest/gtest.h>

#include "src/model/parameter_writer.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr const char* kErrorsRobot = R"(<mujoco>
  <option><flag contact="disable"/></option>
  <worldbody>
    <body name="bar"><joint name="hinge" axis="0 1 0"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body>
    <body name="ball" pos="1 0 0"><joint name="ball" type="ball"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body>
  </worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
  <sensor><subtreecom name="centre" body="bar"/><framequat name="turn" objtype="body" objname="bar"/>
    <jointvel name="late" joint="hinge" delay="0.01" nsample="10"/><user name="own" dim="1"/></sensor>
</mujoco>)";
constexpr const char* kErrorsYaml = R"(commands:
  - {actuator: motor, column: u, unit: N m}
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
parameters:
  hinge.damping: {unit: N m s/rad, nominal: 0.1, bounds: [0, 1]}
set:
  joint/hinge/damping: hinge.damping
)";

std::string MessageOf(const std::string& mjcf, const std::string& yaml) {
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(scratch, mjcf, yaml);
  const auto built = Model::Load(experiment);
  return built.ok() ? "" : built.error().Text();
}

TEST(BuildErrorsTest, NamesAndExpressionsOfTheExperiment) {
  EXPECT_EQ(MessageOf(kErrorsRobot, kErrorsYaml), "");
  struct Broken {
    const char* from;
    const char* to;
    std::vector<const char*> says;
  };
  // The setting's key stands in line 9 (line 1 is "model:"), column 3.
  const std::vector<Broken> cases = {
      {"{actuator: motor",
       "{actuator: moter",
       {"experiment.yaml", "actuator that the MJCF lacks", "did you mean 'motor'?"}},
      {"joint: hinge,", "joint: hing,", {"experiment.yaml", "joint that the MJCF lacks", "did you mean 'hinge'?"}},
      {"joint: hinge,", "joint: ball,", {"neither hinge nor slide"}},
      {"joint: hinge, unit: rad",
       "actuator: moter, kind: torque",
       {"actuator that the MJCF lacks", "did you mean 'motor'?"}},
      {"unit: rad",
       "unit: rad, filter: {cutoff_rad_per_s: hinge.damping, damping_ratio: hinge.ofset}",
       {"no such parameter", "filter of signal", "'hinge.ofset'"}},
      {"unit: rad", "unit: rad, offset: hinge.ofset", {"no such parameter", "'hinge.ofset'"}},
      {"joint: hinge,", "sensor: center, element: 0,", {"experiment.yaml:5:5:", "did you mean 'centre'?"}},
      {"joint: hinge, unit: rad", "sensor: centre, unit: m", {"experiment.yaml:5:5:", "several elements", "0 to 2"}},
      {"joint: hinge, unit: rad", "sensor: centre, element: 3", {"no such element", "got 3", "0 to 2"}},
      {"joint: hinge,", "sensor: centre, element: 2,", {"does not fit its sensor", "'rad'", "units of m"}},
      {"column: q, joint: hinge, unit: rad",
       "sensor: centre, columns_of_elements: [x, y]",
       {"experiment.yaml:5:5:", "another number of elements", "got 2", "allowed: 3"}},
      {"joint: hinge, unit: rad", "sensor: turn, element: 1", {"is an orientation", "columns_of_elements"}},
      {"joint: hinge, unit: rad", "sensor: own", {"a program's own callback"}},
      {"joint: hinge, unit: rad", "sensor: late", {"a delay or an interval of its own", "sensor_delay@q"}},
      {"joint/hinge/damping:", "joint/hinge/dampin:", {"experiment.yaml:9:3:", "did you mean 'damping'?"}},
      {"joint/hinge/damping:", "joint/hnge/damping:", {"experiment.yaml:9:3:", "did you mean 'hinge'?"}},
      {"joint/hinge/damping:", "hinge damping:", {"experiment.yaml:9:3:", "not a field"}},
      {"damping: hinge.damping", "damping: hinge.dampng", {"experiment.yaml:9:3:", "did you mean 'hinge.damping'?"}},
      {"damping: hinge.damping", "damping: 2 * (hinge.damping", {"experiment.yaml:9:3:", "bad expression"}},
      {"damping: hinge.damping", "damping: nan", {"experiment.yaml:9:3:", "bad expression"}},
      {"damping: hinge.damping",
       "damping: [hinge.damping, \"0\"]",
       {"experiment.yaml:9:3:", "has 1 numbers", "2 expressions"}},
      {"joint/hinge/damping:", "body/bar/inertia:", {"experiment.yaml:9:3:", "has 3 numbers", "1 expressions"}},
  };
  for (const Broken& test : cases) {
    const std::string message = MessageOf(kErrorsRobot, Replaced(kErrorsYaml, test.from, test.to));
    ASSERT_NE(message, "") << "accepted: " << test.to;
    for (const char* part : test.says)
      EXPECT_NE(message.find(part), std::string::npos) << message << "\nlacks: " << part;
  }
}

TEST(BuildErrorsTest, TheMjcf) {
  struct Broken {
    const char* from;
    const char* to;
    const char* says;
  };
  const std::vector<Broken> cases = {
      {"<mujoco>", "<mujoko>", "cannot read the MJCF"},
      {"</mujoco>", "", "cannot read the MJCF"},
      {"mass=\"1\"", "mass=\"-1\"", "mass"},
      {"joint=\"hinge\"/>", "joint=\"nowhere\"/>", "nowhere"},
      {"axis=\"0 1 0\"", "axis=\"0 0 0\"", "axis"},
      {"<option>", "<option timestep=\"0\">", "timestep"},
      {"<option>", "<size nuserdata=\"2000000000\"/><option>", "nuserdata"},
      {"<option>", "<size nuser_body=\"2000000000\"/><option>", "nuser_body"},
      {"dim=\"1\"", "dim=\"2000000000\"", "sensor"},
      {"<option>", "<asset><hfield name=\"h\" nrow=\"65536\" ncol=\"65537\" size=\"1 1 1 1\"/></asset><option>",
       "height field"},
      {"<motor name=\"motor\" joint=\"hinge\"/>", "<plugin name=\"motor\" joint=\"hinge\" plugin=\"no.such\"/>",
       "plugin"},
      {"<actuator><motor name=\"motor\" joint=\"hinge\"/></actuator>",
       "<extension><plugin plugin=\"gapscope.motor\"/></extension><actuator><plugin name=\"motor\" joint=\"hinge\" "
       "plugin=\"gapscope.motor\"><config key=\"law\" value=\"magic\"/></plugin></actuator>",
       "law"},
  };
  for (const Broken& test : cases) {
    const std::string message = MessageOf(Replaced(kErrorsRobot, test.from, test.to), kErrorsYaml);
    EXPECT_NE(message.find("robot.xml"), std::string::npos) << test.to << ": " << message;
    EXPECT_NE(message.find(test.says), std::string::npos) << test.to << ": " << message;
    EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  }
  EXPECT_NE(MessageOf("", kErrorsYaml).find("robot.xml"), std::string::npos);
  EXPECT_NE(MessageOf(std::string("\x7f\0\x01", 3), kErrorsYaml).find("robot.xml"), std::string::npos);
  const Scratch scratch;
  Experiment experiment = MakeExperiment(scratch, kErrorsRobot, kErrorsYaml);
  experiment.model_path = scratch.Path("none.xml");
  const auto built = Model::Load(experiment);
  ASSERT_FALSE(built.ok());
  EXPECT_NE(built.error().Text().find("none.xml"), std::string::npos);
}

TEST(BuildErrorsTest, EffectUses) {
  const Scratch scratch;
  const auto model = MakeModel(MakeExperiment(scratch, kErrorsRobot, kErrorsYaml));
  const auto message = [&](std::vector<std::string> texts) {
    const auto uses = ParseEffects(texts, *model->rig());
    return uses.ok() ? "" : uses.error().Text();
  };
  const auto uses = ParseEffects({"coulomb_friction", "torque_limit@motor", "sensor_delay@q"}, *model->rig());
  ASSERT_TRUE(uses.ok()) << uses.error().Text();
  EXPECT_EQ(uses.value()[0], (EffectUse{"coulomb_friction", "hinge"}));
  EXPECT_EQ(uses.value()[1].Text(), "torque_limit@motor");
  EXPECT_NE(message({"coulomb_fricton"}).find("did you mean 'coulomb_friction'?"), std::string::npos);
  EXPECT_NE(message({"coulomb_friction@hing"}).find("cannot act there"), std::string::npos);
  EXPECT_NE(message({"coulomb_friction@motor"}).find("allowed: hinge"), std::string::npos)
      << message({"coulomb_friction@motor"});
  EXPECT_NE(message({"spring_hardening"}).find("makes no sense"), std::string::npos);
  EXPECT_NE(message({"torque_delay"}).find("makes no sense"), std::string::npos);  // not a servo
  EXPECT_NE(message({"backlash", "backlash@hinge"}).find("stands twice"), std::string::npos);
  for (const char* text :
       {"", "@", "@hinge", "coulomb_friction@", "coulomb_friction@@hinge", "coulomb_friction hinge", "\xff"}) {
    EXPECT_NE(message({text}).find("--with"), std::string::npos) << text << ": " << message({text});
  }
}

TEST(EffectPlacesTest, AMotorWithoutALawIsAServo) {
  const auto possible = [](const std::string& config) {
    const Scratch scratch;
    const std::string mjcf = R"(<mujoco><extension><plugin plugin="gapscope.motor"><instance name="drive">)" + config +
                             R"(</instance></plugin></extension>
      <worldbody><body><joint name="hinge"/><geom size="0.1"/></body></worldbody>
      <actuator><plugin name="motor" joint="hinge" plugin="gapscope.motor" instance="drive"/></actuator></mujoco>)";
    const auto model = MakeModel(MakeExperiment(scratch, mjcf,
                                                "commands:\n  - {actuator: motor, column: u}\nmeasured:\n  - {signal: "
                                                "q, column: q, joint: hinge, unit: rad}\n"));
    const auto uses = AllUses(*model->rig());
    return std::find(uses.begin(), uses.end(), EffectUse{"torque_delay", "motor"}) != uses.end();
  };
  const std::string kp = "<config key=\"kp\" value=\"2\"/>", law = "<config key=\"law\" value=";
  EXPECT_TRUE(possible(kp)) << "position is the default";
  EXPECT_TRUE(possible(kp + law + "\"position\"/>"));
  EXPECT_FALSE(possible(law + "\"torque\"/>"));
}

TEST(ParameterWriterTest, RefusesWhatIsNotFiniteOrNotPhysical) {
  const Scratch scratch;
  const std::string yaml = std::string(kErrorsYaml) +
                           "  body/bar/mass: 1 - hinge.damping\n  body/bar/ipos: [\"1 / (hinge.damping - 0.5)\", "
                           "\"0\", \"0\"]\n  body/bar/inertia: [\"0.5\", \"0.9 - hinge.damping\", \"0.5\"]\n";
  const auto model = MakeModel(MakeExperiment(scratch, kErrorsRobot, yaml));
  ASSERT_NE(model, nullptr);
  const ModelPtr copy(mj_copyModel(nullptr, &model->compiled()));
  const DataPtr data(mj_makeData(copy.get()));
  ParameterWriter writer(*model, copy.get(), data.get());
  EXPECT_TRUE(writer.Write(std::vector<double>{0.25}, {}));
  EXPECT_EQ(copy->dof_damping[0], 0.25);
  EXPECT_EQ(copy->body_mass[1], 0.75);
  EXPECT_FALSE(writer.Write(std::vector<double>{0.5}, {})) << "1 / 0";
  EXPECT_FALSE(writer.Write(std::vector<double>{NAN}, {}));
  EXPECT_FALSE(writer.Write(std::vector<double>{INFINITY}, {}));
  EXPECT_FALSE(writer.Write(std::vector<double>{1.5}, {})) << "a negative mass";
  EXPECT_FALSE(writer.Write(std::vector<double>{0.95}, {})) << "a negative inertia";
  EXPECT_FALSE(writer.Write(std::vector<double>{-0.2}, {})) << "a moment above the sum of the others";
  EXPECT_TRUE(writer.Write(std::vector<double>{0.1}, {}));
}

}  // namespace
}  // namespace gapscope::testing
