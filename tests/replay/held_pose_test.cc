// A body on `hold` whose pose the log measures stands where each log has it, beside an MJCF that has it there.
#include <gtest/gtest.h>

#include <Eigen/Geometry>
#include <cmath>
#include <numbers>

#include "src/experiment/recording.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

using Eigen::Quaterniond;
using Eigen::Vector3d;

constexpr double kSame = 1e-12, kHeldPeriod_s = 0.004;
constexpr int kHeldRows = 251;
// Of the sensors on the base.
const Vector3d kMarker(0.2, -0.1, 0.05);
const Quaterniond kMounted(Eigen::AngleAxisd(0.4, Vector3d(1, 2, -1).normalized()));

// Where a base stands.
struct Stand {
  Vector3d place = Vector3d::Zero();
  Quaterniond turn = Quaterniond::Identity();
};
const Stand kUpright = {.place = {0.3, 0, 1}};
const Stand kTilted = {.place = {-0.5, 0.2, 1.5},
                       .turn = Quaterniond(Eigen::AngleAxisd(20 * std::numbers::pi / 180, Vector3d::UnitY()))};

std::string Numbers(const std::vector<double>& numbers, const char* between) {
  std::string text;
  for (const double number : numbers) {
    char digits[40];
    std::snprintf(digits, sizeof digits, "%s%.17g", text.empty() ? "" : between, number);
    text += digits;
  }
  return text;
}

// A base with a pendulum about its y axis; `joint`: its free joint, or nothing.
std::string Robot(const Stand& stand, const std::string& joint) {
  const auto& [p, q] = stand;
  return R"(<mujoco><option timestep="0.002" integrator="RK4"><flag contact="disable"/></option>
  <compiler angle="radian"/>
  <worldbody>
    <body name="base" pos=")" +
         Numbers({p.x(), p.y(), p.z()}, " ") + "\" quat=\"" + Numbers({q.w(), q.x(), q.y(), q.z()}, " ") + "\">" +
         joint + R"(
      <inertial pos="0 0 0" mass="3" diaginertia="0.03 0.03 0.03"/>
      <body name="plate" pos="0.1 -0.1 0"><site name="marker" pos="0.1 0 0.05" quat=")" +
         Numbers({kMounted.w(), kMounted.x(), kMounted.y(), kMounted.z()}, " ") + R"("/>
        <inertial pos="0 0 0" mass="0.1" diaginertia="1e-4 1e-4 1e-4"/></body>
      <body name="rod"><joint name="swing" axis="0 1 0" damping="0.01"/>
        <inertial pos="0 0 -0.3" mass="0.5" diaginertia="0.004 0.004 0.0001"/></body>
    </body>
  </worldbody></mujoco>)";
}

constexpr char kSwing[] = R"(log: {time: {column: t, unit: s}}
measured:
  - {signal: swing, column: swing, joint: swing, unit: rad}
)";
const std::string kPlace =
                      "  - {signal: place, site: marker, columns_of_elements: [x, y, z], unit: mm, score: false}\n",
                  kTurn = "  - {signal: turn, site: marker, columns_of_elements: [qw, qx, qy, qz], score: false}\n",
                  kHold = "hold: [base]\n";

// What a camera has of a stand. The sign of its quaternion says nothing.
std::string Csv(const Stand& stand, bool moves = false) {
  std::string csv = "t,swing,x,y,z,qw,qx,qy,qz\n";
  for (int k = 0; k < kHeldRows; ++k) {
    const Vector3d p = 1000 * (stand.place + stand.turn * kMarker) + Vector3d(moves && k > 100 ? 500 : 0, 0, 0);
    const Quaterniond q = stand.turn * kMounted;
    csv += Numbers({k * kHeldPeriod_s, 0, p.x(), p.y(), p.z(), -q.w(), -q.x(), -q.y(), -q.z()}, ",") + "\n";
  }
  return csv;
}

class HeldPoseTest : public ::testing::Test {
 protected:
  // The swing of a log from rest, hanging along the base. All logs of a model go through one simulator.
  std::vector<std::vector<double>> Swings(const std::string& mjcf, const std::string& yaml,
                                          const std::vector<std::string>& logs) {
    const Experiment experiment = MakeExperiment(scratch_, mjcf, yaml);
    const auto model = MakeModel(experiment);
    if (!model) return {};
    std::vector<Recording> recordings;
    for (const std::string& csv : logs) {
      auto recording = LoadRecording(experiment, scratch_.Write("log.csv", csv));
      EXPECT_TRUE(recording.ok()) << recording.error().Text();
      recordings.push_back(std::move(recording).value());
    }
    ThreadPool pool(1);
    const ReplayResult result =
        Replay(*model, recordings, {.mode = ReplayMode::kFreeRun, .values = model->Nominal()}, pool);
    std::vector<std::vector<double>> swings;
    for (const LogReplay& log : result.logs) swings.push_back(log.signals.front().predicted);
    return swings;
  }
  std::vector<double> Swing(const Stand& stand) { return Swings(Robot(stand, ""), kSwing, {Csv(stand)}).at(0); }
  Scratch scratch_;
};

TEST_F(HeldPoseTest, StandsWhereEachLogHasIt) {
  const std::vector<std::string> logs = {Csv(kTilted), Csv(kUpright), Csv(kTilted)};
  const auto swings = Swings(Robot({}, "<freejoint/>"), kSwing + kPlace + kTurn + kHold, logs);
  ASSERT_EQ(swings.size(), 3u);
  const std::vector<double> tilted = Swing(kTilted), upright = Swing(kUpright);
  EXPECT_GT(Largest(tilted), 0.5) << "it swings";
  EXPECT_LT(Largest(upright), kSame) << "it hangs";
  EXPECT_LE(LargestDifference(swings[0], tilted), kSame);
  EXPECT_LE(LargestDifference(swings[1], upright), kSame);
  EXPECT_LE(LargestDifference(swings[2], tilted), kSame);
}

TEST_F(HeldPoseTest, ThePredictedPoseIsTheLogsOwn) {
  const Experiment experiment = MakeExperiment(scratch_, Robot({}, "<freejoint/>"), kSwing + kPlace + kTurn + kHold);
  const auto model = MakeModel(experiment);
  ASSERT_NE(model, nullptr);
  const auto recording = LoadRecording(experiment, scratch_.Write("log.csv", Csv(kTilted)));
  ASSERT_TRUE(recording.ok()) << recording.error().Text();
  const auto predicted = Predict(*model, recording.value());
  ASSERT_EQ(predicted.size(), 7u);
  for (std::size_t s = 1; s < 7; ++s)
    EXPECT_LE(LargestDifference(predicted[s], recording.value().measured[s].values), kSame) << s;
}

TEST_F(HeldPoseTest, ItIsTheFirstPoseThatCounts) {
  const auto swings =
      Swings(Robot({}, "<freejoint/>"), kSwing + kPlace + kTurn + kHold, {Csv(kTilted, /*moves=*/true)});
  ASSERT_EQ(swings.size(), 1u);
  EXPECT_LE(LargestDifference(swings[0], Swing(kTilted)), kSame);
}

TEST_F(HeldPoseTest, WhatIsNotMeasuredIsTheMjcfs) {
  // Its turn from the log, its place from the MJCF; and the other way round.
  const auto turned = Swings(Robot(kUpright, "<freejoint/>"), kSwing + kTurn + kHold, {Csv(kTilted)});
  const auto placed = Swings(Robot(kTilted, "<freejoint/>"), kSwing + kPlace + kHold, {Csv(kUpright)});
  const std::vector<double> tilted = Swing(kTilted);
  EXPECT_LE(LargestDifference(turned.at(0), tilted), kSame);
  EXPECT_LE(LargestDifference(placed.at(0), tilted), kSame);
  // A log may lack an optional pose, and the user may not want it.
  const std::string optional = Replaced(kTurn, "score: false", "score: false, optional: true");
  const std::string unasked = Replaced(kTurn, "score: false", "score: false, start: false");
  const auto without = Swings(Robot(kUpright, "<freejoint/>"), kSwing + optional + kHold,
                              {Csv(kTilted), Replaced(Csv(kTilted), "qw,qx,qy,qz", "a,b,c,d")});
  EXPECT_LE(LargestDifference(without.at(0), tilted), kSame);
  EXPECT_LE(Largest(without.at(1)), kSame);
  EXPECT_LE(Largest(Swings(Robot(kUpright, "<freejoint/>"), kSwing + unasked + kHold, {Csv(kTilted)}).at(0)), kSame);
}

}  // namespace
}  // namespace gapscope::testing
