// Every real log in the shared data folder reads, at the rate that its provenance states. Prints one
// line per log. Skipped where the folder is absent.
#include <fmt/format.h>

#include <algorithm>
#include <cstdlib>
#include <filesystem>

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
  for (auto it = std::filesystem::recursive_directory_iterator(DataFolder(), absent);
       !absent && it != std::filesystem::end(it); ++it) {
    const auto extension = it->path().extension();
    if (extension == ".csv" || extension == ".json") paths.push_back(it->path().string());
  }
  std::sort(paths.begin(), paths.end());
  return paths;
}

// As their provenance tells: six joints, 6000 rows at 50 Hz, lists in cells.
TEST(RealLogsTest, SageFoldersReadAsColumnsOfJoints) {
  const std::string folder = DataFolder() + "/so101_sage";
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no folder " << folder;
  for (const char* motion : {"multisine", "prbs_excitation"}) {
    const auto log = ReadLog(folder + "/" + motion, {});
    ASSERT_TRUE(log.ok()) << log.error().Text();
    EXPECT_EQ(log.value().rows(), 6000u);
    for (const char* joint : {"Rotation", "Pitch", "Elbow", "Wrist_Pitch", "Wrist_Roll", "Jaw"}) {
      for (const char* kind : {"positions/", "velocities/", "torques/", "control/positions/"})
        EXPECT_NE(log.value().Find(std::string(kind) + joint), nullptr) << kind << joint;
    }
    const auto timeline = BuildTimeline(log.value(), {});
    ASSERT_TRUE(timeline.ok());
    EXPECT_EQ(timeline.value().time_unit, "us");
    EXPECT_NEAR(timeline.value().median_step_s, 0.02006, 1e-5);
  }
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
      // Texts (lists of joints, say) are said, and are no numbers.
      const bool text = std::any_of(findings.begin(), findings.end(), [&](const Finding& finding) {
        return finding.kind == "text_column" && finding.column == column.name;
      });
      EXPECT_EQ(ExtractColumn(log.value(), timeline.value(), column, {}, &findings).ok(), !text)
          << name << " " << column.name;
    }
    std::string text;
    for (const auto& finding : findings)
      text += fmt::format(" {}{}{}:{}", finding.kind, finding.column.empty() ? "" : "/", finding.column, finding.count);
    std::printf("%-88s %6zu rows %8.2f Hz jitter %.2g s%s\n", name.c_str(), timeline.value().rows.size(),
                1 / timeline.value().median_step_s, timeline.value().jitter_s, text.c_str());
    EXPECT_GT(timeline.value().rows.size(), 50u);
    EXPECT_EQ(timeline.value().time_unit, name.starts_with("so101_sage") ? "us" : "s") << name;
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

struct RealChannel {
  const char* column;
  const char* unit;
  ChannelRole role;
};

InspectReport InspectReal(const std::string& path, const std::vector<RealChannel>& wanted) {
  const Log log = ReadLog(path, {}).value();
  const Timeline timeline = BuildTimeline(log, {}).value();
  std::vector<Finding> findings = timeline.findings;
  std::vector<InspectChannel> channels;
  for (const auto& channel : wanted) {
    const Column* column = log.Find(channel.column);
    EXPECT_TRUE(column) << channel.column;
    channels.push_back(
        {channel.column, channel.unit, channel.role, ExtractColumn(log, timeline, *column, {}, &findings).value()});
  }
  const InspectReport report = Inspect(timeline, channels, findings, log.rows());
  std::printf("%s\n", path.c_str());
  for (const auto& c : report.channels) {
    std::printf("  %-14s %10.4g .. %-10.4g count %-10.4g noise %-10.3g saturated %.3f\n", c.name.c_str(), c.minimum,
                c.maximum, c.quantisation_step, c.noise, c.saturation_share);
  }
  for (const auto& d : report.delays)
    std::printf("  %s -> %s: %.4f s, r = %.3f\n", d.command.c_str(), d.measured.c_str(), d.delay_s, d.correlation);
  for (const auto& e : report.excitation)
    std::printf("  %s: 95 %% below %.3g Hz, amplitudes %.3g\n", e.name.c_str(), e.bandwidth_95_hz, e.amplitude_ratio);
  for (const auto& m : report.coverage) {
    std::printf("  %s: range %.3g, speed %.3g, %zu reversals, moving %.2f, slow %.2f\n", m.name.c_str(), m.range,
                m.speed_max, m.reversals, m.moving_share, m.slow_share);
  }
  for (const auto& sentence : report.verdict) std::printf("  - %s\n", sentence.c_str());
  for (const auto& sentence : report.unfit_because) std::printf("  ! %s\n", sentence.c_str());
  return report;
}

// Counts, delays and rates that the provenance states.
TEST(RealLogsTest, InspectFindsWhatTheProvenanceStates) {
  const std::string folder = DataFolder();
  if (!std::filesystem::exists(folder)) GTEST_SKIP() << "no folder " << folder;
  const InspectReport qube = InspectReal(
      folder + "/qube_simurlacra/qube/qq_chrip_10to0Hz_+1.5V_250Hz_10s/rollout_real_2021-04-14_18-52-33.csv",
      {{"u_applied", "V", ChannelRole::kCommand},
       {"theta", "rad", ChannelRole::kMeasured},
       {"alpha", "rad", ChannelRole::kMeasured}});
  EXPECT_TRUE(qube.fit);
  EXPECT_NEAR(qube.channels[1].quantisation_step, 2 * 3.14159265 / 2048, 1e-5);
  EXPECT_NEAR(qube.channels[2].quantisation_step, 2 * 3.14159265 / 2048, 1e-5);
  EXPECT_LT(qube.excitation[0].bandwidth_95_hz, 12);

  const InspectReport servo = InspectReal(folder + "/xl330_pendulum/raw/2026-01-15_10h28m10.json",
                                          {{"goal_position", "rad", ChannelRole::kCommand},
                                           {"position", "rad", ChannelRole::kMeasured},
                                           {"speed", "rad/s", ChannelRole::kMeasured}});
  EXPECT_NEAR(servo.channels[1].quantisation_step, 2 * 3.14159265 / 4096, 1e-6);
  EXPECT_NEAR(servo.channels[2].quantisation_step, 0.229 * 2 * 3.14159265 / 60, 1e-5);
  EXPECT_GT(servo.delays[0].correlation, 0.5);

  const InspectReport motor =
      InspectReal(folder + "/qube_koopman/controller_20230828/qube_20230828T150709_610_277_801.csv",
                  {{"plant_input", "V", ChannelRole::kCommand},
                   {"theta", "rad", ChannelRole::kMeasured},
                   {"alpha", "rad", ChannelRole::kMeasured}});
  EXPECT_NEAR(motor.channels[1].quantisation_step, 2 * 3.14159265 / 2048, 1e-6);
  const InspectReport link =
      InspectReal(folder + "/flexlink_2dsfl/lqr_full_10deg.csv", {{"u1_cmd_A", "A", ChannelRole::kCommand},
                                                                  {"theta11", "rad", ChannelRole::kMeasured},
                                                                  {"theta12", "rad", ChannelRole::kMeasured}});
  EXPECT_NEAR(link.channels[1].quantisation_step, 1.534e-5, 1e-7);
}

}  // namespace
}  // namespace gapscope
