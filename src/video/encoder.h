// Frames become a file through ffmpeg, a child process fed on a pipe. The file appears under its name only when it is
// whole.
#ifndef GAPSCOPE_VIDEO_ENCODER_H_
#define GAPSCOPE_VIDEO_ENCODER_H_

#include <memory>
#include <string>

#include "replay/scene.h"

namespace gapscope {

enum class VideoFormat { kMp4, kGif };

class Encoder {
 public:
  // Starts ffmpeg, writing to a temporary name beside `path`. `width` and `height` even. Errors: ffmpeg cannot be
  // started, the folder cannot be written.
  static Result<std::unique_ptr<Encoder>> Start(const std::string& path, VideoFormat format, int width, int height,
                                                double frames_per_s);
  // Without Finish() the child is ended and the temporary file removed.
  ~Encoder();
  Encoder(const Encoder&) = delete;
  Encoder& operator=(const Encoder&) = delete;

  // Error: ffmpeg has ended early, with its own words (a full disk, say).
  Status Write(const Picture& frame);
  // Closes the pipe, waits, and gives the file its name.
  Status Finish();

 private:
  Encoder() = default;
  Error Failed();
  void End();

  std::string path_, temporary_, messages_path_;
  int pipe_ = -1;
  int child_ = -1;
};

}  // namespace gapscope

#endif  // GAPSCOPE_VIDEO_ENCODER_H_
