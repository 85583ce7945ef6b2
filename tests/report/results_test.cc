// Results as values: what JSON, tables and files say of runs made by hand.
#include <gtest/gtest.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/report/csv.h"
#include "src/report/feedback_report.h"
#include "src/report/identify_report.h"
#include "src/report/read_run.h"
#include "src/report/render_report.h"
#include "src/report/replay_report.h"
#include "src/report/tune_report.h"
#include "src/report/write_run.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

using nlohmann::ordered_json;
const RunInfo kInfo = {.seed = 7, .gapscope = "0.0.1", .mujoco = "1.2.3"};

// One log of two signals, the second badly off, and a model with an effect.
ReplayRun MadeReplay() {
  const std::vector<double> time_s = {0, 0.5, 1, 1.5};
  ReplayRun run{.info = kInfo,
                .result = {.mode = ReplayMode::kFreeRun,
                           .time_step_s = 0.001,
                           .time_step_error = 0.0005,
                           .logs = {{.log_path = "logs/a.csv", .windows = 1, .time_s = time_s}},
                           .wall_s = 0.25,
                           .simulated_s = 1.5,
                           .steps = 1500},
                .comparison = {.error = 0.5, .logs = {{.log_path = "logs/a.csv", .error = 0.5}}},
                .model = {.experiment = "rig.yaml",
                          .effects = {{"cable_spring", "arm"}},
                          .values = {{"arm.mass", 0.1}, {"scale@arm.torque_n_m", 2}}},
                .parameters = {{"arm.mass", 0.1}},
                .other_error = 0.3};
  for (const double error : {0.25, 1.0}) {
    const std::string name = error < 1 ? "arm_rad" : "pendulum_rad";
    run.result.logs[0].signals.push_back({.signal = name, .measured = {0, 1, 0, 1}, .predicted = {0, 1, 0, 1 - error}});
    run.comparison.logs[0].signals.push_back({.signal = name,
                                              .rmse = error / 2,
                                              .mae = error / 4,
                                              .nrmse = error,
                                              .max = error,
                                              .lag_s = 0.002,
                                              .correlation = 0.9,
                                              .samples = 4});
  }
  run.comparison.logs[0].where = {{.signal = "arm_rad",
                                   .condition = "speed 0..0.2 rad/s",
                                   .share_of_error = 0.6,
                                   .share_of_time = 0.1,
                                   .low = 0.5,
                                   .high = 0.7}};
  return run;
}

TEST(ReplayRunTest, JsonSaysWhatTheRunHolds) {
  const ordered_json json = ToJson(MadeReplay());
  EXPECT_EQ(json.dump(),
            R"({"schema":"gapscope.replay/1","mode":"free_run","error":0.5,"error_windows":0.3,"time_step_s":0.001,)"
            R"("time_step_error":0.0005,"logs":[{"log":"logs/a.csv","outcome":"completed","error":0.5,"samples":4,)"
            R"("windows":1,"signals":{)"
            R"("arm_rad":{"rmse":0.125,"mae":0.0625,"nrmse":0.25,"max":0.25,"lag_s":0.002,"correlation":0.9},)"
            R"("pendulum_rad":{"rmse":0.5,"mae":0.25,"nrmse":1.0,"max":1.0,"lag_s":0.002,"correlation":0.9}},)"
            R"("where":[{"signal":"arm_rad","condition":"speed 0..0.2 rad/s","share_of_error":0.6,)"
            R"("share_of_time":0.1,"low":0.5,"high":0.7}]}],)"
            R"("experiment":"rig.yaml","effects":[{"name":"cable_spring","on":"arm"}],"parameters":{"arm.mass":0.1},)"
            R"("model":{"effects":[{"name":"cable_spring","on":"arm"}],)"
            R"("values":{"arm.mass":0.1,"scale@arm.torque_n_m":2.0}},)"
            R"("cost":{"wall_s":0.25,"simulated_s":1.5,"steps":1500},"seed":7,)"
            R"("versions":{"gapscope":"0.0.1","mujoco":"1.2.3"}})");
}

TEST(ReplayRunTest, WhatDoesNotExistIsNullOrLeftOut) {
  ReplayRun run = MadeReplay();
  run.result.mode = ReplayMode::kWindows;
  run.result.logs[0].outcome = Outcome::kDiverged;
  run.result.logs[0].diverged_at_s = 0.75;
  run.comparison.error = run.comparison.logs[0].error = INFINITY;
  run.nominal_error = 0.9;
  const ordered_json json = ToJson(run, Timing::kLeaveOut);
  EXPECT_TRUE(json["error"].is_null());
  EXPECT_EQ(json["error_free_run"], 0.3);
  EXPECT_FALSE(json.contains("error_windows"));
  EXPECT_EQ(json["error_nominal"], 0.9);
  EXPECT_EQ(json["logs"][0]["outcome"], "diverged");
  EXPECT_EQ(json["logs"][0]["diverged_at_s"], 0.75);
  EXPECT_EQ(json["cost"].dump(), R"({"simulated_s":1.5,"steps":1500})");
}

TEST(ReplayRunTest, TableShowsScoresErrorsAndWhere) {
  EXPECT_EQ(ToTable(MadeReplay()),
            "log                      signal                  RMSE       MAE   nRMSE   lag ms   corr over time\n"
            "logs/a.csv               arm_rad                0.125    0.0625    0.25     2.00  0.900 ▁   ▁   ▁  █\n"
            "                         pendulum_rad             0.5      0.25       1     2.00  0.900 ▁   ▁   ▁  █\n"
            "\nerror 0.5 (RMSE over standard deviation, free_run, 1 log)\n"
            "in windows, each started from the log: error 0.3\n"
            "time step 1 ms; halving it changes the error by 0.0005\n"
            "\nwhere the error lies in the first log                           of error   of time   90 % interval\n"
            "  arm_rad          speed 0..0.2 rad/s                               60%       10%   50..70 %\n");
}

TEST(ReplayRunTest, AClosedLoopAddsItsStatistics) {
  ReplayRun run = MadeReplay();
  const MotionStatistics rest{.mean = 1, .deviation = 2, .low = 3, .high = 4, .crossings_hz = 5};
  run.loop = {.actuator = "motor", .logs = {{.signals = {{"arm_rad", rest, {}}}, .logged = {}, .sent = rest}}};
  const auto log = ToJson(run)["logs"][0];
  EXPECT_EQ(std::prev(log.end()).key(), "statistics");
  EXPECT_EQ(log["statistics"]["arm_rad"]["measured"].dump(),
            R"({"mean":1.0,"deviation":2.0,"low":3.0,"high":4.0,"crossings_hz":5.0})");
  EXPECT_EQ(log["statistics"]["command motor"].size(), 1u) << "the log has no command of its own";
  EXPECT_NE(ToTable(run).find("a.csv                                 arm_rad                     1          2"),
            std::string::npos)
      << ToTable(run);
}

TuneRun MadeTune() {
  return {
      .info = kInfo,
      .optimizer = "lm",
      .termination = "converged",
      .starts_agree = false,
      .starts = 2,
      .evaluations = 30,
      .replays = 12,
      .wall_s = 1.5,
      .solve_s = 1.25,
      .parameters = {{"motor.kt", "N m/A", 0.042, 0.05, 0.049, 0.051, true, true},
                     {"arm.mass", "kg", 0.095, 0.09, NAN, NAN, false, false}},
      .flat = {{.direction = {{"arm.mass", 1}, {"motor.kt", -0.5}}, .text = "arm.mass is not known from these logs"}},
      .correlated = {{"arm.mass", "motor.kt", 0.96}},
      .error_nominal = 0.9,
      .error_train = 0.1,
      .error_held_out = 0.12,
      .held_out_by = "every third log",
      .train =
          {{.log = "a.csv",
            .signals =
                {{.signal = "arm_rad", .rmse = 1, .mae = 2, .nrmse = 3, .max = 4, .lag_s = NAN, .correlation = 0.5}}}},
      .held_out = {{.log = "b.csv",
                    .outcome = Outcome::kDiverged,
                    .signals = {{.signal = "arm_rad", .rmse = 5, .mae = 6, .nrmse = 7}}}},
      .model = {.experiment = "rig.yaml",
                .effects = {{"coulomb_friction", "arm"}},
                .values = {{"motor.kt", 0.05}, {"arm.mass", 0.09}}},
      .time_step_s = 0.002,
      .command_shift_s = -0.0005};
}

TEST(TuneRunTest, IsReadBackAsItWasWritten) {
  for (const Timing timing : {Timing::kInclude, Timing::kLeaveOut}) {
    const std::string text = ToJson(MadeTune(), timing).dump();
    const auto read = ReadTuneRun(ordered_json::parse(text), "here");
    ASSERT_TRUE(read.ok()) << read.error().Text();
    EXPECT_EQ(ToJson(read.value(), timing).dump(), text);
    EXPECT_EQ(read.value().held_out[0].outcome, Outcome::kDiverged);
    EXPECT_TRUE(std::isnan(read.value().train[0].signals[0].lag_s));
  }
}

TEST(TuneRunTest, FitsToEachLogAloneAreWrittenWhereThereAreAny) {
  EXPECT_FALSE(ToJson(MadeTune()).contains("per_log"));
  TuneRun run = MadeTune();
  const TuneRun::Parameter known{"motor.kt", "N m/A", 0.042, 0.05, 0.049, 0.051, false, true};
  TuneRun::Parameter other = known, unknown = known;
  other.value = 0.06, unknown.identifiable = false;
  run.per_log = {{"a.csv", "converged", {known}}, {"b.csv", "converged", {other}}, {"c.csv", "budget", {unknown}}};
  const std::string text = ToJson(run).dump();
  const auto read = ReadTuneRun(ordered_json::parse(text), "here");
  ASSERT_TRUE(read.ok()) << read.error().Text();
  EXPECT_EQ(ToJson(read.value()).dump(), text);
  EXPECT_EQ(read.value().per_log[2].termination, "budget");
  EXPECT_NE(ToTable(run).find("0.05 .. 0.06        N m/A  2 of 3 logs\n"), std::string::npos) << ToTable(run);
}

TEST(TuneRunTest, TimesAreLeftOutOnRequestAndNothingElse) {
  ordered_json whole = ToJson(MadeTune());
  EXPECT_EQ(whole["wall_s"], 1.5);
  EXPECT_EQ(whole["solve_s"], 1.25);
  whole.erase("wall_s"), whole.erase("solve_s");
  EXPECT_EQ(ToJson(MadeTune(), Timing::kLeaveOut).dump(), whole.dump());
}

TEST(TuneRunTest, ReaderSaysWhatIsWrong) {
  ordered_json json = ToJson(MadeTune());
  json["error"].erase("train");
  const auto lacking = ReadTuneRun(json, "r.json");
  ASSERT_FALSE(lacking.ok());
  EXPECT_EQ(lacking.error().where, "r.json");
  EXPECT_NE(lacking.error().actual.find("train"), std::string::npos) << lacking.error().actual;
  EXPECT_EQ(lacking.error().allowed, "gapscope.tune/1");
  // Numbers that fit nowhere, and a matrix that is not there.
  ordered_json large = ToJson(MadeTune()), sizes = large;
  large["starts"] = 1e300;
  EXPECT_FALSE(ReadTuneRun(large, "r.json").ok());
  sizes["spread"] = {{"logarithmic", std::vector<bool>(1'000'000)}, {"covariance", ordered_json::array()}};
  EXPECT_FALSE(ReadTuneRun(sizes, "r.json").ok());
  for (const char* text : {"[]", "3", "null", R"({"parameters": 5})", R"({"error": "none"})"})
    EXPECT_FALSE(ReadTuneRun(ordered_json::parse(text), "r.json").ok()) << text;
  for (const char* text : {"[]", R"({"model": 1})", R"({"model": {"effects": [{"name": "x"}], "values": {}}})",
                           R"({"model": {"effects": [], "values": {"a": "b"}}})"})
    EXPECT_FALSE(ReadRunModel(ordered_json::parse(text), "r.json").ok()) << text;
}

TEST(TuneRunTest, TableShowsWhatIsKnownAndWhatIsNot) {
  EXPECT_EQ(ToTable(MadeTune()),
            "parameter                                        nominal       value   95 % interval            unit\n"
            "motor.kt                                           0.042        0.05   0.049 .. 0.051           N m/A  at "
            "its bound\n"
            "arm.mass                                           0.095        0.09   not known                kg\n"
            "flat: arm.mass is not known from these logs\n"
            "arm.mass and motor.kt go together (correlation 0.960)\n"
            "\nheld-out log                                 signal                   RMSE        MAE    nRMSE\n"
            "b.csv                                        arm_rad                     5          6        7\n"
            "\nerror: nominal 0.9, train 0.1, held out 0.12 (every third log)\n"
            "lm: converged; 30 evaluations, 12 replays of all logs, 1.50 s; time step 2 ms; commands -0.500 ms late\n"
            "2 starts end in different places: the best is shown; more starts (--starts) or a global search "
            "(--optimizer crs2) may find better\n");
}

TEST(RunModelTest, IsReadFromAnyResult) {
  for (const ordered_json& json : {ToJson(MadeReplay()), ToJson(MadeTune())}) {
    const auto model = ReadRunModel(ordered_json::parse(json.dump()), "");
    ASSERT_TRUE(model.ok()) << model.error().Text();
    EXPECT_EQ(JsonModel(model.value()), json["model"]);
  }
}

TEST(CsvTest, NumbersReadBackTheSameAndGapsAreEmpty) {
  const std::vector<double> time_s = {0, 0.1, 1.0 / 3}, values = {1e-9, NAN, -2};
  EXPECT_EQ(CsvText({{"t", time_s}, {"a,b", values}, {"none", {}}}),
            "t,a,b,none\n0,1e-09,\n0.1,,\n0.3333333333333333,-2,\n");
  EXPECT_EQ(CsvText({{"t", time_s}}, 3), "t\n0\n0.1\n0.333\n");
}

TEST(CsvTest, LogsOfOneNameGetFilesOfTheirOwn) {
  EXPECT_EQ(CsvNames({"a/run.csv", "b/run.json", "c.csv"}),
            (std::vector<std::string>{"run.csv", "1_run.csv", "c.csv"}));
}

TEST(WriteRunTest, WritesTheBytesThatArePrintedAndNothingHalfDone) {
  const Scratch scratch;
  const ordered_json json = ToJson(MadeTune());
  const std::vector<double> values = {1, 2};
  ASSERT_TRUE(
      WriteRun(scratch.Path("out"), json, {.model_xml = "<mujoco/>", .tables = {{"traces/a.csv", {{"x", values}}}}})
          .ok());
  EXPECT_EQ(ReadAll(scratch.Path("out/result.json")), json.dump(2) + "\n");
  EXPECT_EQ(ReadAll(scratch.Path("out/model.xml")), "<mujoco/>");
  EXPECT_EQ(ReadAll(scratch.Path("out/traces/a.csv")), "x\n1\n2\n");
  std::size_t files = 0;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(scratch.Path("out")))
    files += entry.is_regular_file();
  EXPECT_EQ(files, 3u) << "no temporary file is left";
  const auto read = ReadJson(scratch.Path("out"));
  ASSERT_TRUE(read.ok());
  EXPECT_EQ(read.value().dump(), json.dump());
  EXPECT_FALSE(WriteRun(scratch.Path("out/result.json"), json).ok()) << "a file is in the way";
}

TEST(IdentifyRunTest, JsonAndTable) {
  const IdentifyRun run{.info = kInfo,
                        .result = {.method = "pd",
                                   .relation = "torque = kp e",
                                   .values = {{"kp", "N m/rad", 150, 140, 160}},
                                   .r2 = 0.99,
                                   .rmse = NAN,
                                   .unit = "N m",
                                   .rows = 40,
                                   .remarks = {"Beware."},
                                   .tables = {{"points", {"q", "torque"}, {{1, 2}, {3, NAN}}}}},
                        .logs = {"a.csv"}};
  EXPECT_EQ(ToJson(run).dump(), R"({"schema":"gapscope.identify.pd/1","relation":"torque = kp e",)"
                                R"("values":{"kp":{"value":150.0,"low":140.0,"high":160.0,"unit":"N m/rad"}},)"
                                R"("fit":{"r2":0.99,"rmse":null,"unit":"N m","rows":40},"remarks":["Beware."],)"
                                R"("tables":{"points":{"columns":["q","torque"],"rows":[[1.0,2.0],[3.0,null]]}},)"
                                R"("logs":["a.csv"],"versions":{"gapscope":"0.0.1","mujoco":"1.2.3"}})");
  EXPECT_NE(ToTable(run).find("40 rows, R^2 0.99000\n- Beware.\n"), std::string::npos) << ToTable(run);
  EXPECT_EQ(ColumnsOf(run.result.tables[0])[0], (std::vector<double>{1, 3}));
}

TEST(FeedbackRunTest, JsonAndTable) {
  const FeedbackRun run{.info = kInfo,
                        .states = {"arm", "arm speed"},
                        .gain = {-3, 0.5},
                        .open_poles = {{-1, 0}},
                        .closed_poles = {{-2, 3}}};
  EXPECT_EQ(ToJson(run).dump(),
            R"({"schema":"gapscope.design.feedback/1","states":["arm","arm speed"],"gain":[-3.0,0.5],)"
            R"("open_loop_poles":[[-1.0,0.0]],"closed_loop_poles":[[-2.0,3.0]],)"
            R"("versions":{"gapscope":"0.0.1","mujoco":"1.2.3"}})");
  EXPECT_NE(ToTable(run).find("poles open   -1\npoles closed -2+3i\n"), std::string::npos) << ToTable(run);
}

TEST(RenderRunTest, AStillHasNoLength) {
  RenderRun run{.info = kInfo,
                .out = "still.png",
                .log = "a.csv",
                .models = {{"nominal", 0.5}},
                .frames = 1,
                .width = 320,
                .height = 240,
                .frames_per_s = 30,
                .first_s = 1.25,
                .gl = "osmesa"};
  EXPECT_EQ(ToTable(run), "still.png\n  nominal                          error 0.5\n  320x240 at 1.250 s of the log\n");
  EXPECT_EQ(ToJson(run)["models"].dump(), R"([{"label":"nominal","error":0.5}])");
  run.video_s = 2, run.last_s = 3.25, run.wall_s = 1, run.shown_in = "report.html";
  EXPECT_NE(ToTable(run).find("  shown in report.html\n"), std::string::npos);
  EXPECT_NE(ToTable(run).find("1 frames of 320x240, 2.00 s of video for 2.00 s of the log"), std::string::npos);
}

}  // namespace
}  // namespace gapscope::testing
