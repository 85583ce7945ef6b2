// A fleet of small logs: planned by its file, run in parts, merged; and a new log against a result.
#include <fstream>
#include <nlohmann/json.hpp>

#include "tests/cli/fixture.h"

namespace gapscope::testing {
namespace {

class FleetTest : public CliTest {
 protected:
  void SetUp() override {
    for (const char* robot : {"a", "b"}) {
      for (const char* day : {"2", "10"}) std::filesystem::rename(JointLog(), Log(robot, day));
    }
  }
  std::string Log(const std::string& robot, const std::string& day) {
    std::filesystem::create_directories(scratch_.Path("logs/" + robot));
    return scratch_.Path("logs/" + robot + "/" + day + ".csv");
  }
  std::string Fleet(const std::string& logs = "logs/{robot}/{day}.csv", const std::string& more = "") {
    return "'" +
           scratch_.Write("fleet.yaml", "schema: gapscope.fleet/1\nexperiment: " + kModels +
                                            "joint/experiment.yaml\nwhat: tune\nlogs: " + logs + "\n" + more) +
           "'";
  }
  std::string Work() { return scratch_.Path("work"); }
  nlohmann::json Json(const std::string& name) { return nlohmann::json::parse(ReadAll(Work() + "/" + name)); }
};

TEST_F(FleetTest, RobotsAndDaysComeOutOfPathsAndAFailedUnitIsListed) {
  std::ofstream(Log("b", "11")) << "not a log\n";
  ASSERT_EQ(Run("fleet plan " + Fleet() + " --out '" + Work() + "'").status, 0);
  const auto plan = Json("plan.json");
  ASSERT_EQ(plan["tasks"].size(), 5u);
  // The tenth is after the second.
  EXPECT_EQ(plan["tasks"][1]["group"], (nlohmann::json{{"robot", "a"}, {"day", "10"}}));
  const std::string one = plan["tasks"][1]["task"];
  EXPECT_EQ(Run("fleet run --unit " + one + " '" + Work() + "'").status, 0);
  EXPECT_EQ(Run("fleet merge '" + Work() + "'").status, 1);  // four are missing
  const Answer rest = Run("fleet run --shard 1/1 '" + Work() + "'");
  EXPECT_EQ(rest.status, 1) << rest.err;
  EXPECT_NE(rest.err.find("4 done (1 failed), 1 were there"), std::string::npos) << rest.err;

  const Answer merged = Run("fleet merge '" + Work() + "'");
  EXPECT_EQ(merged.status, 1);
  EXPECT_NE(merged.out.find("4 units merged, 1 failed, 0 missing"), std::string::npos) << merged.out;
  const auto json = Json("merged.json");
  EXPECT_EQ(json["logs"].size(), 4u);
  EXPECT_EQ(json["logs"][0]["group"]["robot"], "a");
  EXPECT_EQ(json["failed"][0]["group"]["day"], "11");
  EXPECT_EQ(json["changes"], nlohmann::json::array());
  const std::string units = ReadAll(Work() + "/units.csv");
  EXPECT_EQ(units.substr(0, units.find(",state")), "task,robot,day,log");
  EXPECT_EQ(std::count(units.begin(), units.end(), '\n'), 6);
  EXPECT_NE(ReadAll(Work() + "/parameters.csv").find(",b,2,motor.kp,"), std::string::npos);
  EXPECT_NE(ReadAll(Work() + "/fleet.html").find("\"name\":\"b\""), std::string::npos);

  // What a disk or a stranger has damaged is that unit's failure, and is done anew.
  const auto damage = [&](const char* text) { std::ofstream(Work() + "/results/" + one + ".json") << text; };
  for (const char* text : {"[1]", "{\"result\": {\"schema\": \"gapscope.tune/1\"}}", "{\"error\": 3}", "{\"resu"}) {
    damage(text);
    const Answer damaged = Run("fleet merge '" + Work() + "'");
    EXPECT_EQ(damaged.status, 1) << damaged.err;
    EXPECT_NE(damaged.out.find("3 units merged, 2 failed, 0 missing"), std::string::npos) << text << damaged.out;
  }
  const Answer anew = Run("fleet run --unit " + one + " '" + Work() + "' --quiet --json");
  EXPECT_EQ(anew.status, 0) << anew.err;
  EXPECT_EQ(anew.err, "");
  EXPECT_EQ(nlohmann::json::parse(anew.out)["done"], 1);

  // A result is that of its log: another one is not taken for it.
  std::filesystem::rename(JointLog("other.csv", 0.05), Log("a", "10"));
  std::filesystem::remove(Work() + "/results/" + one + ".json");
  EXPECT_EQ(Run("fleet run --unit " + one + " '" + Work() + "'").status, 1);
  EXPECT_NE(ReadAll(Work() + "/results/" + one + ".json").find("has changed since the plan"), std::string::npos);
}

// Days that are called as numbers are not all of them ones.
TEST_F(FleetTest, ADayThatIsCalledNanHasItsPlace) {
  for (const char* day : {"nan", "3", "inf", "nanny"}) std::filesystem::rename(JointLog(), Log("a", day));
  ASSERT_EQ(Run("fleet plan " + Fleet() + " --out '" + Work() + "'").status, 0);
  std::vector<std::string> days;
  const auto plan = Json("plan.json");
  for (const auto& task : plan["tasks"]) {
    if (task["group"]["robot"] == "a") days.push_back(task["group"]["day"]);
  }
  EXPECT_EQ(days, (std::vector<std::string>{"2", "3", "10", "inf", "nan", "nanny"}));
}

// The same without a file: a unit a log.
TEST_F(FleetTest, LogsWithoutAFleetAreTunedOneByOne) {
  ASSERT_EQ(Run("plan " + Joint() + " '" + Log("a", "2") + "' '" + Log("b", "10") + "' --out '" + Work() + "'").status,
            0);
  EXPECT_EQ(Run("run --shard 2/2 '" + Work() + "'").status, 0);
  EXPECT_EQ(Run("merge '" + Work() + "'").status, 1);
  const auto json = Json("merged.json");
  EXPECT_EQ(json["schema"], "gapscope.merge/1");
  EXPECT_EQ(json["logs"].size(), 1u);
  EXPECT_EQ(json["logs"][0]["log"], Log("b", "10"));
  EXPECT_EQ(json["missing"], nlohmann::json{Log("a", "2")});
  EXPECT_EQ(json["parameters"][0]["name"], "motor.kp");
  EXPECT_FALSE(std::filesystem::exists(Work() + "/fleet.html"));
  ExpectRefused("plan " + Joint() + " nowhere.csv --out '" + Work() + "'", {"nowhere.csv"});
}

TEST_F(FleetTest, AFleetFileThatCannotBeMeantIsRefused) {
  const std::string out = " --out '" + Work() + "'";
  ExpectRefused("fleet plan " + Fleet("logs/{robot}/{day}.txt") + out, {"no log fits", "{day}.txt"});
  ExpectRefused("fleet plan " + Fleet("logs/{robot/{day}.csv") + out, {"not a column's name", "{robot"});
  ExpectRefused("fleet plan " + Fleet("logs/{robot}/{day}.csv", "time: week") + out, {"not a column", "robot, day"});
  ExpectRefused("fleet plan " + Fleet("logs/{robot}/{day}.csv", "tim: day") + out, {"tim", "time"});
  ExpectRefused("fleet plan " + Fleet("logs/{robot}/{log}.csv") + out, {"{log}", "call it otherwise"});
  ASSERT_EQ(Run("fleet plan " + Fleet() + out).status, 0);
  ExpectRefused("fleet run --unit 0123 '" + Work() + "'", {"no such unit", "0123"});
  ExpectRefused("fleet run '" + Work() + "'", {"--shard"});

  // A plan of a stranger names no file outside its folder, and no unit without a log.
  auto plan = Json("plan.json");
  for (const char* id : {"../../away", "/tmp/away", "0123456789ABCDEF", ""}) {
    plan["tasks"][0]["task"] = id;
    std::ofstream(Work() + "/plan.json") << plan;
    ExpectRefused("fleet run --shard 1/1 '" + Work() + "'", {"not the name of a task", "16 hexadecimal digits"});
    ExpectRefused("fleet merge '" + Work() + "'", {"not the name of a task"});
  }
  plan["tasks"][0]["task"] = "0123456789abcdef";
  plan["tasks"][0]["logs"] = nlohmann::json::array();
  std::ofstream(Work() + "/plan.json") << plan;
  ExpectRefused("fleet merge '" + Work() + "'", {"a task without a log"});
}

// Files of strangers: a task's name is part of a path, and patterns and numbers are as large as they like.
TEST_F(FleetTest, APlanThatNoPlanWroteIsRefused) {
  const std::string out = " --out '" + Work() + "'", work = "'" + Work() + "'";
  std::filesystem::create_directories(scratch_.Path("long"));
  scratch_.Write("long/" + std::string(200, '1') + ".csv", "");
  std::string pattern = "\"long/";
  for (int i = 0; i < 40; ++i) pattern += "*1";
  ExpectRefused("fleet plan " + Fleet(pattern + "y\"") + out, {"no log fits"});
  ASSERT_EQ(Run("plan " + Joint() + " '" + Log("a", "2") + "'" + out).status, 0);
  const auto good = Json("plan.json");
  const std::string task = good["tasks"][0]["task"];
  const std::vector<std::pair<const char*, nlohmann::json>> broken = {
      {"/tasks/0/task", "../../elsewhere"},
      {"/tasks/0/task", 7},
      {"/tasks/0", {{"task", task}, {"logs", nlohmann::json::array()}, {"group", nlohmann::json::object()}}},
      {"/tasks", nlohmann::json::array()},
      {"/options", nlohmann::json::object()},
      {"/options/with", "coulomb_friction"},
      {"/what", "anything"},
      {"/shards", 1e300},
      {"/schema", 3}};
  for (const auto& [place, value] : broken) {
    auto plan = good;
    plan[nlohmann::json::json_pointer(place)] = value;
    scratch_.Write("work/plan.json", plan.dump());
    ExpectRefused("run --shard 1/1 " + work, {"plan.json"});
    ExpectRefused("merge " + work, {"plan.json"});
  }
  scratch_.Write("work/plan.json", good.dump());
  // Whoever copies this recurses, and an object that grows copies.
  const std::string deep = std::string(200'000, '[') + std::string(200'000, ']');
  scratch_.Write("work/results/" + task + ".json", R"({"a": )" + deep + R"(, "result": )" + deep + "}");
  EXPECT_EQ(Run("merge " + work).status, 1);
}

TEST_F(FleetTest, ANewLogIsTheSameAsBeforeOrIsNot) {
  const std::string same = "'" + Log("b", "2") + "'", found = "'" + scratch_.Path("tuned") + "'";
  ASSERT_EQ(Run("tune " + Joint() + " '" + Log("a", "2") + "' --starts 1 --quiet --out " + found).status, 0);
  const Answer before = Run("monitor " + found + " " + same + " --fail-above 1.5 --fail-on-change --quiet");
  EXPECT_EQ(before.status, 0) << before.out << before.err;
  EXPECT_NE(before.out.find("the same as before"), std::string::npos) << before.out;
  const std::string other = "'" + JointLog("other.csv", 0.2) + "'";
  const Answer after = Run("monitor " + found + " " + other + " --fail-above 1.5 --quiet --json");
  EXPECT_EQ(after.status, 1) << after.out << after.err;
  EXPECT_EQ(nlohmann::json::parse(after.out)["schema"], "gapscope.monitor/1");
}

}  // namespace
}  // namespace gapscope::testing
