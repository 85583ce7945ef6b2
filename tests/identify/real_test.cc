// Methods on real logs (../shared/data), against what their sources say. Skipped where the logs are not.
#include <algorithm>

#include "tests/identify/bench.h"

namespace gapscope {
namespace {

using testing::Bench;
using testing::LoadBench;

const std::string kData = GAPSCOPE_SHARED_DATA;

// Files of a folder whose text has `word`, in the order of their names.
std::vector<std::string> Logs(const std::string& folder, const std::string& word, const std::string& extension) {
  std::vector<std::string> files;
  if (!std::filesystem::exists(folder)) return files;
  for (const auto& entry : std::filesystem::recursive_directory_iterator(folder)) {
    if (entry.path().extension() != extension) continue;
    std::ifstream in(entry.path());
    std::string text((std::istreambuf_iterator<char>(in)), {});
    if (word.empty() || text.find(word) != std::string::npos || entry.path().string().find(word) != std::string::npos)
      files.push_back(entry.path());
  }
  std::sort(files.begin(), files.end());
  return files;
}

#define NEEDS(files) \
  if ((files).empty()) GTEST_SKIP() << "no real logs at " << kData

// The servo is let go: gravity swings it down. Published fit (m1): dry friction 0.007 N m, viscous 0.0105 N m s/rad,
// for the motor driven as well as let go.
TEST(RealRingDownTest, Xl330LetGo) {
  const auto files = Logs(kData + "/xl330_pendulum/raw", "lift_and_drop", ".json");
  NEEDS(files);
  for (const auto& file : files) {
    const Bench bench = LoadBench("xl330", {file});
    const auto result = IdentifyRingDown(bench.input(), {});
    ASSERT_TRUE(result.ok()) << file << ": " << result.error().Text();
    EXPECT_GT(result.value().r2, 0.98) << file;
    // A point mass at 0.1 m with the published armature 0.001643: sqrt(m g l / (m l^2 + armature)).
    const double expected = std::sqrt(0.49 * 9.81 * 0.1 / (0.49 * 0.01 + 0.001643)) / (2 * M_PI);
    EXPECT_NEAR(result.value().Find("frequency")->value, expected, 0.1 * expected) << file;
    // Same order as the published fit; load-dependent friction shows as either.
    EXPECT_GT(result.value().Find("coulomb")->value, 0.003) << file;
    EXPECT_LT(result.value().Find("coulomb")->value, 0.021) << file;
    EXPECT_GT(result.value().Find("viscous")->value, 0.003) << file;
    EXPECT_LT(result.value().Find("viscous")->value, 0.032) << file;
  }
}

TEST(RealRingDownTest, Sts3032LetGo) {
  const auto files = Logs(kData + "/sts3032_pendulum/data_raw", "lift_and_drop", ".json");
  NEEDS(files);
  std::size_t fitted = 0, well = 0;
  for (const auto& file : files) {
    const Bench bench = LoadBench("sts3032", {file});
    const auto result = IdentifyRingDown(bench.input(), {});
    if (!result.ok()) {
      // The lightest rig hardly swings past rest.
      EXPECT_NE(result.error().what.find("does not swing"), std::string::npos) << file << result.error().Text();
      continue;
    }
    ++fitted;
    well += result.value().r2 > 0.95 ? 1 : 0;
    // PROVENANCE.md: rigs hang 0.09 to 0.18 rad off zero.
    EXPECT_GT(result.value().Find("rest")->value, 0.0) << file;
    EXPECT_LT(result.value().Find("rest")->value, 0.3) << file;
  }
  EXPECT_GE(fitted, files.size() / 2);
  EXPECT_GE(well, fitted / 2);
}

// Duty = kp 4096 / (2 pi) / (divisor 885) (goal - q); PROVENANCE.md found a divisor of 256 to 266 and a lag within a
// few ms.
TEST(RealPdTest, Xl330DutyLaw) {
  std::vector<std::string> files;
  for (const auto& file : Logs(kData + "/xl330_pendulum/raw", "sin_sin", ".json")) files.push_back(file);
  NEEDS(files);
  for (const auto& file : files) {
    const Bench bench = LoadBench("xl330", {file}, "duty.yaml");
    const auto result = IdentifyPd(bench.input(), {});
    ASSERT_TRUE(result.ok()) << file << ": " << result.error().Text();
    const double divisor =
        bench.recordings.front().values.at("log.kp") * 4096 / (2 * M_PI) / 885 / result.value().Find("kp")->value;
    EXPECT_GT(divisor, 245) << file;
    EXPECT_LT(divisor, 275) << file;
    EXPECT_GT(result.value().Find("r2_without_delay")->value, 0.97) << file;
  }
}

// PROVENANCE.md: ring frequency 1.81 to 1.88 Hz in the second half of the step logs, not the model's 2.69 Hz.
TEST(RealResonanceTest, FlexibleLinkRingsAt1_8Hz) {
  const auto files = Logs(kData + "/flexlink_2dsfl/lqr_steps", "lqr_step_", ".csv");
  NEEDS(files);
  for (const auto& file : files) {
    if (file.find("0deg_run01") != std::string::npos && file.find("10deg") == std::string::npos &&
        file.find("30deg") == std::string::npos && file.find("20deg") == std::string::npos)
      continue;  // at rest
    const Bench bench = LoadBench("flexlink_2dsfl", {file});
    const auto result = IdentifyResonance(bench.input(), {.from_s = 2});
    ASSERT_TRUE(result.ok()) << file << ": " << result.error().Text();
    EXPECT_GT(result.value().Find("peak_frequency")->value, 1.75) << file;
    EXPECT_LT(result.value().Find("peak_frequency")->value, 1.95) << file;
  }
}

// The open-loop chirps: a fit by simulation (PROVENANCE.md) has a spring of 1.22e-3 N m/rad about -0.50 rad on the arm.
TEST(RealCableTest, QubeChirpsShowTheCable) {
  const auto files = Logs(kData + "/qube_simurlacra/qube", "qq_chrip", ".csv");
  NEEDS(files);
  Bench bench = LoadBench("qube_simurlacra", files);
  // Rods about their ends instead of the source's formulas.
  bench.values[bench.model->Find("arm.inertia", "").value()] = 2.288e-4;
  bench.values[bench.model->Find("pendulum.transverse", "").value()] = 1;
  const auto result = IdentifyCable(bench.input(), {.free_inertia = true});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_GT(result.value().Find("stiffness")->low, 0);
  // A chirp is no slow sweep: the spring's torque is a few percent of the inertial torques here, and half of it is the
  // most that can be asked.
  EXPECT_GT(result.value().Find("stiffness")->value, 0.6e-3);
  EXPECT_LT(result.value().Find("stiffness")->value, 2.5e-3);
  EXPECT_NEAR(result.value().Find("rest")->value, -0.5, 0.06);
}

// Upright and balancing: the arm's dry friction is what makes it walk to and fro. The same rig type's chirps gave 6e-4
// N m.
TEST(RealFrictionTest, BalancingQubeHasDryFriction) {
  const auto files = Logs(kData + "/qube_koopman", "qube_2023", ".csv");
  NEEDS(files);
  const Bench bench = LoadBench("qube_koopman", files);
  const auto result = IdentifyFriction(bench.input(), {});
  ASSERT_TRUE(result.ok()) << result.error().Text();
  EXPECT_GT(result.value().Find("coulomb")->low, 1e-4);
  EXPECT_LT(result.value().Find("coulomb")->high, 1.2e-3);
}

}  // namespace
}  // namespace gapscope
