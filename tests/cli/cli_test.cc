// The built program as a user runs it: exit statuses, streams, files.
#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/cli/fixture.h"

namespace gapscope::testing {
namespace {

TEST_F(CliTest, HelpAndVersion) {
  const Answer help = Run("--help");
  EXPECT_EQ(help.status, 0);
  EXPECT_NE(help.out.find("Exit status: 0 done"), std::string::npos);
  EXPECT_EQ(help.err, "");
  // Every subcommand that it lists has a help of its own with an example.
  std::istringstream lines(help.out);
  std::set<std::string> commands;
  bool listing = false;
  for (std::string line; std::getline(lines, line);) {
    if (line.rfind("Subcommands:", 0) == 0) {
      listing = true;
    } else if (listing && line.rfind("  ", 0) == 0 && line[2] != ' ') {
      commands.insert(line.substr(2, line.find(' ', 2) - 2));
    }
  }
  for (const char* name : {"init", "inspect", "replay"}) EXPECT_TRUE(commands.contains(name)) << name;
  for (const auto& command : commands) {
    const Answer answer = Run(command + " --help");
    EXPECT_EQ(answer.status, 0) << command;
    EXPECT_NE(answer.out.find("Example: gapscope " + command), std::string::npos) << answer.out;
  }
  const Answer version = Run("--version");
  EXPECT_EQ(version.status, 0);
  EXPECT_EQ(version.out.rfind("gapscope ", 0), 0u);
  EXPECT_NE(version.out.find("MuJoCo 4.0.1"), std::string::npos);
}

TEST_F(CliTest, WrongArguments) {
  ExpectRefused("", {"subcommand"});
  ExpectRefused("replya", {"no command 'replya'", "did you mean 'replay'?"});
  ExpectRefused("replay", {"experiment"});
  ExpectRefused("replay " + Joint(), {"logs"});
  const std::string log = JointLog();
  ExpectRefused("replay " + Joint() + " '" + log + "' --jsno", {"--jsno"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --jobs -1", {"--jobs"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --jobs many", {"--jobs"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --mode sideways", {"--mode"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --mode closed_loop", {"no controller"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --window 0", {"--window"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --time-step -1", {"--time-step"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --time-step nan", {"--time-step"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --fail-above nan", {"--fail-above"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --window inf", {"--window"});
  ExpectRefused("replay " + Joint() + " '" + log + "' --fail-above 0", {"--fail-above"});
  const std::string diagnose = "diagnose " + Joint() + " '" + log + "' --prior ";
  ExpectRefused(diagnose + "coulomb_friction", {"--prior", "not NAME=VALUE"});
  ExpectRefused(diagnose + "coulomb_friction=1.2", {"--prior coulomb_friction", "1.2", "0 .. 1"});
  ExpectRefused(diagnose + "coulomb_fricton=0.9", {"--prior", "coulomb_friction"});
  ExpectRefused(diagnose + "coulomb_friction@nowhere=0.9", {"--prior", "coulomb_friction@joint"});
  ExpectRefused("diagnose " + Joint() + " '" + log + "' --resume", {"--resume", "nothing to resume from", "--out"});
  std::filesystem::create_directories(scratch_.Path("cwd/left/diagnosis.journal"));
  scratch_.Write("cwd/left/diagnosis.journal/calls.bin", "of something else");
  ExpectRefused("diagnose " + Joint() + " '" + log + "' --out left --resume",
                {"calls.bin", "another job", "another kind", "the same experiment", "without --resume"});
  // No number of 300 digits in a message, and nan is in no range.
  for (const auto& [command, flag, allowed] :
       {std::tuple{"diagnose", "--budget", "above 0 (s)"}, std::tuple{"diagnose", "--window", "above 0 (s)"},
        std::tuple{"tune", "--huber", "at least 0"}, std::tuple{"tune", "--tolerance", "1e-09 .. 0.1"},
        std::tuple{"render --out still.png", "--at", "at least 0 (s)"},
        std::tuple{"render --out still.png", "--fps", "1 .. 240"}}) {
    for (const char* value : {"inf", "nan"}) {
      const std::string line = std::string(command) + " " + Joint() + " '" + log + "' " + flag + " " + value;
      ExpectRefused(line, {flag, std::string("got '") + value + "', allowed: a finite number " + allowed});
      EXPECT_LT(Run(line).err.size(), 200u);
    }
  }
}

TEST_F(CliTest, TheShardOfTheHelpsOwnExampleIsOne) {
  const std::string help = Run("run --help").out;
  const std::size_t at = help.find("Example: gapscope run --shard ");
  ASSERT_NE(at, std::string::npos) << help;
  const std::size_t shard = help.find("--shard", at);
  const Answer answer = Run("run " + help.substr(shard, help.find('\n', shard) - shard));
  EXPECT_EQ(answer.err.find("not a shard"), std::string::npos) << answer.err;
  EXPECT_NE(answer.err.find("plan.json"), std::string::npos) << answer.err;  // what the folder of the example lacks
}

TEST_F(CliTest, ALogIsHeldOutHoweverItIsSpelled) {
  JointLog("cwd/a.csv"), JointLog("cwd/b.csv", 0.01);
  const std::string tune =
      "tune " + Joint() + " a.csv b.csv --hold-out ./b.csv --quiet --json --starts 1 --tolerance 0.1 ";
  const Answer answer = Run(tune + "--freeze motor.kp --freeze joint.inertia --freeze motor.kd");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto result = nlohmann::json::parse(answer.out);
  ASSERT_EQ(result["train"].size(), 1u);
  ASSERT_EQ(result["held_out"].size(), 1u);
  EXPECT_EQ(result["train"][0]["log"], "a.csv");
  EXPECT_EQ(result["held_out"][0]["log"], "b.csv");
  ExpectRefused("tune " + Joint() + " a.csv --hold-out ./a.csv", {"every log is held out"});
}

TEST_F(CliTest, FilesEffectsAndParametersThatAreWrong) {
  const std::string log = JointLog(), replay = "replay " + Joint() + " '" + log + "' ";
  ExpectRefused("replay none.yaml '" + log + "'", {"none.yaml"});
  ExpectRefused("replay " + Joint() + " none.csv", {"none.csv"});
  ExpectRefused("replay " + Joint() + " .", {"a folder"});
  ExpectRefused("replay '" + log + "' '" + log + "'", {"run.csv:"});
  ExpectRefused("replay " + Joint() + " '" + kModels + "joint/joint.xml'", {"joint.xml:"});
  ExpectRefused(replay + "--with coulomb_fricton", {"did you mean 'coulomb_friction'?"});
  ExpectRefused(replay + "--with backlash@elbow", {"allowed: joint"});
  ExpectRefused(replay + "--with backlash --with backlash@joint", {"stands twice"});
  ExpectRefused(replay + "--with backlash --with joint_compliance", {"split twice"});
  ExpectRefused(replay + "--set motor.kq=1", {"did you mean 'motor.kp'?"});
  ExpectRefused(replay + "--set motor.kp", {"NAME=VALUE"});
  ExpectRefused(replay + "--set motor.kp=", {"NAME=VALUE"});
  ExpectRefused(replay + "--set motor.kp=1,5", {"NAME=VALUE"});
  ExpectRefused(replay + "--set motor.kp=nan", {"NAME=VALUE"});
  ExpectRefused(replay + "--set =3", {"--set"});
  ExpectRefused(replay + "--params none.yaml", {"none.yaml"});
  ExpectRefused(replay + "--params '" + scratch_.Write("p.yaml", "motor.kp: much\n") + "'", {"p.yaml:1:"});
  ExpectRefused(replay + "--params '" + scratch_.Write("q.yaml", "motor.kq: 1\n") + "'",
                {"q.yaml", "did you mean 'motor.kp'?"});
  ExpectRefused(replay + "--while torque_enable", {"no column 'torque_enable' for 'while'"});
  const std::string experiment = scratch_.Write("e.yaml", "modle: x\n");
  ExpectRefused("replay '" + experiment + "' '" + log + "'", {"e.yaml:1:"});
}

TEST_F(CliTest, LogsOfDifferentRigsAreRefused) {
  const auto log = [&](const std::string& name, const std::string& motor) {
    std::string entries;
    for (int k = 0; k < 100; ++k)
      entries += (k > 0 ? ", " : "") + std::string("{\"position\": 0.0, \"goal_position\": 0.0, \"timestamp\": ") +
                 std::to_string(0.005 * k) + ", \"torque_enable\": true}";
    return "'" +
           scratch_.Write(name, "{\"mass\": 0.5, \"length\": 0.1, \"kp\": 100, \"vin\": 7.4, " + motor +
                                    "\"entries\": [" + entries + "]}") +
           "' ";
  };
  const std::string replay = "replay '" + kModels + "xl330/experiment.yaml' ";
  const std::string own = log("own.json", "\"motor\": \"xl330\", "), silent = log("silent.json", "");
  ExpectRefused(replay + own + silent + log("other.json", "\"motor\": \"sts3032\", "),
                {"other.json", "logs of different rigs", "'sts3032'", "'xl330'"});
  const Answer answer = Run(replay + own + silent + "--quiet --json");
  EXPECT_EQ(answer.status, 0) << answer.err;
}

TEST_F(CliTest, JsonAloneOnStdoutMessagesOnStderr) {
  // A gap and a repeated stamp: both are reported.
  std::string text = ReadAll(JointLog());
  text += "5.000,0,0\n5.000,0,0\n5.002,0,0\n";
  const std::string log = scratch_.Write("gap.csv", text);
  const Answer answer = Run("replay " + Joint() + " '" + log + "' --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto json = nlohmann::json::parse(answer.out, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << answer.out.substr(0, 200);
  EXPECT_EQ(json["schema"], "gapscope.replay/1");
  EXPECT_EQ(json["mode"], "free_run");
  EXPECT_EQ(json["logs"][0]["outcome"], "completed");
  EXPECT_EQ(json["logs"][0]["log"], log);
  EXPECT_EQ(json["logs"][0]["samples"], 402);
  for (const char* key : {"rmse", "mae", "nrmse", "max", "lag_s", "correlation"})
    EXPECT_TRUE(json["logs"][0]["signals"]["position_rad"][key].is_number()) << key;
  for (const char* key : {"wall_s", "simulated_s", "steps"}) EXPECT_TRUE(json["cost"][key].is_number()) << key;
  EXPECT_TRUE(json["error"].is_number() && json["time_step_s"].is_number());
  EXPECT_NE(answer.err.find("gap.csv"), std::string::npos) << "findings go to stderr";
  const Answer quiet = Run("replay " + Joint() + " '" + log + "' --json --quiet");
  EXPECT_EQ(quiet.err, "");
  EXPECT_TRUE(Files(scratch_.Path("cwd")).empty()) << "nothing is left in the working folder";
}

TEST_F(CliTest, ProgressAndErrorsAsJson) {
  const std::string log = JointLog();
  const Answer good = Run("tune " + Joint() + " '" + log + "' --starts 1 --freeze motor.kp --json --progress json");
  ASSERT_EQ(good.status, 0) << good.err;
  std::istringstream lines(good.err);
  int seen = 0;
  for (std::string line; std::getline(lines, line);) {
    if (line.empty() || line.front() != '{') continue;
    const auto json = nlohmann::json::parse(line);
    EXPECT_EQ(json.at("stage"), "fit");
    EXPECT_TRUE(json.at("done").is_number_integer() && json.at("best").is_number() && json.at("total").is_null());
    EXPECT_GE(json.at("elapsed_s"), 0);
    ++seen;
  }
  EXPECT_GT(seen, 0) << good.err;
  EXPECT_EQ(Run("tune " + Joint() + " '" + log + "' --starts 1 --json --progress json --quiet").err, "");
  const Answer replayed = Run("replay " + Joint() + " '" + log + "' --json --progress json");
  EXPECT_TRUE(replayed.err.starts_with(R"({"stage":"replay")")) << replayed.err;
  for (const std::string& wrong :
       {"replay " + Joint() + " 'gone.csv'", "replay " + Joint() + " '" + log + "' --jobs -1"}) {
    const Answer answer = Run(wrong + " --progress json");
    EXPECT_EQ(answer.status, 2);
    const auto error = nlohmann::json::parse(answer.err).at("error");
    for (const char* part : {"what", "where", "actual", "allowed", "cure"}) EXPECT_TRUE(error.contains(part)) << part;
    EXPECT_FALSE(error.at("what").get<std::string>().empty());
  }
}

// A fit that would go on for minutes, told to stop as soon as it has said what it does.
TEST_F(CliTest, AnInterruptedTuneWritesTheBestSoFar) {
  const std::string log = JointLog();
  for (const char* signal : {"INT", "TERM"}) {
    SCOPED_TRACE(signal);
    const std::string cwd = scratch_.Path("cwd");
    std::filesystem::create_directories(cwd);
    // As soon as it has said what it does; waited for a minute at most.
    const Answer answer = scratch_.Shell("cd '" + cwd + "'; '" GAPSCOPE_PROGRAM "' tune " + Joint() + " '" + log +
                                         "' --starts 1000 --json --progress json --out stopped_" + signal +
                                         " 2> told & pid=$!; for i in $(seq 600); do grep -q stage '" + cwd +
                                         "/told' && break; sleep 0.1; done; kill -" + signal + " $pid; wait $pid");
    EXPECT_EQ(answer.status, 0) << answer.err;
    const auto json = nlohmann::json::parse(answer.out);
    EXPECT_EQ(json.at("termination"), "interrupted");
    EXPECT_TRUE(json.at("error").at("held_out").is_number());
    EXPECT_TRUE(Files(scratch_.Path("cwd/stopped_") + signal).contains("result.json"));
    std::filesystem::remove(scratch_.Path("cwd/told"));
  }
}

TEST_F(CliTest, ADivergenceIsAResultAndLeavesTheStreamsClean) {
  std::string text = "time_s,target_rad,position_rad\n";
  for (int k = 0; k < 200; ++k) text += std::to_string(0.002 * k) + (k < 20 ? ",0,0\n" : ",1e9,0.1\n");
  const Answer answer = Run("replay " + Joint() + " '" + scratch_.Write("wild.csv", text) + "' --json");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto json = nlohmann::json::parse(answer.out, nullptr, false);
  ASSERT_FALSE(json.is_discarded()) << answer.out.substr(0, 300);
  EXPECT_EQ(json["logs"][0]["outcome"], "diverged");
  EXPECT_TRUE(json["error"].is_null());
  EXPECT_NEAR(json["logs"][0]["diverged_at_s"].get<double>(), 0.04, 0.01);
  EXPECT_TRUE(Files(scratch_.Path("cwd")).empty()) << "MuJoCo left its log";
  EXPECT_EQ(Run("replay " + Joint() + " '" + scratch_.Path("wild.csv") + "' --fail-above 100").status, 1)
      << "a diverged log is above any threshold";
}

TEST_F(CliTest, OutWritesResultTracesAndModelAndNothingElse) {
  const std::string a = JointLog("a/run.csv"), b = JointLog("b/run.csv", 0.05), out = scratch_.Path("out/deep");
  const Answer answer = Run("replay " + Joint() + " '" + a + "' '" + b +
                            "' --with torque_limit --set torque_limit@motor.limit_n_m=20 --json --out '" + out + "'");
  ASSERT_EQ(answer.status, 0) << answer.err;
  const auto files = Files(out);
  for (const char* name : {"result.json", "model.xml", "traces/run.csv", "traces/1_run.csv"})
    EXPECT_TRUE(files.contains(name)) << name;
  for (const auto& name : files)
    EXPECT_TRUE(name.ends_with(".json") || name.ends_with(".xml") || name.ends_with(".csv") || name.ends_with(".html"))
        << "left over: " << name;
  EXPECT_EQ(ReadAll(out + "/result.json"), answer.out);
  EXPECT_NE(ReadAll(out + "/model.xml").find("gapscope.motor"), std::string::npos);
  const std::string trace = ReadAll(out + "/traces/run.csv");
  EXPECT_EQ(trace.substr(0, trace.find('\n')),
            "__time,command/motor,command/motor.feedforward,measured/position_rad,predicted/position_rad");
  EXPECT_EQ(std::count(trace.begin(), trace.end(), '\n'), 401);
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["effects"][0]["name"], "torque_limit");
  EXPECT_EQ(json["parameters"]["torque_limit@motor.limit_n_m"], 20);
  EXPECT_TRUE(Files(scratch_.Path("cwd")).empty());
}

TEST_F(CliTest, AClosedLoopsPageHoldsTheResultThatIsPrinted) {
  // A pendulum that its controller holds up: it stands still.
  std::string text = "t,target_theta,target_alpha,theta,alpha,feedforward,plant_input\n";
  for (int k = 0; k < 800; ++k) text += std::to_string(0.002 * k) + ",0,0,0.01,0.005,0,0\n";
  const std::string out = scratch_.Path("loop");
  const Answer answer =
      Run("replay '" + kModels + "qube_koopman/experiment.yaml' '" + scratch_.Write("upright.csv", text) +
          "' --mode closed_loop --json --quiet --out '" + out + "'");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_EQ(ReadAll(out + "/result.json"), answer.out);
  const auto json = nlohmann::ordered_json::parse(answer.out);
  EXPECT_TRUE(json["logs"][0]["statistics"].contains("command motor"));
  const std::string page = ReadAll(out + "/report.html"), open = "id=\"report-data\">";
  const std::size_t begin = page.find(open) + open.size();
  const auto data = nlohmann::ordered_json::parse(page.substr(begin, page.find("</script>", begin) - begin));
  EXPECT_EQ(data["result"], json);
  const std::string sent = ReadAll(out + "/closed_loop/upright.csv");
  EXPECT_EQ(sent.substr(0, sent.find('\n')), "__time,logged/motor,closed_loop/motor");
}

TEST_F(CliTest, AnUnwritableOutIsRefused) {
  const std::string log = JointLog();
  const std::string file = scratch_.Write("in_the_way", "x");
  const Answer blocked = Run("replay " + Joint() + " '" + log + "' --out '" + file + "'");
  EXPECT_EQ(blocked.status, 2);
  EXPECT_NE(blocked.err.find("in_the_way"), std::string::npos) << blocked.err;
  EXPECT_EQ(ReadAll(file), "x");
  const Answer nowhere = Run("replay " + Joint() + " '" + log + "' --out /proc/none");
  EXPECT_EQ(nowhere.status, 2) << nowhere.err;
  EXPECT_EQ(nowhere.out, "") << "no result is printed that was not written";
}

// A device that takes nothing stands for a full disk.
TEST_F(CliTest, WhatIsPrintedIntoNothingIsAnError) {
  const std::string log = JointLog();
  for (const std::string& words :
       {std::string("--help"), std::string("--version"), "replay " + Joint() + " '" + log + "'"}) {
    const Answer answer = Run(words + " >/dev/full");
    EXPECT_EQ(answer.status, 2) << words;
    EXPECT_NE(answer.err.find("standard output: cannot write all that was to be printed"), std::string::npos) << words;
  }
}

TEST_F(CliTest, FailAboveIsStatusOne) {
  const std::string replay = "replay " + Joint() + " '" + JointLog() + "' --quiet --json";
  const auto json = nlohmann::json::parse(Run(replay).out);
  const double error = json["error"];
  ASSERT_GT(error, 0);
  const Answer above = Run(replay + " --fail-above " + std::to_string(0.5 * error)),
               below = Run(replay + " --fail-above " + std::to_string(2 * error));
  EXPECT_EQ(above.status, 1);
  EXPECT_FALSE(nlohmann::json::parse(above.out, nullptr, false).is_discarded()) << "the result is printed all the same";
  EXPECT_EQ(below.status, 0);
}

TEST_F(CliTest, TheSameBytesWhateverTheJobs) {
  const std::string a = JointLog("a.csv"), b = JointLog("b.csv", 0.05);
  std::vector<nlohmann::json> results;
  for (const char* jobs : {"1", "2", "7"}) {
    auto json = nlohmann::json::parse(
        Run("replay " + Joint() + " '" + a + "' '" + b + "' --mode windows --window 0.1 --json --quiet --jobs " + jobs)
            .out);
    json["cost"].erase("wall_s");
    results.push_back(std::move(json));
  }
  EXPECT_EQ(results[0].dump(), results[1].dump());
  EXPECT_EQ(results[0].dump(), results[2].dump());
}

TEST_F(CliTest, TheTableFitsAHundredColumns) {
  const std::string log = JointLog("a_folder_with_a_rather_long_name/and_a_log_with_a_rather_long_name_too.csv");
  const Answer answer = Run("replay " + Joint() + " '" + log + "' --quiet");
  ASSERT_EQ(answer.status, 0) << answer.err;
  std::istringstream lines(answer.out);
  for (std::string line; std::getline(lines, line);) {
    // Characters, not bytes: the small picture of the error is of blocks that take three bytes each.
    const auto columns = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    EXPECT_LE(columns, 100) << line;
  }
  EXPECT_NE(answer.out.find("position_rad"), std::string::npos);
}

}  // namespace
}  // namespace gapscope::testing
