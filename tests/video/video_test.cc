// The render command as a user runs it: files, frames, refusals. Frames are read back with ffmpeg and ffprobe.
#include "src/video/video.h"

#include <gtest/gtest.h>
#include <sys/wait.h>

#include <cmath>
#include <nlohmann/json.hpp>
#include <set>

#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

const std::string kSource = GAPSCOPE_SOURCE_DIR;
const std::string kQube = "'" + kSource + "/models/qube/experiment.yaml' '" + kSource + "/demo/qube.csv'";

class VideoTest : public ::testing::Test {
 protected:
  Answer Shell(const std::string& line) const { return scratch_.Shell(line); }
  std::string Render(const std::string& arguments) const {
    return std::string("'") + GAPSCOPE_PROGRAM + "' render " + kQube + " --size 480x360 " + arguments;
  }
  std::string Out(const std::string& name) const {
    std::filesystem::create_directories(scratch_.Path("out"));
    return scratch_.Path("out/" + name);
  }
  std::set<std::string> OutFiles() const {
    std::set<std::string> names;
    for (const auto& entry : std::filesystem::directory_iterator(scratch_.Path("out")))
      names.insert(entry.path().filename());
    return names;
  }
  nlohmann::json Probe(const std::string& file) {
    const Answer answer = Shell("ffprobe -v error -count_frames -show_streams -show_format -of json '" + file + "'");
    EXPECT_EQ(answer.status, 0) << answer.err;
    return nlohmann::json::parse(answer.out, nullptr, false);
  }
  // One frame as rgb24.
  std::string Pixels(const std::string& file, int frame) {
    EXPECT_EQ(Shell("ffmpeg -v error -y -i '" + file + "' -vf 'select=eq(n\\," + std::to_string(frame) +
                    ")' -frames:v 1 -f rawvideo -pix_fmt rgb24 '" + scratch_.Path("raw") + "'")
                  .status,
              0);
    return ReadAll(scratch_.Path("raw"));
  }
  static double MeanDifference(const std::string& a, const std::string& b) {
    EXPECT_EQ(a.size(), b.size());
    EXPECT_FALSE(a.empty());
    double sum = 0;
    for (std::size_t i = 0; i < std::min(a.size(), b.size()); ++i)
      sum += std::abs(static_cast<int>(static_cast<unsigned char>(a[i])) -
                      static_cast<int>(static_cast<unsigned char>(b[i])));
    return sum / static_cast<double>(a.size());
  }
  Scratch scratch_;
};

TEST(FrameTimesTest, StepsOfSpeedOverRate) {
  const auto times = FrameTimes({.out = "", .speed = 0.25, .from_s = 2, .to_s = 3, .frames_per_s = 25});
  ASSERT_EQ(times.size(), 101u);
  EXPECT_EQ(times.front(), 2);
  EXPECT_NEAR(times[50], 2.5, 1e-12);
  EXPECT_NEAR(times.back(), 3, 1e-12);
}

TEST_F(VideoTest, FramesRateDurationAndWhatIsInThem) {
  const std::string video = Out("v.mp4");
  const Answer made = Shell(Render("--from 8 --to 9 --speed 0.5 --fps 25 --out '" + video + "'"));
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("51 frames of 480x360"), std::string::npos) << made.out;
  EXPECT_EQ(OutFiles(), std::set<std::string>{"v.mp4"});
  const auto probe = Probe(video);
  const auto& stream = probe["streams"][0];
  EXPECT_EQ(stream["nb_read_frames"], "51");
  EXPECT_EQ(stream["r_frame_rate"], "25/1");
  EXPECT_EQ(stream["width"], 480);
  EXPECT_EQ(stream["height"], 360);
  EXPECT_EQ(stream["pix_fmt"], "yuv420p");
  EXPECT_NEAR(std::stod(probe["format"]["duration"].get<std::string>()), 51 / 25.0, 0.05);
  // Frame k shows the log at from + k speed / rate: it is the still of that time, and not that of the time of frame k
  // + 5.
  for (const int k : {7, 45}) {
    const double t = 8 + k * 0.5 / 25;
    const auto still = [&](double time) {
      const std::string png = Out("still.png");
      // The axis is the video's; only --at differs.
      EXPECT_EQ(
          Shell(Render("--from 8 --to 9 --speed 0.5 --at " + std::to_string(time) + " --out '" + png + "'")).status, 0);
      return Pixels(png, 0);
    };
    const std::string frame = Pixels(video, k);
    const double right = MeanDifference(frame, still(t)), wrong = MeanDifference(frame, still(t + 0.1));
    EXPECT_LT(right, 4) << k;  // levels of 255: what x264 loses
    EXPECT_GT(wrong, 1.3 * right) << k;
  }
}

TEST_F(VideoTest, LooksLikeThePictureInTheDocs) {
  // docs/pictures/render.png, made by scripts/pictures, which also says how: run it when the look is meant to change.
  const std::string result = scratch_.Path("repaired"), png = Out("now.png");
  ASSERT_EQ(Shell(std::string("'") + GAPSCOPE_PROGRAM + "' replay " + kQube +
                  " --with cable_spring@arm --with coulomb_friction@arm --set "
                  "cable_spring@arm.stiffness_n_m_per_rad=0.0012 --set cable_spring@arm.rest_rad=-0.4"
                  " --set coulomb_friction@arm.friction_n_m=0.0006 --out '" +
                  result + "'")
                .status,
            0);
  const Answer made = Shell(std::string("'") + GAPSCOPE_PROGRAM + "' render " + kQube +
                            " --compare nominal --compare '" + result + "' --at 8.7 --json --out '" + png + "'");
  ASSERT_EQ(made.status, 0) << made.err;
  const auto json = nlohmann::json::parse(made.out);
  EXPECT_EQ(json["models"][1]["label"], "repaired");
  EXPECT_LT(json["models"][1]["error"].get<double>(), 0.01);
  EXPECT_NEAR(json["first_s"].get<double>(), 8.7, 1e-12);
  // Levels of 255: another Mesa or font version moves edges, not parts.
  EXPECT_LT(MeanDifference(Pixels(png, 0), Pixels(kSource + "/docs/pictures/render.png", 0)), 1.5);
}

TEST_F(VideoTest, TheSameFramesForAnyNumberOfWorkers) {
  const std::string one = Out("1.png"), two = Out("2.png");
  ASSERT_EQ(Shell(Render("--at 9 --jobs 1 --out '" + one + "'")).status, 0);
  ASSERT_EQ(Shell(Render("--at 9 --jobs 3 --out '" + two + "'")).status, 0);
  EXPECT_EQ(ReadAll(one), ReadAll(two));
}

TEST_F(VideoTest, GifAndSeveralModelsAndViews) {
  const std::string result = scratch_.Path("r");
  ASSERT_EQ(Shell(std::string("'") + GAPSCOPE_PROGRAM + "' replay " + kQube +
                  " --with cable_spring@arm --set cable_spring@arm.stiffness_n_m_per_rad=0.0012 --out '" + result + "'")
                .status,
            0);
  const std::string gif = Out("v.gif");
  const Answer made = Shell(Render("--compare nominal --compare 'spring=" + result +
                                   "' --layout side --view top --from 9 --to 9.5 --fps 10 --out '" + gif + "'"));
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_NE(made.out.find("spring"), std::string::npos) << made.out;
  EXPECT_EQ(Probe(gif)["streams"][0]["nb_read_frames"], "6");
  // The result's model is what was replayed: same error.
  const auto json = nlohmann::json::parse(ReadAll(result + "/result.json"));
  char error[40];
  std::snprintf(error, sizeof error, "error %.4g", json["error"].get<double>());
  EXPECT_NE(made.out.find(error), std::string::npos) << made.out << error;
  EXPECT_EQ(Shell(Render("--view tracking --out '" + Out("t.png") + "'")).status, 0);
}

// The library or a driver without a screen is not installed: what the program says then. Any other failure is ours.
bool NoEglHere(const Answer& answer) {
  return answer.err.find("libEGL") != std::string::npos || answer.err.find("EGL has no display") != std::string::npos;
}

TEST_F(VideoTest, EglDrawsWhatOsmesaDraws) {
  const std::string osmesa = Out("o.png"), egl = Out("e.png");
  ASSERT_EQ(Shell(Render("--at 9 --gl osmesa --out '" + osmesa + "'")).status, 0);
  const Answer made = Shell(Render("--at 9 --gl egl --out '" + egl + "'"));
  if (made.status != 0 && NoEglHere(made)) GTEST_SKIP() << "no EGL without a screen here: " << made.err;
  ASSERT_EQ(made.status, 0) << made.err;
  EXPECT_LT(MeanDifference(Pixels(osmesa, 0), Pixels(egl, 0)), 0.5);
}

// Nothing is left under the name asked for, nor beside it.
#define EXPECT_REFUSED(line, says)                                     \
  do {                                                                 \
    Out("");                                                           \
    const Answer answer = Shell(line);                                 \
    EXPECT_EQ(answer.status, 2) << answer.err;                         \
    EXPECT_NE(answer.err.find(says), std::string::npos) << answer.err; \
    EXPECT_EQ(answer.err.find("internal error"), std::string::npos);   \
    EXPECT_TRUE(OutFiles().empty()) << *OutFiles().begin();            \
  } while (false)

TEST_F(VideoTest, RefusesWhatItCannotDraw) {
  const std::string out = "--out '" + Out("v.mp4") + "'";
  EXPECT_REFUSED(Render("--out '" + Out("v.avi") + "'"), "allowed: .mp4, .gif, .png");
  EXPECT_REFUSED(Render("--from 20 " + out), "--from and --to");
  EXPECT_REFUSED(Replaced(Render(out), "480x360", "641x480"), "both even");
  EXPECT_REFUSED(Render("--compare /nowhere " + out), "cannot open");
  EXPECT_REFUSED(Render("--compare '" + kSource + "/CMakePresets.json' " + out), "no 'model'");
  EXPECT_REFUSED(Render("--fps 0 " + out), "--fps");
  EXPECT_REFUSED(Render("--out /proc/v.mp4"), "cannot write");
}

TEST_F(VideoTest, WithoutFfmpegItSaysWhatToInstall) {
  EXPECT_REFUSED("PATH=/nowhere " + Render("--out '" + Out("v.mp4") + "'"), "apt-get install ffmpeg");
}

TEST_F(VideoTest, WithoutOpenGlItSaysWhatToInstall) {
  // Libraries that do not load stand in front of the real ones.
  for (const char* name : {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so", "libEGL.so.1", "libEGL.so"})
    scratch_.Write(std::string("gl/") + name, "not a library");
  EXPECT_REFUSED("LD_LIBRARY_PATH='" + scratch_.Path("gl") + "' " + Render("--out '" + Out("v.mp4") + "'"),
                 "apt-get install libosmesa6");
}

TEST_F(VideoTest, FallsBackToEglAndSaysSo) {
  for (const char* name : {"libOSMesa.so.8", "libOSMesa.so.6", "libOSMesa.so"})
    scratch_.Write(std::string("gl/") + name, "not a library");
  const Answer made = Shell(Render("--gl egl --out '" + Out("e.png") + "'"));
  if (made.status != 0 && NoEglHere(made)) GTEST_SKIP() << "no EGL without a screen here: " << made.err;
  ASSERT_EQ(made.status, 0) << made.err;
  const Answer answer =
      Shell("LD_LIBRARY_PATH='" + scratch_.Path("gl") + "' " + Render("--out '" + Out("f.png") + "'"));
  EXPECT_EQ(answer.status, 0) << answer.err;
  EXPECT_NE(answer.err.find("rendering with EGL"), std::string::npos) << answer.err;
}

TEST_F(VideoTest, AFullDiskLeavesNothing) {
  // No file may grow beyond 16 kB, as on a disk that fills up; ffmpeg's own words reach the user.
  EXPECT_REFUSED("trap '' XFSZ; ulimit -f 16; " + Render("--from 8 --out '" + Out("v.mp4") + "'"),
                 "ffmpeg could not write the video");
}

TEST_F(VideoTest, AnInterruptLeavesNothing) {
  // Interrupted once the temporary file is there, in the middle of the work.
  const std::string out = Out("v.mp4");
  EXPECT_REFUSED(
      Render("--speed 0.001 --out '" + out + "'") + " & child=$!; n=0; until ls '" + out +
          "'.* >/dev/null 2>&1 || [ $n -gt 600 ]; do sleep 0.1; n=$((n+1)); done; kill -TERM $child; wait $child",
      "interrupted");
}

}  // namespace
}  // namespace gapscope::testing
