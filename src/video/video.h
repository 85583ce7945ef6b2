// Measured against simulated mechanism as a video, a GIF or a still: replays drawn off-screen by several workers,
// composed and encoded in order.
#ifndef GAPSCOPE_VIDEO_VIDEO_H_
#define GAPSCOPE_VIDEO_VIDEO_H_

#include <atomic>
#include <functional>
#include <string>
#include <vector>

#include "replay/gl_context.h"
#include "replay/poses.h"
#include "src/core/thread_pool.h"
#include "src/video/page.h"

namespace gapscope {

// A model to compare with the log.
struct VideoModel {
  std::string label;
  std::shared_ptr<const Model> model;
  std::vector<double> values;
};

enum class Layout { kOverlay, kSide };
template <>
std::span<const EnumName<Layout>> EnumNames<Layout>();  // "overlay", "side"

struct VideoOptions {
  std::string out;  // .mp4, .gif or .png (a still)
  View view = View::kFixed;
  Layout layout = Layout::kOverlay;
  GlBackend gl = GlBackend::kAuto;
  ReplayMode mode = ReplayMode::kFreeRun;
  double window_s = 1;
  double speed = 1;                // seconds of the log per second of the video
  double from_s = 0, to_s = -1;    // of the log; to_s < 0: its end
  double at_s = -1;                // of a still; < 0: where the first model's error is greatest
  int width = 1280, height = 720;  // even
  double frames_per_s = 30;
  std::function<void(std::size_t done, std::size_t all)> progress;
  const std::atomic<bool>* stop = nullptr;  // set: give up
};

struct VideoSummary {
  std::size_t frames = 0;
  double first_s = 0, last_s = 0;  // log times of the first and last frame
  double length_s = 0;             // of the video
  double wall_s = 0;
  std::vector<double> errors;  // by model, normalised
  GlBackend gl = GlBackend::kAuto;
  std::string note;  // of OpenGl()
};

// Log times of the frames: from `from_s` in steps of speed / frames_per_s, the last one not after `to_s`.
std::vector<double> FrameTimes(const VideoOptions& options);

// Errors: no position is measured, the interval is empty, the extension of `out`, OpenGL, ffmpeg, the disk, `stop`. No
// half file is left.
Result<VideoSummary> RenderVideo(const Recording& recording, const std::vector<VideoModel>& models,
                                 const VideoOptions& options, ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_VIDEO_VIDEO_H_
