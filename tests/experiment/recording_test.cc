// A log bound to an experiment.
#include "src/experiment/recording.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

constexpr const char* kExperiment = R"(model: robot.xml
log: {time: {column: time_s, unit: s}}
values:
  log.kp: {column: kp, default: 3}
  log.supply: {column: supply, unit: mV, default: 7}
commands:
  - {actuator: motor, column: [u, voltage], unit: mV, add: 1}
  - {actuator: feedforward, column: ff, optional: true, default: 2 * log.kp}
measured:
  - {signal: q, column: q, joint: hinge, unit: deg}
  - {signal: w, column: w, kind: velocity, joint: hinge, optional: true}
)";

class RecordingTest : public ::testing::Test {
 protected:
  Result<Recording> Load(const std::string& csv, const std::string& experiment = kExperiment) {
    auto loaded = LoadExperiment(scratch_.Write("experiment.yaml", experiment));
    if (!loaded.ok()) return loaded.error();
    return LoadRecording(loaded.value(), scratch_.Write("log.csv", csv));
  }
  std::string MessageOf(const std::string& csv, const std::string& experiment = kExperiment) {
    const auto recording = Load(csv, experiment);
    return recording.ok() ? "" : recording.error().Text();
  }
  Scratch scratch_;
};

TEST_F(RecordingTest, ScalesColumnsAndStartsAtZero) {
  const auto loaded = Load("time_s,u,q,w\n10,500,90,1\n10.5,1000,180,2\n11.5,0,-90,3\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  const Recording& r = loaded.value();
  EXPECT_EQ(r.time_s, (std::vector<double>{0, 0.5, 1.5}));
  EXPECT_EQ(r.duration_s(), 1.5);
  ASSERT_EQ(r.commands.size(), 2u);
  EXPECT_EQ(r.commands[0].column, "u");
  EXPECT_EQ(r.commands[0].values, (std::vector<double>{1.5, 2, 1}));
  ASSERT_EQ(r.measured.size(), 2u);
  EXPECT_EQ(r.measured[0].index, 0u);
  EXPECT_DOUBLE_EQ(r.measured[0].values[0], std::numbers::pi / 2);
  EXPECT_DOUBLE_EQ(r.measured[0].values[2], -std::numbers::pi / 2);
  EXPECT_EQ(r.measured[1].values, (std::vector<double>{1, 2, 3}));
}

TEST_F(RecordingTest, OptionalColumnsMayBeMissing) {
  const auto loaded = Load("time_s,voltage,q\n0,0,1\n1,0,2\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  const Recording& r = loaded.value();
  EXPECT_EQ(r.commands[0].column, "voltage");  // the second name
  EXPECT_FALSE(r.commands[1].column);
  EXPECT_EQ(r.commands[1].values, (std::vector<double>{6, 6}));  // 2 log.kp, and log.kp is its default
  ASSERT_EQ(r.measured.size(), 1u);
  EXPECT_EQ(r.measured[0].spec.signal, "q");
}

TEST_F(RecordingTest, ValuesAreMeansOfColumnsOrDefaults) {
  const auto loaded = Load("time_s,u,q,kp,supply\n0,0,1,10,5000\n1,0,2,,7000\n2,0,2,20,\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  EXPECT_DOUBLE_EQ(loaded.value().values.at("log.kp"), 15);
  EXPECT_DOUBLE_EQ(loaded.value().values.at("log.supply"), 6);
  EXPECT_EQ(loaded.value().commands[1].values[0], 30);
  const auto without = Load("time_s,u,q\n0,0,1\n1,0,2\n");
  EXPECT_DOUBLE_EQ(without.value().values.at("log.supply"), 7);  // a default is in SI already
}

TEST_F(RecordingTest, ValuesOfTheHeader) {
  const std::string experiment =
      "model: robot.xml\nlog: {format: bam_json}\nvalues:\n  log.kp: {header: kp, scale: 2}\n"
      "commands:\n  - {actuator: motor, column: goal_position, unit: rad}\nmeasured:\n  - {signal: q, column: "
      "position, joint: hinge}\n";
  const std::string json = R"({"kp": 32, "mass": 0.5, "dt": 0.01, "entries": [
    {"timestamp": 0.0, "position": 0.1, "goal_position": 0.2, "torque_enable": true},
    {"timestamp": 0.01, "position": 0.2, "goal_position": 0.3, "torque_enable": true},
    {"timestamp": 0.02, "position": 0.3, "goal_position": 0.3, "torque_enable": false}]})";
  const auto loaded = Load(json, experiment);
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  EXPECT_EQ(loaded.value().values.at("log.kp"), 64);
  EXPECT_EQ(loaded.value().rows(), 3u);
  const std::string missing = MessageOf(json, Replaced(experiment, "header: kp", "header: ki"));
  EXPECT_NE(missing.find("header value 'ki'"), std::string::npos) << missing;
  EXPECT_NE(missing.find("default:"), std::string::npos) << missing;
}

// Two rates merged into one table: the sensor's rows between stay empty, the command is held.
TEST_F(RecordingTest, KeepLeavesMeasuredValuesMissing) {
  const std::string log = "time_s,u,q\n0,100,1\n1,,\n2,300,\n3,,4\n";
  const std::string experiment = Replaced(kExperiment, "unit: s}}", "unit: s}, repair: {missing: keep}}");
  const auto kept = Load(log, experiment);
  ASSERT_TRUE(kept.ok()) << kept.error().Text();
  EXPECT_EQ(kept.value().commands[0].values, (std::vector<double>{1.1, 1.1, 1.3, 1.3}));
  const std::vector<double>& q = kept.value().measured[0].values;
  EXPECT_TRUE(std::isfinite(q[0]) && std::isnan(q[1]) && std::isnan(q[2]) && std::isfinite(q[3]));
  const auto held = Load(log);
  ASSERT_TRUE(held.ok()) << held.error().Text();
  EXPECT_EQ(held.value().measured[0].values[2], q[0]);
}

// What a log of several rates says itself holds where the experiment says nothing.
TEST_F(RecordingTest, ALogOfSeveralRatesIsKept) {
  Log log{.path = "run.mcap", .columns = {{.name = "time_s", .values = {0, 1, 2}}}, .joined = true};
  log.columns.push_back({.name = "u", .values = {100, std::nan(""), 300}});
  log.columns.push_back({.name = "q", .values = {1, std::nan(""), 3}});
  for (const bool stated : {false, true}) {
    Experiment experiment = LoadExperiment(scratch_.Write("experiment.yaml", kExperiment)).value();
    experiment.timeline.missing_stated = stated;
    const auto bound = BindLog(experiment, log);
    ASSERT_TRUE(bound.ok()) << bound.error().Text();
    EXPECT_EQ(std::isnan(bound.value().measured[0].values[1]), !stated);
    EXPECT_TRUE(std::isfinite(bound.value().commands[0].values[1]));
  }
}

// Numbers of LeRobot's datasets are degrees or shares of a range: radians are not taken for granted.
TEST_F(RecordingTest, MadeUpStampsNeedAStatedUnit) {
  const Log log{.path = "set#0",
                .columns = {{.name = "time_s", .values = {0, 1}, .clock = "synthetic"},
                            {.name = "u", .values = {100, 300}, .clock = "synthetic"},
                            {.name = "q", .values = {1, 3}, .clock = "synthetic"}}};
  const auto bound = [&](const std::string& experiment) {
    return BindLog(LoadExperiment(scratch_.Write("experiment.yaml", experiment)).value(), log);
  };
  EXPECT_TRUE(bound(kExperiment).ok());
  EXPECT_TRUE(bound(Replaced(kExperiment, "unit: deg", "scale: 0.01")).ok());
  EXPECT_TRUE(bound(Replaced(kExperiment, "unit: deg", "unit: 1")).ok());
  const auto measured = bound(Replaced(kExperiment, ", unit: deg", ""));
  ASSERT_FALSE(measured.ok());
  EXPECT_NE(measured.error().Text().find("set#0: the unit of 'q' is not stated"), std::string::npos);
  const auto command = bound(Replaced(kExperiment, ", unit: mV, add", ", add"));
  ASSERT_FALSE(command.ok());
  EXPECT_NE(command.error().Text().find("the unit of 'u' is not stated"), std::string::npos);
}

TEST_F(RecordingTest, MissingColumnsNameTheNearest) {
  const std::string command = MessageOf("time_s,uu,q\n0,1,2\n1,1,2\n");
  EXPECT_NE(command.find("log.csv:1: no column 'u' for the actuator 'motor'"), std::string::npos) << command;
  EXPECT_NE(command.find("did you mean 'uu'?"), std::string::npos) << command;
  const std::string measured = MessageOf("time_s,u,Q\n0,1,2\n1,1,2\n");
  EXPECT_NE(measured.find("no column 'q' for the signal 'q'"), std::string::npos) << measured;
  const std::string value =
      MessageOf("time_s,u,q\n0,1,2\n1,1,2\n", Replaced(kExperiment, "{column: kp, default: 3}", "{column: kp}"));
  EXPECT_NE(value.find("log.kp"), std::string::npos) << value;
  const std::string cut =
      MessageOf("time_s,u,q\n0,1,2\n1,1,2\n", std::string(kExperiment) + "replay: {while: enabled}\n");
  EXPECT_NE(cut.find("no column 'enabled' for 'while'"), std::string::npos) << cut;
}

TEST_F(RecordingTest, NothingToScoreIsAnError) {
  std::string experiment = Replaced(kExperiment, "joint: hinge, unit: deg", "joint: hinge, unit: deg, optional: true");
  EXPECT_NE(MessageOf("time_s,u\n0,1\n1,1\n", experiment).find("none of the signals that are scored"),
            std::string::npos);
  experiment = Replaced(kExperiment, "joint: hinge, unit: deg", "joint: hinge, unit: deg, score: false");
  EXPECT_NE(MessageOf("time_s,u,q\n0,1,2\n1,1,2\n", experiment).find("none of the signals that are scored"),
            std::string::npos);
}

TEST_F(RecordingTest, ABadDefaultExpressionNamesTheCommand) {
  for (const char* bad : {"2 * log.kq", "1 / 0", "2 *"}) {
    const std::string message = MessageOf("time_s,u,q\n0,1,2\n1,1,2\n", Replaced(kExperiment, "2 * log.kp", bad));
    EXPECT_NE(message.find("default of command 'feedforward'"), std::string::npos) << message;
    EXPECT_NE(message.find("experiment.yaml"), std::string::npos) << message;
  }
}

TEST_F(RecordingTest, StartAndWhileCutTheLogAndSaySo) {
  const std::string csv = "time_s,u,q,on\n0,1,0,1\n1,2,1,1\n2,3,2,1\n3,4,3,1\n4,5,4,0\n5,6,5,1\n";
  const auto loaded = Load(csv, std::string(kExperiment) + "replay: {start_s: 1, while: on}\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  const Recording& r = loaded.value();
  EXPECT_EQ(r.time_s, (std::vector<double>{0, 1, 2}));
  EXPECT_EQ(r.commands[0].values, (std::vector<double>{1.002, 1.003, 1.004}));
  EXPECT_NEAR(r.measured[0].values[0], std::numbers::pi / 180, 1e-15);
  const auto cut = std::find_if(r.findings.begin(), r.findings.end(),
                                [](const Finding& f) { return f.kind == "cut" && f.column == "on"; });
  ASSERT_NE(cut, r.findings.end());
  EXPECT_EQ(cut->count, 2u);
  EXPECT_EQ(cut->first_row, 4u);
  // What start_s leaves out is said too.
  EXPECT_TRUE(std::any_of(r.findings.begin(), r.findings.end(), [](const Finding& f) {
    return f.kind == "cut" && f.text.find("start_s") != std::string::npos;
  }));
}

TEST_F(RecordingTest, AWhileColumnWithoutAValueIsOff) {
  const auto loaded =
      Load("time_s,u,q,on\n0,1,0,1\n1,2,1,1\n2,3,2,\n3,4,3,1\n", std::string(kExperiment) + "replay: {while: on}\n");
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  EXPECT_EQ(loaded.value().rows(), 2u);
}

TEST_F(RecordingTest, ACutThatLeavesNothingIsAnError) {
  const std::string csv = "time_s,u,q,on\n0,1,0,0\n1,2,1,1\n2,3,2,1\n";
  for (const char* replay : {"replay: {while: on}\n", "replay: {start_s: 2}\n", "replay: {start_s: 1e300}\n"}) {
    const std::string message = MessageOf(csv, std::string(kExperiment) + replay);
    EXPECT_NE(message.find("fewer than two rows left"), std::string::npos) << message;
    EXPECT_NE(message.find("log.csv"), std::string::npos) << message;
  }
}

TEST_F(RecordingTest, WrappedAnglesAreUnwrapped) {
  const auto loaded = Load("time_s,u,q\n0,1,170\n1,1,-170\n2,1,-150\n3,1,175\n",
                           Replaced(kExperiment, "unit: deg", "unit: deg, wrap: 6.283185307179586"));
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  const double degree = std::numbers::pi / 180;
  const std::vector<double> expected = {170, 190, 210, 175};
  for (std::size_t k = 0; k < 4; ++k) EXPECT_NEAR(loaded.value().measured[0].values[k], expected[k] * degree, 1e-12);
}

TEST_F(RecordingTest, ScalingThatOverflowsIsAnError) {
  const std::string message =
      MessageOf("time_s,u,q\n0,1e307,2\n1,1,2\n", Replaced(kExperiment, "unit: mV, add: 1", "unit: V, scale: 1e3"));
  for (const char* part :
       {"log.csv:2, column u", "too large once converted", "got 1e+307", "the column's unit and scale"})
    EXPECT_NE(message.find(part), std::string::npos) << message << "\nlacks: " << part;
}

}  // namespace
}  // namespace gapscope::testing
