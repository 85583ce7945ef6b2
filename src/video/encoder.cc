#include "src/video/encoder.h"

#include <fcntl.h>
#include <fmt/core.h>
#include <signal.h>
#include <spawn.h>
#include <sys/wait.h>
#include <unistd.h>

#include <cerrno>
#include <cstring>
#include <filesystem>
#include <vector>

#include "src/core/file.h"

extern char** environ;

namespace gapscope {
namespace {

constexpr const char* kInstall = "install ffmpeg (on Debian: apt-get install ffmpeg), or write a .png";

std::vector<std::string> Arguments(VideoFormat format, int width, int height, double frames_per_s,
                                   const std::string& output) {
  std::vector<std::string> arguments = {"ffmpeg",   "-hide_banner",
                                        "-nostdin", "-loglevel",
                                        "error",    "-y",
                                        "-f",       "rawvideo",
                                        "-pix_fmt", "bgr0",
                                        "-s",       fmt::format("{}x{}", width, height),
                                        "-r",       fmt::format("{}", frames_per_s),
                                        "-i",       "pipe:0",
                                        "-an"};
  const auto add = [&](std::initializer_list<const char*> more) {
    arguments.insert(arguments.end(), more.begin(), more.end());
  };
  if (format == VideoFormat::kMp4) {
    add({"-c:v", "libx264", "-preset", "veryfast", "-crf", "20", "-pix_fmt", "yuv420p", "-movflags", "+faststart", "-f",
         "mp4"});
  } else {
    add({"-filter_complex",
         "split[a][b];[a]palettegen=stats_mode=diff[p];[b][p]paletteuse=dither=bayer:bayer_scale=4:diff_mode=rectangle",
         "-f", "gif"});
  }
  arguments.push_back(output);
  return arguments;
}

}  // namespace

Result<std::unique_ptr<Encoder>> Encoder::Start(const std::string& path, VideoFormat format, int width, int height,
                                                double frames_per_s) {
  GS_CHECK(width % 2 == 0 && height % 2 == 0 && frames_per_s > 0);
  std::unique_ptr<Encoder> made(new Encoder);
  made->path_ = path;
  GS_ASSIGN(made->temporary_, TemporaryBeside(path));
  // What ffmpeg says goes to a file: a second pipe could fill up while we write into the first.
  GS_ASSIGN(made->messages_path_,
            TemporaryBeside((std::filesystem::temp_directory_path() / "gapscope-ffmpeg").string()));
  int ends[2];
  if (pipe2(ends, O_CLOEXEC) != 0) return Error{.what = "cannot make a pipe to ffmpeg", .actual = std::strerror(errno)};
  std::vector<std::string> arguments = Arguments(format, width, height, frames_per_s, "file:" + made->temporary_);
  std::vector<char*> argv;
  argv.reserve(arguments.size() + 1);
  for (auto& argument : arguments) argv.push_back(argument.data());
  argv.push_back(nullptr);
  posix_spawn_file_actions_t actions;
  posix_spawn_file_actions_init(&actions);
  posix_spawn_file_actions_adddup2(&actions, ends[0], 0);
  posix_spawn_file_actions_addopen(&actions, 1, "/dev/null", O_WRONLY, 0);
  posix_spawn_file_actions_addopen(&actions, 2, made->messages_path_.c_str(), O_WRONLY | O_TRUNC, 0600);
  // A group of its own: Ctrl-C in the terminal is for us, who then end it. Signals that we ignore it must not.
  posix_spawnattr_t attributes;
  posix_spawnattr_init(&attributes);
  sigset_t defaults;
  sigemptyset(&defaults);
  sigaddset(&defaults, SIGPIPE);
  posix_spawnattr_setsigdefault(&attributes, &defaults);
  posix_spawnattr_setpgroup(&attributes, 0);
  posix_spawnattr_setflags(&attributes, POSIX_SPAWN_SETPGROUP | POSIX_SPAWN_SETSIGDEF);
  const int failure = posix_spawnp(&made->child_, "ffmpeg", &actions, &attributes, argv.data(), environ);
  posix_spawn_file_actions_destroy(&actions);
  posix_spawnattr_destroy(&attributes);
  close(ends[0]);
  made->pipe_ = ends[1];
  if (failure != 0) {
    made->child_ = -1;
    return Error{.what = "cannot start ffmpeg", .where = path, .actual = std::strerror(failure), .cure = kInstall};
  }
  signal(SIGPIPE, SIG_IGN);  // an early end of ffmpeg is an error of write()
  return made;
}

void Encoder::End() {
  if (pipe_ >= 0) close(pipe_);
  pipe_ = -1;
  if (child_ > 0) {
    kill(child_, SIGKILL);
    while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
    }
  }
  child_ = -1;
}

Encoder::~Encoder() {
  End();
  if (!temporary_.empty()) unlink(temporary_.c_str());
  if (!messages_path_.empty()) unlink(messages_path_.c_str());
}

Error Encoder::Failed() {
  End();
  std::string said = ReadFile(messages_path_).ok() ? ReadFile(messages_path_).value() : "";
  // The first line is the cause, the rest its consequences; "[mp4 @ 0x55...] " is of no use to anyone.
  said = said.substr(0, said.find('\n'));
  if (said.starts_with('[') && said.find("] ") != std::string::npos) said = said.substr(said.find("] ") + 2);
  return Error{.what = "ffmpeg could not write the video",
               .where = path_,
               .actual = said.empty() ? "it ended without a word" : said,
               .cure = "check the space on the disk and ffmpeg's libx264"};
}

Status Encoder::Write(const Picture& frame) {
  const char* bytes = reinterpret_cast<const char*>(frame.pixels.data());
  std::size_t left = 4 * frame.pixels.size();
  while (left > 0) {
    const ssize_t put = write(pipe_, bytes, left);
    if (put < 0 && errno == EINTR) continue;
    if (put <= 0) {
      // Let it finish saying why.
      close(pipe_);
      pipe_ = -1;
      while (waitpid(child_, nullptr, 0) < 0 && errno == EINTR) {
      }
      child_ = -1;
      return Failed();
    }
    bytes += put;
    left -= static_cast<std::size_t>(put);
  }
  return Ok();
}

Status Encoder::Finish() {
  close(pipe_);
  pipe_ = -1;
  int status = 0;
  while (waitpid(child_, &status, 0) < 0 && errno == EINTR) {
  }
  child_ = -1;
  // ffmpeg may end well although a write failed: whatever it said at this log level is an error.
  std::error_code failure;
  const bool said = std::filesystem::file_size(messages_path_, failure) > 0;
  const bool empty = std::filesystem::file_size(temporary_, failure) == 0;
  if (!WIFEXITED(status) || WEXITSTATUS(status) != 0 || said || empty) return Failed();
  if (rename(temporary_.c_str(), path_.c_str()) != 0)
    return Error{
        .what = "cannot rename the finished video to its place", .where = path_, .actual = std::strerror(errno)};
  temporary_.clear();
  return Ok();
}

}  // namespace gapscope
