// Files of other tools are handed to the converter, word by word; what it says comes back.
#include "src/log/foreign.h"

#include <cstdlib>
#include <filesystem>

#include "src/log/npz_reader.h"
#include "src/log/npz_writer.h"
#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

class ForeignTest : public ::testing::Test {
 protected:
  // A converter that writes its words, a line each, to the file "words" and then does what `script` says.
  void Install(const std::string& script) {
    const std::string path = folder_.Write(
        "convert", "#!/bin/sh\nprintf '%s\\n' \"$@\" > '" + folder_.Path("words") + "'\n" + script + "\n");
    std::filesystem::permissions(path, std::filesystem::perms::owner_all);
    setenv("GAPSCOPE_CONVERT", path.c_str(), 1);
  }
  ~ForeignTest() override { unsetenv("GAPSCOPE_CONVERT"); }

  std::string MessageOf(const std::string& path) const {
    const auto read = ReadLog(path, {});
    EXPECT_FALSE(read.ok());
    return read.ok() ? "" : read.error().Text();
  }

  const TempFolder folder_;
};

TEST_F(ForeignTest, FormatsAreKnownByName) {
  for (const auto& [name, format] : std::vector<std::pair<std::string, std::string>>{{"a.MAT", "MAT file"},
                                                                                     {"a.h5", "HDF5 file"},
                                                                                     {"a.feather", "Parquet"},
                                                                                     {"a.mcap", "MCAP file"},
                                                                                     {"a.bag", "ROS bag"},
                                                                                     {"bag/metadata.yaml", "ROS bag"},
                                                                                     {"set/meta/info.json", "LeRobot"},
                                                                                     {"a.pt", "PACE"}}) {
    std::string path = folder_.Write(name, "?");
    if (name.starts_with("bag/")) path = folder_.Path("bag");
    if (name.starts_with("set/")) path = folder_.Path("set#3");
    const ForeignFormat* found = ForeignFormatOf(path);
    ASSERT_NE(found, nullptr) << path;
    EXPECT_TRUE(found->name.starts_with(format)) << found->name;
  }
  EXPECT_EQ(ForeignFormatOf(folder_.Write("a.csv", "t,x\n")), nullptr);
  EXPECT_EQ(ForeignFormatOf(folder_.Path("gone.mat")), nullptr);
}

TEST_F(ForeignTest, WithoutAConverterTheErrorSaysWhatToInstall) {
  setenv("GAPSCOPE_CONVERT", folder_.Path("gone").c_str(), 1);
  const std::string said = MessageOf(folder_.Write("a.mcap", "?"));
  EXPECT_NE(said.find("MCAP file"), std::string::npos) << said;
  EXPECT_NE(said.find(kInstallConverter), std::string::npos) << said;
}

TEST_F(ForeignTest, WordsArriveAsTheyStand) {
  Log table = MakeLog({{"t", {0, 1}}, {"q", {2, 3}}});
  ASSERT_TRUE(WriteNpz(folder_.Path("made.npz"), table).ok());
  Install("cp '" + folder_.Path("made.npz") + "' \"$2\"");
  const std::string path = folder_.Write("a $(touch x);'b.mat", "?");
  const auto log = ReadLog(path, {.source = R"({"variable": "a 'b"})"});
  ASSERT_TRUE(log.ok()) << log.error().Text();
  EXPECT_EQ(log.value().Find("q")->values, (std::vector<double>{2, 3}));
  EXPECT_EQ(log.value().format, "MAT file");
  const std::string words = ReadFile(folder_.Path("words")).value();
  EXPECT_TRUE(words.starts_with("--out\n")) << words;
  EXPECT_TRUE(words.ends_with("\n--options\n{\"variable\": \"a 'b\"}\n--\n" + path + "\n")) << words;
}

TEST_F(ForeignTest, ADatasetIsTheLogsThatTheConverterLists) {
  folder_.Write("set/meta/info.json", "{}");
  const std::string set = folder_.Path("set");
  Install("printf '0\\n7\\n'");
  EXPECT_EQ(LogsNamed(set).value(), (std::vector{set + "#0", set + "#7"}));
  EXPECT_EQ(LogsNamed(set + "#0:8").value(), (std::vector{set + "#0", set + "#7"}));
  EXPECT_EQ(ReadFile(folder_.Path("words")).value(), "--episodes\n--\n" + set + "#0:8\n");
  // One episode, or a file: no converter is asked.
  setenv("GAPSCOPE_CONVERT", folder_.Path("gone").c_str(), 1);
  for (const std::string& one : {set + "#3", folder_.Write("a.mat", "?"), folder_.Path("none.csv")})
    EXPECT_EQ(LogsNamed(one).value(), std::vector{one});
  ASSERT_FALSE(LogsNamed(set).ok());
  EXPECT_EQ(LogsNamed(set).error().cure, kInstallConverter);
}

TEST_F(ForeignTest, RefusalsAndFailuresAreErrors) {
  const std::string path = folder_.Write("a.mat", "?");
  Install("printf 'too large\\n%s, q\\n7 rows\\n5\\nsplit it\\n' here; exit 2");
  const auto refused = ReadLog(path, {});
  ASSERT_FALSE(refused.ok());
  EXPECT_EQ(refused.error().what, "too large");
  EXPECT_EQ(refused.error().where, "here, q");
  EXPECT_EQ(refused.error().cure, "split it");
  Install("kill -9 $$");
  EXPECT_NE(MessageOf(path).find("crashes"), std::string::npos);
  Install("exit 1");
  EXPECT_NE(MessageOf(path).find("the converter failed"), std::string::npos);
  Install("echo PK > \"$2\"");
  EXPECT_NE(MessageOf(path).find("NPZ"), std::string::npos);
}

TEST_F(ForeignTest, AnMcapFileIsMadeOfATable) {
  const Log log = MakeLog({{"__time", {0, 1}}, {"/real/joint_states/arm/position", {2, 3}}});
  const std::string path = folder_.Path("a.mcap");
  setenv("GAPSCOPE_CONVERT", folder_.Path("gone").c_str(), 1);
  const Status lacking = WriteMcap(path, log);
  ASSERT_FALSE(lacking.ok());
  EXPECT_EQ(lacking.error().cure, kInstallConverter);
  EXPECT_FALSE(std::filesystem::exists(path));
  Install("cp \"$6\" \"$2\"");
  ASSERT_TRUE(WriteMcap(path, log).ok());
  EXPECT_TRUE(ReadFile(folder_.Path("words")).value().starts_with("--out\n" + path + "\n--to\nmcap\n--\n"));
  const auto table = ReadNpz(path, ReadFile(path).value());
  ASSERT_TRUE(table.ok()) << table.error().Text();
  EXPECT_EQ(table.value().Find("/real/joint_states/arm/position")->values, (std::vector<double>{2, 3}));
}

}  // namespace
}  // namespace gapscope
