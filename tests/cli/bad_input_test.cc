// What a user's experiment file says wrongly of an MJCF: status 2, one line with file, line and column, nothing
// written.
#include <gtest/gtest.h>

#include <cmath>
#include <filesystem>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

constexpr char kRobot[] = R"(<mujoco>
  <worldbody>
    <body name="base" pos="0 0 1"><freejoint/><inertial pos="0 0 0" mass="1" diaginertia="0.1 0.1 0.1"/>
      <body name="rod"><joint name="hinge" axis="0 1 0"/>
        <inertial pos="0 0 -0.2" mass="1" diaginertia="0.02 0.02 0.001"/><site name="imu"/></body></body>
  </worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
  <sensor><gyro name="gyro" site="imu"/><framequat name="turn" objtype="site" objname="imu"/></sensor>
</mujoco>
)";
constexpr char kGood[] = R"(model: robot.xml
log: {time: {column: t, unit: s}}
hold: [base]
commands: [{actuator: motor, column: u, unit: N m}]
measured:
  - {signal: q, column: q, joint: hinge, unit: rad}
parameters: {p: {unit: kg, nominal: 1, frozen: true}, damping: {unit: N m s/rad, nominal: 0.1, bounds: [0, 1]}}
set:
  joint/hinge/damping: damping
)";

struct Mistake {
  std::string from, to;
  int line;
  const char* says;
};

class BadInputTest : public ::testing::Test {
 protected:
  void SetUp() override {
    scratch_.Write("robot.xml", kRobot);
    std::string log = "t,u,q,x,y,z,w\n";
    for (int k = 0; k < 200; ++k) {
      const std::string wave = std::to_string(0.1 * std::sin(0.05 * k));
      log += std::to_string(0.005 * k) + "," + wave + "," + wave + ",0,0,0,1\n";
    }
    scratch_.Write("log.csv", log);
  }
  Answer Tune(const std::string& yaml, const std::string& log = "log.csv") {
    scratch_.Write("experiment.yaml", yaml);
    return scratch_.Shell("cd '" + scratch_.Path("") + "' && '" GAPSCOPE_PROGRAM "' tune experiment.yaml " + log +
                          " --starts 1 --budget 5 --out out");
  }
  void ExpectRefused(const Answer& answer, const std::string& where, const std::string& says) {
    EXPECT_EQ(answer.status, 2) << answer.err;
    EXPECT_EQ(answer.out, "");
    EXPECT_NE(answer.err.find(where), std::string::npos) << answer.err << "lacks " << where;
    EXPECT_NE(answer.err.find(says), std::string::npos) << answer.err << "lacks " << says;
    EXPECT_FALSE(std::filesystem::exists(scratch_.Path("out"))) << "something was written";
  }
  Scratch scratch_;
};

TEST_F(BadInputTest, TheGoodFileIsGood) {
  const Answer answer = Tune(kGood);
  EXPECT_EQ(answer.status, 0) << answer.err;
}

TEST_F(BadInputTest, EachMistakeHasItsLine) {
  const std::string measured = "unit: rad}\n", set = "joint/hinge/damping: damping\n", act = "actuators:\n  - ";
  const std::vector<Mistake> mistakes = {
      {"joint: hinge,", "joint: hing,", 6, "did you mean 'hinge'?"},
      {measured, measured + "  - {signal: g, sensor: gyr, element: 0, column: x}\n", 7, "did you mean 'gyro'?"},
      {measured, measured + "  - {signal: b, body: rodd, columns_of_elements: [x, y, z]}\n", 7, "did you mean 'rod'?"},
      {measured, measured + "  - {signal: b, site: im, columns_of_elements: [x, y, z]}\n", 7, "did you mean 'imu'?"},
      {measured, measured + "  - {signal: g, sensor: gyro, columns_of_elements: [x, y]}\n", 7, "got 2, allowed: 3"},
      {measured, measured + "  - {signal: g, sensor: gyro, element: 3, column: x}\n", 7, "allowed: 'element': 0 to 2"},
      {measured, measured + "  - {signal: g, sensor: gyro, column: x}\n", 7, "got no 'element'"},
      {measured, measured + "  - {signal: g, sensor: turn, columns_of_elements: [x, y, z]}\n", 7, "got 3, allowed: 4"},
      {measured, measured + "  - {signal: g, sensor: gyro, element: 0, column: x, unit: m}\n", 7, "units of rad/s"},
      {measured, measured + "  - {signal: f, kind: torque, actuator: moto, column: x}\n", 7, "did you mean 'motor'?"},
      {measured, measured + act + "{name: a, joint: hinge, kp: 1}\n  - {name: a, joint: hinge, kp: 1}\n", 9, "twice"},
      {measured, measured + act + "{name: motor, joint: hinge, kp: 1}\n", 8, "has an actuator 'motor' already"},
      {measured, measured + act + "{name: a, joint: hing, kp: 1}\n", 8, "did you mean 'hinge'?"},
      {"actuator: motor", "actuator: moto", 4, "did you mean 'motor'?"},
      {"hold: [base]", "hold: [rod]", 3, "has no free joint"},
      {"hold: [base]", "hold: [bas]", 3, "did you mean 'base'?"},
      {set, set + "  joint/hing/stiffness: p\n", 10, "did you mean 'hinge'?"},
      {set, set + "  body/rodd/mass: p\n", 10, "did you mean 'rod'?"},
      {set, set + "  body/rod/mass: p - 3\n", 10, "the mass of the body 'rod' is not physical"},
      {set, set + "  body/rod/mass: p - 1\n", 10, "got 0, allowed: above 0"},
      {set, set + "  body/rod/inertia: [p, \"0.1\", \"-1\"]\n", 10, "got 1, 0.1, -1"},
      {set, set + "  body/rod/inertia: [p, \"0.1\", \"0.1\"]\n", 10, "the inertia of the body 'rod' is not physical"},
      {set, set + "limits: [{joint: hing, angle_rad: 1}]\n", 10, "did you mean 'hinge'?"},
      {set, set + "limits: [{actuator: moto, command: 1}]\n", 10, "did you mean 'motor'?"},
  };
  for (const auto& [from, to, line, says] : mistakes) {
    SCOPED_TRACE(to);
    ExpectRefused(Tune(Replaced(kGood, from, to)), "experiment.yaml:" + std::to_string(line) + ":", says);
  }
}

TEST_F(BadInputTest, AListThatChangesItsLengthHasItsRow) {
  std::string log = "t,positions\n";
  for (int k = 0; k < 50; ++k)
    log += std::to_string(0.005 * k) + (k == 30 ? ",\"[0.1, 0.2]\"\n" : ",\"[0.1, 0.2, 0.3]\"\n");
  scratch_.Write("lists.csv", log);
  ExpectRefused(Tune(Replaced(Replaced(kGood, "column: q", "column: \"positions[0]\""), "commands: [{actuator: motor, ",
                              "commands: [{actuator: motor, optional: true, "),
                     "lists.csv"),
                "lists.csv:32: positions", "got 2 numbers, allowed: 3");
}

}  // namespace
}  // namespace gapscope::testing
