// Frames off-screen: what is drawn where, in pixels.
#include "replay/scene.h"

#include <fmt/core.h>
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "replay/gl_context.h"
#include "replay/poses.h"
#include "replay/thin_meshes.h"
#include "src/experiment/recording.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

constexpr int kWidth = 480, kHeight = 300;
constexpr std::array<float, 3> kBlue = {0, 0.5f, 0.9f};

// Largest difference of a colour channel.
int Difference(std::uint32_t a, std::uint32_t b) {
  int most = 0;
  for (int shift = 0; shift < 24; shift += 8)
    most = std::max(most, std::abs(static_cast<int>(a >> shift & 255) - static_cast<int>(b >> shift & 255)));
  return most;
}
std::size_t PixelsThatDiffer(const Picture& a, const Picture& b, int more_than) {
  std::size_t count = 0;
  for (std::size_t i = 0; i < a.pixels.size(); ++i) count += Difference(a.pixels[i], b.pixels[i]) > more_than ? 1 : 0;
  return count;
}

class SceneTest : public ::testing::Test {
 protected:
  void SetUp() override {
    const auto opened = OpenGl(GlBackend::kAuto, 2, nullptr);
    ASSERT_TRUE(opened.ok()) << opened.error().Text();
    auto context = GlContext::Make();
    ASSERT_TRUE(context.ok()) << context.error().Text();
    context_ = std::move(context).value();
    model_ = MakeModel(ShippedExperiment("qube"));
    auto drawn = model_->CompileForDrawing(model_->Nominal(), {});
    ASSERT_TRUE(drawn.ok()) << drawn.error().Text();
    drawn_ = std::move(drawn).value();
    track_ = {.time_s = {0, 1}, .qpos = {-0.8, -0.6, 0.8, 0.9}};
  }
  std::unique_ptr<Scene> Make(View view, Redraw redraw = Redraw::kWhatMoves) {
    const PoseTrack* tracks[] = {&track_};
    auto made = Scene::Make(*drawn_, FrameMotion(*drawn_, tracks, view, static_cast<double>(kWidth) / kHeight), kWidth,
                            kHeight, redraw);
    EXPECT_TRUE(made.ok());
    return std::move(made).value();
  }
  Picture Draw(Scene& scene, const std::vector<double>& solid, const std::vector<double>* ghost = nullptr) {
    std::vector<Mechanism> mechanisms = {{.model = drawn_.get(), .qpos = solid}};
    if (ghost) mechanisms.push_back({.model = drawn_.get(), .qpos = *ghost, .look = Look::kGhost, .ghost_rgb = kBlue});
    Picture picture;
    const Status drawn = scene.Draw(mechanisms, picture);
    EXPECT_TRUE(drawn.ok());
    return picture;
  }
  std::unique_ptr<GlContext> context_;
  std::shared_ptr<const Model> model_;
  ModelPtr drawn_;
  PoseTrack track_;
};

TEST_F(SceneTest, EqualMotionsAreOnePictureBitByBit) {
  const auto scene = Make(View::kFixed);
  for (const double angle : {-0.7, 0.0, 0.4}) {
    const std::vector<double> pose = {angle, -2 * angle};
    EXPECT_EQ(Draw(*scene, pose, &pose).pixels, Draw(*scene, pose).pixels) << angle;
  }
}

TEST_F(SceneTest, AGhostIsSeenWhereItStands) {
  const auto scene = Make(View::kFixed);
  const std::vector<double> solid = {-0.6, 0}, near = {-0.6, 0.002}, far = {0.6, 0};
  const Picture alone = Draw(*scene, solid);
  const std::size_t a_little = PixelsThatDiffer(alone, Draw(*scene, solid, &near), 40),
                    a_lot = PixelsThatDiffer(alone, Draw(*scene, solid, &far), 40);
  EXPECT_GT(a_lot, 2000u);
  EXPECT_LT(a_little, a_lot / 10);
  // It is the colour asked for: blue grows against red.
  const Picture both = Draw(*scene, solid, &far);
  double blue = 0, red = 0;
  for (std::size_t i = 0; i < both.pixels.size(); ++i) {
    if (Difference(both.pixels[i], alone.pixels[i]) <= 8) continue;
    blue += static_cast<double>(both.pixels[i] & 255) - static_cast<double>(alone.pixels[i] & 255);
    red += static_cast<double>(both.pixels[i] >> 16 & 255) - static_cast<double>(alone.pixels[i] >> 16 & 255);
  }
  EXPECT_GT(blue, red);
}

TEST_F(SceneTest, WhatStandsStillNeedsNotBeDrawnAgain) {
  for (const View view : {View::kFixed, View::kTop}) {
    const auto parts = Make(view), whole = Make(view, Redraw::kAll);
    for (const double angle : {-0.7, 0.1, 0.8}) {
      const std::vector<double> solid = {angle, 0.5}, ghost = {-angle, -0.3};
      const Picture a = Draw(*parts, solid, &ghost), b = Draw(*whole, solid, &ghost);
      // Rounding moves an edge here and there; a part that is left out or misplaced would show in thousands of pixels.
      EXPECT_LT(PixelsThatDiffer(a, b, 12), a.pixels.size() / 400) << angle;
    }
  }
}

TEST_F(SceneTest, TheMotionFillsThePicture) {
  // Every pose of the track lies inside, and the outermost ones reach most of the way in one direction.
  const auto scene = Make(View::kFixed);
  const Picture nothing = [&] {
    std::vector<double> pose = {0, 0};
    return Draw(*scene, pose);
  }();
  int left = kWidth, right = 0, top = kHeight, bottom = 0;
  for (const auto& pose : {std::vector<double>{-0.8, -0.6}, {0.8, 0.9}, {0.0, 0.15}}) {
    const Picture picture = Draw(*scene, {0, 0}, &pose);
    for (int y = 0; y < kHeight; ++y) {
      for (int x = 0; x < kWidth; ++x) {
        const std::size_t i = static_cast<std::size_t>(y * kWidth + x);
        if (Difference(picture.pixels[i], nothing.pixels[i]) <= 8) continue;
        left = std::min(left, x), right = std::max(right, x), top = std::min(top, y), bottom = std::max(bottom, y);
      }
    }
  }
  EXPECT_GT(std::min({left, kWidth - 1 - right, top, kHeight - 1 - bottom}), 3);
  EXPECT_GT(std::max((right - left) / static_cast<double>(kWidth), (bottom - top) / static_cast<double>(kHeight)), 0.5);
}

// A ball of 2 * `rings`^2 triangles and more as a mesh, in an MJCF without sky or camera.
ModelPtr MeshedBall(int rings) {
  std::string points, faces;
  for (int i = 0; i <= rings; ++i) {
    for (int j = 0; j <= 2 * rings; ++j) {
      const double polar = M_PI * i / rings, around = M_PI * j / rings;
      points += fmt::format("{:.5f} {:.5f} {:.5f} ", 0.1 * std::sin(polar) * std::cos(around),
                            0.1 * std::sin(polar) * std::sin(around), 0.1 * std::cos(polar));
      const int a = i * (2 * rings + 1) + j, b = a + 2 * rings + 1;
      if (i < rings && j < 2 * rings) faces += fmt::format("{} {} {} {} {} {} ", a, b, b + 1, a, b + 1, a + 1);
    }
  }
  const Scratch scratch;
  const Experiment experiment = MakeExperiment(
      scratch,
      "<mujoco><asset><mesh name='ball' vertex='" + points + "' face='" + faces +
          "'/></asset><worldbody><body><joint name='hinge' axis='0 1 0'/><inertial pos='0 0 -0.1' mass='1' "
          "diaginertia='0.01 0.01 0.01'/><geom type='mesh' mesh='ball' mass='0' rgba='0.2 0.2 0.2 1'/></body>"
          "</worldbody></mujoco>",
      "measured:\n  - {signal: hinge, column: a, joint: hinge, unit: rad}\n");
  const auto model = MakeModel(experiment);
  return model ? std::move(model->CompileForDrawing(model->Nominal(), {})).value() : nullptr;
}

TEST_F(SceneTest, AFineMeshIsDrawnWithFewerTrianglesAndLooksTheSame) {
  const ModelPtr coarse = MeshedBall(40);
  ASSERT_NE(coarse, nullptr);
  const std::size_t before = DrawnTriangles(*coarse);
  drawn_.reset(mj_copyModel(nullptr, coarse.get()));
  track_ = {.time_s = {0, 1}, .qpos = {0, 0.3}};
  const Picture as_it_is = Draw(*Make(View::kFixed), {0.1});
  ThinMeshes(drawn_.get(), 0.01);
  EXPECT_LT(DrawnTriangles(*drawn_), before / 2);
  EXPECT_GT(DrawnTriangles(*drawn_), 400u);
  const Picture thinned = Draw(*Make(View::kFixed), {0.1});
  // The silhouette stays; a hole or a triangle turned over would show sky within it.
  EXPECT_LT(PixelsThatDiffer(as_it_is, thinned, 100), as_it_is.pixels.size() / 100);
  std::size_t dark = 0;
  for (const std::uint32_t pixel : as_it_is.pixels) dark += (pixel & 255) < 150 ? 1 : 0;
  EXPECT_GT(dark, as_it_is.pixels.size() / 10) << "the ball fills a good part of the picture";
}

TEST_F(SceneTest, ARobotWithoutSkyStandsBeforeALightOne) {
  drawn_ = MeshedBall(10);
  ASSERT_NE(drawn_, nullptr);
  track_ = {.time_s = {0, 1}, .qpos = {0, 0.3}};
  const Picture picture = Draw(*Make(View::kFixed), {0});
  for (const std::size_t corner : {std::size_t{0}, picture.pixels.size() - 1})
    EXPECT_GT(picture.pixels[corner] & 255, 200u);
}

TEST_F(SceneTest, PosesAreTheLogsOwnAtItsStampsAndBetween) {
  const auto recording = LoadRecording(model_->experiment(), std::string(GAPSCOPE_SOURCE_DIR) + "/demo/qube.csv");
  ASSERT_TRUE(recording.ok());
  ThreadPool pool(1);
  const auto values = model_->Nominal();
  const LogReplay replay = Replay(*model_, {recording.value()}, {.keep_poses = true}, pool).logs.front();
  const PoseTrack predicted = PredictedPoses(*model_, values, recording.value(), replay),
                  measured = MeasuredPoses(*model_, values, recording.value(), predicted);
  std::vector<double> pose(2);
  for (const std::size_t row : {std::size_t{0}, std::size_t{777}, std::size_t{5000}}) {
    const double t = recording.value().time_s[row];
    ASSERT_TRUE(PoseAt(*drawn_, measured, t, pose));
    EXPECT_EQ(pose[0], recording.value().measured[0].values[row]);
    EXPECT_EQ(pose[1], recording.value().measured[1].values[row]);
    ASSERT_TRUE(PoseAt(*drawn_, predicted, t, pose));
    EXPECT_EQ(pose[0], replay.signals[0].predicted[row]);
    EXPECT_EQ(pose[1], replay.signals[1].predicted[row]);
  }
  const double a = measured.qpos[2 * 4000], b = measured.qpos[2 * 4001];
  ASSERT_TRUE(PoseAt(*drawn_, measured, recording.value().time_s[4000] + 0.0005, pose));
  EXPECT_NEAR(pose[0], a + 0.25 * (b - a), 1e-12);
  // The simulation's own poses are those that the signals are read from.
  EXPECT_EQ(replay.qpos[2 * 777], replay.signals[0].predicted[777]);
}

TEST_F(SceneTest, OneLibraryAProcess) {
  const auto open = OpenGl(GlBackend::kAuto, 1, nullptr);
  ASSERT_TRUE(open.ok());
  const auto other = OpenGl(open.value() == GlBackend::kOsmesa ? GlBackend::kEgl : GlBackend::kOsmesa, 1, nullptr);
  ASSERT_FALSE(other.ok());
  EXPECT_NE(other.error().Text().find("two OpenGL libraries"), std::string::npos);
}

}  // namespace
}  // namespace gapscope::testing
