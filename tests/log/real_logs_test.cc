// Every real log in the shared data folder reads, at the rate that its provenance states. Prints one
// line per log. Skipped where the folder is absent.
#include <algorithm>
#include <cstdlib>
#include <filesystem>

#include <fmt/format.h>

#include "src/log/inspect.h"
#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

// Beside the project's folder, or beside the folder of its worktrees; GAPSCOPE_SHARED_DATA in the environment wins.
std::string DataFolder() {
  if (const char* stated = std::getenv("GAPSCOPE_SHARED_DATA")) return stated;
  const std::string beside_worktrees = std::string(GAPSCOPE_SOURCE_DIR) + "/../../shared/data";
  return std::filesystem::exists(GAPSCOPE_SHARED_DATA) ? GAPSCOPE_SHARED_DATA : beside_worktrees;
}

std::vector<std::string> RealLogs() {
  std::vector<std::string> paths;
  std::error_code absent;
  for (auto it = std::filesystem::recursive_directory_iterator(DataFolder(), absent); !absent && it != std::filesystem::end(it); ++it) {
    const auto extension = it->path().extension();
    if (extension == ".csv" || extension == ".json") paths.push_back(it->path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

TEST(RealLogsTest, EveryLogReads) {
  const auto paths = RealLogs();
  if (paths.empty()) GTEST_SKIP() << "no folder " << DataFolder();
  for (const auto& path : paths) {
    const std::string name = path.substr(DataFolder().size() + 1);
    const auto log = ReadLog(path, {});
    if (path.find("published_params") != std::string::npos) {  // parameters, not logs: refused as such
      ASSERT_FALSE(log.ok());
      EXPECT_NE(log.error().Text().find("no array 'entries'"), std::string::npos);
      continue;
    }
    ASSERT_TRUE(log.ok()) << log.error().Text();
    const auto timeline = BuildTimeline(log.value(), {});
    ASSERT_TRUE(timeline.ok()) << timeline.error().Text();
    std::vector<Finding> findings = log.value().findings;
    findings.insert(findings.end(), timeline.value().findings.begin(), timeline.value().findings.end());
    for (const auto& column : log.value().columns) {
      EXPECT_TRUE(ExtractColumn(log.value(), timeline.value(), column, {}, &findings).ok()) << name << " " << column.name;
    }
    std::string text;
    for (const auto& finding : findings) text += fmt::format(" {}{}{}:{}", finding.kind, finding.column.empty() ? "" : "/", finding.column, finding.count);
    std::printf("%-88s %6zu rows %8.2f Hz jitter %.2g s%s\n", name.c_str(), timeline.value().rows.size(), 1 / timeline.value().median_step_s,
                timeline.value().jitter_s, text.c_str());
    EXPECT_GT(timeline.value().rows.size(), 50u);
    EXPECT_EQ(timeline.value().time_unit, "s");
    // Sampled at 50 to 500 Hz, as the provenance says.
    EXPECT_GT(1 / timeline.value().median_step_s, 45) << name;
    EXPECT_LT(1 / timeline.value().median_step_s, 510) << name;
  }
}

TEST(RealLogsTest, Ak80FilesArePaired) {
  const std::string path = DataFolder() + "/ak80_6_simple_pendulum/control_method_ilqr/data_measured.csv";
  if (!std::filesystem::exists(path)) GTEST_SKIP() << "no " << path;
  const auto log = ReadLog(path, {.companions = {{"data_measured", "data_desired", "desired."}}});
  ASSERT_TRUE(log.ok()) << log.error().Text();
  ASSERT_TRUE(log.value().Find("desired.torque"));
  EXPECT_EQ(log.value().Find("desired.torque")->values.size(), log.value().rows());
}

}  // namespace
}  // namespace gapscope
