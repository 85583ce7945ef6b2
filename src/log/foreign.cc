#include "src/log/foreign.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cerrno>
#include <cstdlib>
#include <cstring>
#include <filesystem>
#include <sstream>

#include "src/core/child.h"
#include "src/core/file.h"
#include "src/log/npz_reader.h"
#include "src/log/npz_writer.h"

namespace gapscope {
namespace {

namespace fs = std::filesystem;

const ForeignFormat kMat{"MAT file"}, kHdf5{"HDF5 file"}, kArrow{"Parquet or Feather file"}, kRos{"ROS bag"},
    kMcap{"MCAP file"}, kLerobot{"LeRobot dataset"}, kPace{"PACE recording"};

constexpr int kRefused = 2;  // the converter's status for what it refuses, then five lines on stdout

Error RefusedBy(const std::string& said, const std::string& path) {
  std::istringstream lines(said);
  std::array<std::string, 5> fields;
  for (std::string& field : fields) std::getline(lines, field);
  return {.what = fields[0].empty() ? "the converter refuses the log" : fields[0],
          .where = fields[1].empty() ? path : fields[1],
          .actual = fields[2],
          .allowed = fields[3],
          .cure = fields[4]};
}

// A run of the converter: its words, the user's file that it is about, and what it is needed for.
struct Conversion {
  std::vector<std::string> words;
  std::string path, needed;
};

Status Convert(const Conversion& conversion, const std::string& said) {
  std::vector<std::string> words = {ConverterProgram()};
  words.insert(words.end(), conversion.words.begin(), conversion.words.end());
  const int status = RunChild(words, said);
  if (status == -ENOENT || status == -EACCES || status == 127) {
    return Error{.what = conversion.needed,
                 .where = conversion.path,
                 .actual = "no program " + words[0],
                 .cure = kInstallConverter};
  }
  if (status == kRefused) {
    GS_ASSIGN(const std::string refusal, ReadFile(said));
    return RefusedBy(refusal, conversion.path);
  }
  if (status < 0)
    return Error{.what = "a file on which the library of its format crashes",
                 .where = conversion.path,
                 .actual = "the converter was killed",
                 .cure = "record it again"};
  if (status != 0)
    return Error{
        .what = "the converter failed", .where = conversion.path, .actual = fmt::format("{}: {}", words[0], status)};
  return Ok();
}

std::string Needed(const ForeignFormat& format) {
  return "the log is a " + format.name + ", which the Python package reads";
}

Error NoRoom(const std::string& path) {
  return {.what = "no room to convert the log", .where = path, .actual = std::strerror(errno), .cure = "$TMPDIR"};
}

}  // namespace

std::string WithoutEpisodes(const std::string& path) {
  std::error_code failed;
  const std::size_t mark = path.rfind('#');
  return mark == std::string::npos || fs::exists(path, failed) ? path : path.substr(0, mark);
}

std::string ConverterProgram() {
  if (const char* given = std::getenv("GAPSCOPE_CONVERT"); given && *given) return given;
  std::error_code failed;
  const fs::path beside = fs::read_symlink("/proc/self/exe", failed).parent_path() / "gapscope-convert";
  return !failed && fs::exists(beside, failed) ? beside.string() : "gapscope-convert";
}

const ForeignFormat* ForeignFormatOf(const std::string& path) {
  const fs::path place(WithoutEpisodes(path));
  std::error_code failed;
  if (!fs::exists(place, failed)) return nullptr;
  if (fs::is_directory(place, failed)) {
    if (fs::exists(place / "meta" / "info.json", failed)) return &kLerobot;
    return fs::exists(place / "metadata.yaml", failed) ? &kRos : nullptr;
  }
  std::string suffix = place.extension().string();
  std::transform(suffix.begin(), suffix.end(), suffix.begin(), [](unsigned char c) { return std::tolower(c); });
  const auto is = [&](auto... names) { return ((suffix == names) || ...); };
  if (is(".mat")) return &kMat;
  if (is(".h5", ".hdf5", ".hdf")) return &kHdf5;
  if (is(".parquet", ".pq", ".feather", ".arrow")) return &kArrow;
  if (is(".mcap")) return &kMcap;
  if (is(".pt", ".pth")) return &kPace;
  return is(".bag", ".db3") ? &kRos : nullptr;
}

Result<std::vector<std::string>> LogsNamed(const std::string& path) {
  const ForeignFormat* format = ForeignFormatOf(path);
  if (format != &kLerobot) return std::vector{path};
  const std::string asked = path.substr(WithoutEpisodes(path).size());
  if (!asked.empty() && asked.find(':') == std::string::npos) return std::vector{path};
  const ScratchFolder scratch;
  if (!scratch.made()) return NoRoom(path);
  GS_RETURN_IF_ERROR(
      Convert({.words = {"--episodes", "--", path}, .path = path, .needed = Needed(*format)}, scratch.Path("said")));
  GS_ASSIGN(const std::string said, ReadFile(scratch.Path("said")));
  std::istringstream lines(said);
  std::vector<std::string> logs;
  for (std::string line; std::getline(lines, line);) logs.push_back(WithoutEpisodes(path) + "#" + line);
  return logs;
}

Result<Log> ReadForeign(const std::string& path, const ForeignFormat& format, const std::string& source) {
  const ScratchFolder scratch;
  if (!scratch.made()) return NoRoom(path);
  const std::string table = scratch.Path("table.npz");
  Conversion conversion{.words = {"--out", table}, .path = path, .needed = Needed(format)};
  if (!source.empty()) conversion.words.insert(conversion.words.end(), {"--options", source});
  conversion.words.insert(conversion.words.end(), {"--", path});
  GS_RETURN_IF_ERROR(Convert(conversion, scratch.Path("said")));
  GS_ASSIGN(const std::string bytes, ReadFile(table));
  GS_ASSIGN(Log log, ReadNpz(path, bytes));
  log.format = format.name;
  return log;
}

Status WriteMcap(const std::string& path, const Log& log) {
  const ScratchFolder scratch;
  if (!scratch.made()) return NoRoom(path);
  const std::string table = scratch.Path("table.npz");
  GS_RETURN_IF_ERROR(WriteNpz(table, log));
  return Convert({.words = {"--out", path, "--to", "mcap", "--", table},
                  .path = path,
                  .needed = "MCAP files are written by the Python package"},
                 scratch.Path("said"));
}

}  // namespace gapscope
