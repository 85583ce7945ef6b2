#include "src/log/text.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <cstring>

namespace gapscope {
namespace {

struct Magic {
  std::string_view bytes;
  const char* name;
  const char* cure;
};

using namespace std::string_view_literals;

constexpr const char* kExport = "export the log as CSV";
constexpr std::array kMagics = {
    Magic{"\x1f\x8b"sv, "gzip data", "unpack it first: gunzip FILE"},
    Magic{"PK\x03\x04"sv, "a ZIP archive (XLSX, MLX ...)", kExport},
    Magic{"\x28\xb5\x2f\xfd"sv, "Zstandard data", "unpack it first: unzstd FILE"},
    Magic{"\xfd"
          "7zXZ"sv,
          "XZ data", "unpack it first: unxz FILE"},
    Magic{"BZh"sv, "bzip2 data", "unpack it first: bunzip2 FILE"},
    Magic{"MATLAB 5.0 MAT-file"sv, "a MATLAB MAT file", "export it as CSV: writetable(timetable2table(tt), 'log.csv')"},
    Magic{"MATLAB 7.3 MAT-file"sv, "a MATLAB MAT file", "export it as CSV: writetable(timetable2table(tt), 'log.csv')"},
    Magic{"\x89HDF\r\n"sv, "HDF5 data", kExport},
    Magic{"\x89MCAP"sv, "an MCAP recording", kExport},
    Magic{"#ROSBAG"sv, "a ROS 1 bag", "export a topic as CSV: rostopic echo -b FILE -p TOPIC > log.csv"},
    Magic{"SQLite format 3"sv, "an SQLite data base (ROS 2 db3?)", kExport},
    Magic{"PAR1"sv, "Parquet data", "export it as CSV: pandas.read_parquet(FILE).to_csv('log.csv', index=False)"},
    Magic{"\x93NUMPY"sv, "a NumPy array", "save it with names: numpy.savez('log.npz', t=a[:, 0], x=a[:, 1])"},
    Magic{"\x89PNG"sv, "a PNG picture", "name the log itself"},
    Magic{"%PDF"sv, "a PDF document", "name the log itself"},
    Magic{"\x7f"
          "ELF"sv,
          "a program", "name the log itself"},
};

Error Refused(std::string what, std::string where, std::string actual, std::string cure) {
  return Error{.what = std::move(what),
               .where = std::move(where),
               .actual = std::move(actual),
               .allowed = "text in ASCII or UTF-8",
               .cure = std::move(cure)};
}

// UTF-16 without a mark: every other byte of the first ones is zero.
bool LooksLikeUtf16(std::string_view bytes) {
  const std::size_t n = std::min<std::size_t>(bytes.size(), 64);
  if (n < 4) return false;
  std::array<std::size_t, 2> zeros{};
  for (std::size_t i = 0; i < n; ++i) zeros[i % 2] += bytes[i] == '\0';
  const std::size_t many = n / 2 - n / 8;
  return (zeros[0] >= many && zeros[1] == 0) || (zeros[1] >= many && zeros[0] == 0);
}

// Length of the valid UTF-8 sequence at `i` (1 to 4), or 0.
std::size_t Utf8Length(std::string_view text, std::size_t i) {
  const auto byte = [&](std::size_t k) { return static_cast<unsigned char>(text[k]); };
  const auto tail = [&](std::size_t k) { return k < text.size() && (byte(k) & 0xC0) == 0x80; };
  const unsigned char b = byte(i);
  if (b < 0x80) return 1;
  if (b >= 0xC2 && b <= 0xDF) return tail(i + 1) ? 2 : 0;
  if (b >= 0xE0 && b <= 0xEF) {
    if (!tail(i + 1) || !tail(i + 2)) return 0;
    if (b == 0xE0 && byte(i + 1) < 0xA0) return 0;  // too long a form
    if (b == 0xED && byte(i + 1) > 0x9F) return 0;  // surrogates
    return 3;
  }
  if (b >= 0xF0 && b <= 0xF4) {
    if (!tail(i + 1) || !tail(i + 2) || !tail(i + 3)) return 0;
    if (b == 0xF0 && byte(i + 1) < 0x90) return 0;
    if (b == 0xF4 && byte(i + 1) > 0x8F) return 0;
    return 4;
  }
  return 0;
}

}  // namespace

Line LineAt(std::string_view bytes, std::size_t offset) {
  std::size_t end = bytes.find_first_of("\n\r", offset);
  if (end == std::string_view::npos) end = bytes.size();
  std::size_t next = std::min(end + 1, bytes.size());
  if (end + 1 < bytes.size() && bytes[end] == '\r' && bytes[end + 1] == '\n') next = end + 2;
  return {bytes.substr(offset, end - offset), next};
}

TextPosition PositionOf(std::string_view bytes, std::size_t offset) {
  offset = std::min(offset, bytes.size());
  TextPosition position;
  std::size_t line_start = 0;
  for (std::size_t i = 0; i < offset; ++i) {
    const bool lone_return = bytes[i] == '\r' && !(i + 1 < bytes.size() && bytes[i + 1] == '\n');
    if (bytes[i] == '\n' || lone_return) {
      ++position.line;
      line_start = i + 1;
    }
  }
  position.column = offset - line_start + 1;
  return position;
}

std::string At(const std::string& path, std::size_t line) { return path + ":" + std::to_string(line); }

std::string At(const std::string& path, TextPosition position) {
  return At(path, position.line) + ":" + std::to_string(position.column);
}

std::string_view TrimBlanks(std::string_view text) {
  const std::size_t first = text.find_first_not_of(" \t");
  if (first == std::string_view::npos) return {};
  return text.substr(first, text.find_last_not_of(" \t") - first + 1);
}

std::string ToLower(std::string_view text) {
  std::string lower(text);
  for (char& c : lower) {
    if (c >= 'A' && c <= 'Z') c = static_cast<char>(c - 'A' + 'a');
  }
  return lower;
}

bool IsUtf8(std::string_view text) {
  for (std::size_t i = 0; i < text.size();) {
    const std::size_t length = Utf8Length(text, i);
    if (length == 0) return false;
    i += length;
  }
  return true;
}

std::string Quoted(std::string_view text, std::size_t limit) {
  std::string quoted = "'";
  std::size_t i = 0;
  while (i < text.size() && i < limit) {
    const std::size_t length = Utf8Length(text, i);
    const auto c = static_cast<unsigned char>(text[i]);
    if (length == 0 || c < 0x20 || c == 0x7F) {
      quoted += fmt::format("\\x{:02x}", c);
      ++i;
    } else {
      quoted += text.substr(i, length);
      i += length;
    }
  }
  quoted += "'";
  if (i < text.size()) quoted += fmt::format("... ({} bytes)", text.size());
  return quoted;
}

std::size_t BomSize(std::string_view bytes) { return bytes.starts_with("\xEF\xBB\xBF") ? 3 : 0; }

Status CheckText(const std::string& path, std::string_view bytes) {
  const std::string start = At(path, 1);
  if (bytes.find_first_not_of(" \t\r\n", BomSize(bytes)) == std::string_view::npos) {
    return Refused("the log is empty", start, fmt::format("{} bytes, none of them text", bytes.size()),
                   "was the recording stopped before anything was written?");
  }
  const bool marked =
      bytes.starts_with("\xFF\xFE") || bytes.starts_with("\xFE\xFF") || bytes.starts_with("\0\0\xFE\xFF"sv);
  if (marked || LooksLikeUtf16(bytes)) {
    return Refused("the log is not in UTF-8", start, "UTF-16 or UTF-32 text",
                   "convert it: iconv -f UTF-16 -t UTF-8 FILE > log.csv");
  }
  for (const auto& magic : kMagics) {
    if (bytes.starts_with(magic.bytes)) return Refused("the log is not text", start, magic.name, magic.cure);
  }
  if (const void* nul = std::memchr(bytes.data(), 0, bytes.size())) {
    const auto offset = static_cast<std::size_t>(static_cast<const char*>(nul) - bytes.data());
    return Refused("the log is not text", At(path, PositionOf(bytes, offset)), "a NUL byte",
                   "a binary file, or a recording cut short by a crash: delete the damaged end");
  }
  // Other control characters are looked for where a binary file would show them soon.
  const std::string_view head = bytes.substr(0, 1 << 16);
  for (std::size_t i = 0; i < head.size(); ++i) {
    const auto c = static_cast<unsigned char>(head[i]);
    if (c < 0x20 && c != '\t' && c != '\n' && c != '\r' && c != '\f') {
      return Refused("the log is not text", At(path, PositionOf(bytes, i)),
                     fmt::format("the control character \\x{:02x}", c), "is this a binary file? Export the log as CSV");
    }
  }
  return Ok();
}

}  // namespace gapscope
