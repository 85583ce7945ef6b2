// What the program says of itself, and a diagnosis that another machine runs again.
#include <nlohmann/json.hpp>
#include <regex>

#include "tests/cli/fixture.h"

namespace gapscope::testing {
namespace {

nlohmann::json CheckOf(const nlohmann::json& doctor, const std::string& name) {
  for (const auto& check : doctor["checks"]) {
    if (check["name"] == name) return check;
  }
  ADD_FAILURE() << "no check " << name;
  return {{"good", false}};
}

TEST_F(CliTest, DoctorFindsAllThatIsNeeded) {
  const Answer answer = Run("doctor --json --folder new/place");
  ASSERT_EQ(answer.status, 0) << answer.out << answer.err;
  const auto json = nlohmann::json::parse(answer.out);
  EXPECT_EQ(json["schema"], "gapscope.doctor/1");
  EXPECT_TRUE(json["good"]);
  for (const char* name : {"MuJoCo", "plugins", "model", "folder"}) EXPECT_TRUE(CheckOf(json, name)["good"]) << name;
  for (const auto& check : json["checks"]) EXPECT_EQ(check["good"], check["cure"] == "") << check;
  EXPECT_NE(std::string(CheckOf(json, "plugins")["found"]).find("5 of 5"), std::string::npos);
  EXPECT_TRUE(Files(scratch_.Path("cwd")).empty()) << "nothing is left";
}

// What is missing is named with its cure; only what the main job needs makes the status 1.
TEST_F(CliTest, DoctorNamesWhatIsMissing) {
  const std::string nothing = "PATH=/nowhere GAPSCOPE_CONVERT=/nowhere/gapscope-convert ";
  const Answer bare = scratch_.Shell(nothing + "'" GAPSCOPE_PROGRAM "' doctor");
  EXPECT_EQ(bare.status, 0) << bare.out;
  for (const char* said : {"encoder    missing", "apt-get install ffmpeg", "converter  missing", "pip install"})
    EXPECT_NE(bare.out.find(said), std::string::npos) << said << "\n" << bare.out;
  EXPECT_EQ(bare.err, "");
  const Answer refused = Run("doctor --folder /proc/self --json");
  EXPECT_EQ(refused.status, 1) << refused.out;
  const auto folder = CheckOf(nlohmann::json::parse(refused.out), "folder");
  EXPECT_FALSE(folder["good"]);
  EXPECT_NE(std::string(folder["cure"]), "");
}

// CITATION.cff, pyproject.toml and the program name one title and one version.
TEST_F(CliTest, ItIsCitedAsItsCitationFileSays) {
  const std::string cff = ReadAll(GAPSCOPE_SOURCE_DIR "/CITATION.cff");
  const auto field = [&](const std::string& name) {
    std::smatch found;
    EXPECT_TRUE(std::regex_search(cff, found, std::regex("(?:^|\\n)[ -]*" + name + ": \"?([^\"\\n]*)"))) << name;
    return found.size() > 1 ? found[1].str() : "no " + name;
  };
  const std::string text = Run("cite").out, entry = Run("cite --bibtex").out, version = field("version");
  for (const std::string& part : {field("title"), field("name"), version}) {
    EXPECT_NE(text.find(part), std::string::npos) << text;
    EXPECT_NE(entry.find("{" + part + "}"), std::string::npos) << entry;
  }
  EXPECT_EQ(Run("--version").out.rfind("gapscope " + version + " ", 0), 0u);
  EXPECT_NE(ReadAll(GAPSCOPE_SOURCE_DIR "/pyproject.toml").find("version = \"" + version + "\""), std::string::npos);
}

TEST_F(CliTest, AProfileIsATableOnStderr) {
  const std::string replay = "replay " + Joint() + " '" + JointLog() + "' --json ";
  const Answer answer = Run(replay + "--profile --verbose");
  ASSERT_EQ(answer.status, 0) << answer.err;
  EXPECT_FALSE(nlohmann::json::parse(answer.out, nullptr, false).is_discarded());
  for (const char* said : {"load: ", "replay: ", "\nreplay  ", "\nin all", " steps, "})
    EXPECT_NE(answer.err.find(said), std::string::npos) << said << "\n" << answer.err;
  EXPECT_EQ(Run(replay + "--profile --verbose --quiet").err, "");
}

// As docs/reference/machines.md tells it: lines of JSON with these keys, and at least one.
void ExpectProgress(const std::string& err) {
  std::istringstream lines(err);
  int seen = 0;
  for (std::string line; std::getline(lines, line);) {
    if (!line.starts_with("{")) continue;
    const auto json = nlohmann::json::parse(line);
    ++seen;
    EXPECT_TRUE(json.at("stage").is_string() && json.at("done").is_number() && json.at("total").is_number()) << line;
    EXPECT_TRUE(json.at("best").is_null() && json.at("elapsed_s").is_number()) << line;
  }
  EXPECT_GT(seen, 0) << err;
}

// A diagnosis packed here, unpacked in another folder, and run there from another folder again.
TEST_F(CliTest, ABundleGivesTheSameDigitsElsewhere) {
  std::filesystem::create_directories(scratch_.Path("cwd/rig"));
  std::filesystem::copy(kModels + "joint", scratch_.Path("cwd/rig/joint"), std::filesystem::copy_options::recursive);
  std::filesystem::copy(kModels + "common", scratch_.Path("cwd/rig/common"));
  JointLog("cwd/logs/it's a.csv");
  const std::string log = scratch_.Path("cwd/logs/it's a.csv");
  const Answer made = Run("diagnose rig/joint/experiment.yaml \"" + log +
                          "\" --effort quick --no-next-experiment --set motor.kp=210.5 --progress json --json "
                          "--bundle out/b.zip");
  ASSERT_EQ(made.status, 0) << made.err;
  ExpectProgress(made.err);
  const std::string there = scratch_.Path("there");
  const Answer unpacked =
      scratch_.Shell("mkdir -p '" + there + "' && cd '" + there + "' && (unzip -q '" + scratch_.Path("cwd/out/b.zip") +
                     "' || python3 -m zipfile -e '" + scratch_.Path("cwd/out/b.zip") + "' .)");
  ASSERT_EQ(unpacked.status, 0) << unpacked.err;
  std::filesystem::remove_all(scratch_.Path("cwd"));
  const auto bundle = nlohmann::json::parse(ReadAll(there + "/bundle.json"));
  EXPECT_EQ(bundle["files"].size(), 4u) << bundle.dump(2);
  const std::string run = "GAPSCOPE='" GAPSCOPE_PROGRAM "' sh '" + there + "/run.sh' --json";

  // What is not the log that was diagnosed is not run.
  const std::string packed = there + "/files/logs/it's a.csv", text = ReadAll(packed);
  scratch_.Write("there/files/logs/it's a.csv", text + "9,0,0\n");
  const Answer other = scratch_.Shell(run);
  EXPECT_EQ(other.status, 2);
  EXPECT_NE(other.err.find("it's a.csv"), std::string::npos) << other.err;

  // One digit of the result that is expected is another one: it alone is told.
  scratch_.Write("there/files/logs/it's a.csv", text);
  auto result = nlohmann::ordered_json::parse(ReadAll(there + "/result.json"));
  auto expected = result;
  expected["while"] = "changed";
  scratch_.Write("there/result.json", expected.dump());
  const Answer again = scratch_.Shell(run);
  EXPECT_EQ(again.status, 1) << again.err;
  EXPECT_NE(again.err.find("other digits"), std::string::npos) << again.err;
  EXPECT_NE(again.err.find("/while: "), std::string::npos) << again.err;
  auto got = nlohmann::ordered_json::parse(again.out);
  got.erase("wall_s"), result.erase("wall_s");
  EXPECT_EQ(got, result);
}

TEST_F(CliTest, WhatABundleCannotHoldIsRefused) {
  const std::string diagnose = "diagnose " + Joint() + " '" + JointLog() + "' ";
  ExpectRefused(diagnose + "--bundle b.tar", {"--bundle", "b.tar", "FILE.zip"});
  ExpectRefused(diagnose + "--bundle-digests", {"--bundle-digests", "--bundle FILE"});
  ExpectRefused(diagnose + "--bundle b.zip --from earlier", {"--from earlier", "--with and --set"});
  std::string experiment = ReadAll(kModels + "joint/experiment.yaml");
  // A comment that regular expressions of the library would end the program on.
  experiment =
      "# file" + std::string(900'000, ' ') + "\n" + Replaced(experiment, "model: ", "model: " + kModels + "joint/");
  ExpectRefused("diagnose '" + scratch_.Write("e.yaml", experiment) + "' '" + JointLog() + "' --bundle b.zip",
                {"e.yaml", "holds on this machine alone", "relative"});
}

}  // namespace
}  // namespace gapscope::testing
