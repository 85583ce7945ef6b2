// Logs and results taken further: converted, applied to an MJCF, exported to another engine.
#include <map>
#include <nlohmann/json.hpp>

#include "tests/cli/fixture.h"

namespace gapscope::testing {
namespace {

TEST_F(CliTest, ApplyWritesAResultIntoTheMjcf) {
  const std::string log = JointLog(), out = scratch_.Path("out"), changed = scratch_.Path("new/robot.xml");
  ASSERT_EQ(
      Run("replay " + Joint() + " '" + log + "' --with coulomb_friction --set coulomb_friction@joint.friction_n_m=2 " +
          "--with sensor_delay@position_rad --out '" + out + "'")
          .status,
      0);
  const Answer answer = Run("apply '" + out + "' --out '" + changed + "'");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_NE(answer.out.find("frictionloss"), std::string::npos) << answer.out;
  EXPECT_NE(answer.out.find("not in it: sensor_delay@position_rad"), std::string::npos) << answer.out;
  // All of the user's lines but the joint's and the path of what it includes.
  const Answer diff = scratch_.Shell("diff '" + kModels + "joint/joint.xml' '" + changed + "' | grep '^<'");
  EXPECT_EQ(std::count(diff.out.begin(), diff.out.end(), '\n'), 2) << diff.out;
  EXPECT_NE(ReadAll(changed).find("<!-- gapscope: coulomb_friction@joint: 2 N m -->"), std::string::npos);
  const auto json = nlohmann::json::parse(Run("apply '" + out + "' --out '" + changed + "' --json").out);
  EXPECT_EQ(json["schema"], "gapscope.apply/1");
  EXPECT_EQ(json["changes"][0]["element"], "joint joint");
}

TEST_F(CliTest, ApplyRefusesWhatIsNoResultOfThisModel) {
  const std::string log = JointLog(), out = scratch_.Path("out");
  ASSERT_EQ(Run("replay " + Joint() + " '" + log + "' --with coulomb_friction --out '" + out + "'").status, 0);
  const std::string kept = scratch_.Write("kept.xml", "as it was"), to = " --out '" + kept + "'";
  ExpectRefused("apply", {"result"});
  ExpectRefused("apply '" + out + "'", {"--out"});
  ExpectRefused("apply '" + scratch_.Path("nowhere") + "'" + to, {"nowhere", "cannot open"});
  std::filesystem::create_directories(scratch_.Path("empty"));
  ExpectRefused("apply '" + scratch_.Path("empty") + "'" + to, {"empty/result.json"});
  ExpectRefused("apply '" + scratch_.Write("other.json", "{\"schema\": \"gapscope.bench/1\"}") + "'" + to,
                {"gapscope.bench/1", "gapscope.diagnosis/1"});
  ExpectRefused("apply '" + scratch_.Write("list.json", "[1]") + "'" + to, {"schema none"});
  const std::string result = ReadAll(out + "/result.json");
  auto json = nlohmann::ordered_json::parse(result);
  json.erase("experiment");
  const std::string old = "apply '" + scratch_.Write("old.json", json.dump()) + "'" + to;
  ExpectRefused(old, {"does not name its experiment", "--experiment FILE"});
  EXPECT_EQ(ReadAll(kept), "as it was");
  // Of another rig, and of one that has changed since.
  ExpectRefused(old + " --experiment '" + kModels + "qube/experiment.yaml'", {"coulomb_friction@joint", "arm"});
  json["model"]["values"]["joint.inertai"] = 1;
  ExpectRefused("apply '" + scratch_.Write("gone.json", json.dump()) + "' --experiment " + Joint() + to,
                {"joint.inertai", "did you mean 'joint.inertia'?"});
  json["experiment"] = "gone/experiment.yaml";
  ExpectRefused("apply '" + scratch_.Write("moved.json", json.dump()) + "'" + to,
                {"gone/experiment.yaml", "--experiment FILE"});
  EXPECT_EQ(ReadAll(kept), "as it was");
}

TEST_F(CliTest, ParametersAreTakenOverFromAResult) {
  const std::string replay = "replay " + Joint() + " '" + JointLog() + "' ", out = scratch_.Path("out"),
                    with = "--with coulomb_friction@joint ";
  const auto error = [&](const std::string& more) {
    const Answer answer = Run(replay + more + " --json");
    EXPECT_EQ(answer.status, 0) << answer.err;
    return nlohmann::json::parse(answer.out)["error"].get<double>();
  };
  const double set = error(with + "--set coulomb_friction@joint.friction_n_m=2 --set motor.kp=45 --out '" + out + "'");
  EXPECT_EQ(error(with + "--params '" + out + "'"), set);
  EXPECT_EQ(error(with + "--params '" + out + "/result.json'"), set);
  EXPECT_NE(error(with), set);
  // With its effects too.
  EXPECT_EQ(error("--from '" + out + "'"), set);
  EXPECT_EQ(error("--from '" + out + "/result.json' " + with), set);
  EXPECT_NE(error("--from '" + out + "' --set motor.kp=50"), set);
  ExpectRefused(replay + "--from '" + scratch_.Path("nowhere") + "'", {"nowhere"});
  ExpectRefused(replay + "--params '" + out + "'", {"lacks", "--with coulomb_friction@joint"});
  std::filesystem::create_directories(scratch_.Path("empty"));
  ExpectRefused(replay + "--params '" + scratch_.Path("empty") + "'", {"empty/result.json"});
}

// Whatever a file is called, nothing of its name acts on a terminal or a page, and no name ends the program.
TEST_F(CliTest, NamesThatHideSomethingAreShown) {
  const std::string log = JointLog(), out = scratch_.Path("out");
  for (const std::string name : {"a\033[2J.csv", "a\u202Evsc.csv", "a\xff.csv"}) {
    std::filesystem::copy_file(log, scratch_.Path(name));
    const std::string replay = "replay " + Joint() + " '" + scratch_.Path(name) + "'";
    const Answer table = Run(replay + " --out '" + out + "'"), json = Run(replay + " --json");
    EXPECT_EQ(table.status, 0) << table.err;
    EXPECT_EQ(json.status, 0) << json.err;
    const std::string page = ReadAll(out + "/report.html");
    for (const std::string& text : {table.out, json.out, page}) {
      EXPECT_EQ(text.find('\033'), std::string::npos);
      EXPECT_EQ(text.find("\u202E"), std::string::npos);
    }
    const std::string shown = name.find('\033') != std::string::npos ? "\\u001b" : "\\u202e";
    if (name.find('\xff') == std::string::npos) {
      EXPECT_NE(page.find("\\" + shown), std::string::npos) << "not as its escape";
    }
    EXPECT_TRUE(nlohmann::json::accept(json.out));
    const Answer refused = Run("replay " + Joint() + " '" + scratch_.Path("no" + name) + "'");
    EXPECT_EQ(refused.status, 2);
    EXPECT_EQ(refused.err.find('\033'), std::string::npos);
  }
}

TEST_F(CliTest, InspectNeedsNoExperiment) {
  const std::string log = JointLog();
  const auto json = nlohmann::json::parse(Run("inspect '" + log + "' --json").out);
  EXPECT_EQ(json["logs"][0]["log"], log);
  std::vector<std::string> names;
  for (const auto& channel : json["logs"][0]["channels"]) names.push_back(channel["name"]);
  EXPECT_NE(std::find(names.begin(), names.end(), "target_rad"), names.end());
  EXPECT_EQ(std::find(names.begin(), names.end(), "time_s"), names.end());
  ExpectRefused("inspect " + Joint(), {"no log"});
  ExpectRefused("inspect '" + scratch_.Path("gone.csv") + "'", {"gone.csv"});
}

TEST_F(CliTest, ConvertedLogsReplayToTheLastDigit) {
  const std::string log = JointLog(), out = scratch_.Path("tables");
  const auto json = nlohmann::json::parse(Run("convert '" + log + "' --out '" + out + "' --json").out);
  EXPECT_EQ(json["schema"], "gapscope.convert/1");
  const std::string table = json["logs"][0]["table"];
  const auto error = [&](const std::string& path) {
    return nlohmann::json::parse(Run("replay " + Joint() + " '" + path + "' --json").out)["error"];
  };
  EXPECT_EQ(error(table), error(log));
  ExpectRefused("convert '" + log + "' '" + log + "' --out '" + out + "'", {"two logs of one name"});
  ExpectRefused("convert '" + scratch_.Path("gone.csv") + "' --out '" + out + "'", {"gone.csv"});
}

TEST_F(CliTest, ExportTellsAndMeasuresWhatAnotherEngineLoses) {
  const std::string log = JointLog(), out = scratch_.Path("out"), to = scratch_.Path("mjx");
  ASSERT_EQ(
      Run("replay " + Joint() + " '" + log + "' --with coulomb_friction --with torque_bias --with command_delay " +
          "--set coulomb_friction@joint.friction_n_m=2 --set torque_bias@joint.torque_n_m=1 " +
          "--set command_delay@motor.delay_s=0.01 --out '" + out + "'")
          .status,
      0);
  const Answer answer = Run("export '" + out + "' --to mjx --out '" + to + "' --json");
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_EQ(answer.out, ReadAll(to + "/fidelity.json"));
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["schema"], "gapscope.fidelity/1");
  std::map<std::string, std::string> forms;
  for (const auto& effect : json["effects"]) forms[effect["name"]] = effect["form"];
  EXPECT_EQ(forms, (std::map<std::string, std::string>{
                       {"coulomb_friction", "exact"}, {"torque_bias", "exact"}, {"command_delay", "host"}}));
  // With what the host does the file moves as the model does.
  EXPECT_NEAR(json["held_out_error"]["exported"], json["held_out_error"]["model"], 1e-4);
  EXPECT_EQ(ReadAll(to + "/model.xml").find("plugin"), std::string::npos);
  const std::string lab = scratch_.Path("mjlab");
  const auto counted =
      nlohmann::json::parse(Run("export '" + out + "' --to mjlab --timestep 0.0005 --out '" + lab + "' --json").out);
  EXPECT_EQ(counted["delay_steps"]["motor"], 20);
  EXPECT_EQ(counted["files"][0], lab + "/gapscope_mjlab.py");
  EXPECT_NE(ReadAll(lab + "/gapscope_mjlab.py").find("_lag(20, 20)"), std::string::npos);
  EXPECT_NEAR(counted["held_out_error"]["exported"], counted["held_out_error"]["model"], 0.01);
  std::filesystem::remove(log);
  EXPECT_NE(Run("export '" + out + "' --to mjx --out '" + to + "'").out.find("not measured"), std::string::npos);
}

TEST_F(CliTest, ATuneIsExportedWithDraws) {
  const std::string out = scratch_.Path("out"), to = scratch_.Path("to");
  const std::string tune = "tune " + Joint() + " '" + JointLog() + "' --starts 1 --out '" + out + "'";
  ASSERT_EQ(Run(tune).status, 0);
  ExpectRefused("export '" + out + "' --to mjx --draws 7 --out '" + to + "'", {"nothing to draw", "--freeze"});
  ASSERT_EQ(Run(tune + " --with command_delay --freeze motor.kp --freeze motor.kd --freeze joint.inertia" +
                " --freeze joint.damping")
                .status,
            0);
  const Answer answer = Run("export '" + out + "' --to mjx --draws 7 --seed 3 --out '" + to + "'");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_NE(answer.out.find("7 draws of what the logs leave open"), std::string::npos) << answer.out;
  const auto json = nlohmann::json::parse(ReadAll(to + "/randomization.json"));
  EXPECT_EQ(json["schema"], "gapscope.randomization/1");
  EXPECT_EQ(json["draws"], 7);
  EXPECT_EQ(json["seed"], 3);
  std::size_t known = 0;
  const auto tuned = nlohmann::json::parse(ReadAll(out + "/result.json"));
  for (const auto& p : tuned["parameters"]) known += p["identifiable"] == true;
  ASSERT_GT(known, 0u);
  EXPECT_EQ(json["parameters"].size(), known);
  for (const auto& p : json["parameters"]) EXPECT_LT(p["low"], p["high"]) << p["name"];
  EXPECT_EQ(ReadAll(to + "/randomization.npz").substr(0, 2), "PK");
}

TEST_F(CliTest, ExportRefusesWhatItCannotWrite) {
  const std::string log = JointLog(), out = scratch_.Path("out"), to = scratch_.Path("to");
  ASSERT_EQ(Run("replay " + Joint() + " '" + log + "' --out '" + out + "'").status, 0);
  ExpectRefused("export '" + out + "' --to mjx", {"--out"});
  ExpectRefused("export '" + out + "' --to gazebo --out '" + to + "'", {"--to", "gazebo", "mjx"});
  ExpectRefused("export '" + out + "' --to mjx --timestep 0 --out '" + to + "'", {"--timestep"});
  ExpectRefused("export '" + out + "' --to mjx --draws 5 --out '" + to + "'", {"only a result of tune", "--from"});
  ExpectRefused("export '" + scratch_.Write("list.json", "[1]") + "' --to mjx --out '" + to + "'", {"schema none"});
  EXPECT_FALSE(std::filesystem::exists(to));
}

}  // namespace
}  // namespace gapscope::testing
