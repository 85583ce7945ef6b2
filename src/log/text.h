// Text helpers for readers: is this text at all, lines and columns of a byte, and quoting of hostile bytes in messages.
#ifndef GAPSCOPE_LOG_TEXT_H_
#define GAPSCOPE_LOG_TEXT_H_

#include <cstddef>
#include <string>
#include <string_view>

#include "src/core/result.h"

namespace gapscope {

// A line without its end, which may be LF, CRLF or a lone CR.
struct Line {
  std::string_view text;
  std::size_t next = 0;  // offset of the next line
};
Line LineAt(std::string_view bytes, std::size_t offset);

// 1-based line and column (in bytes) of an offset.
struct TextPosition {
  std::size_t line = 1, column = 1;
};
TextPosition PositionOf(std::string_view bytes, std::size_t offset);

// "path:line" and "path:line:column".
std::string At(const std::string& path, std::size_t line);
std::string At(const std::string& path, TextPosition position);

std::string_view TrimBlanks(std::string_view text);  // blanks and tabs at both ends
std::string ToLower(std::string_view text);          // ASCII only
bool IsUtf8(std::string_view text);

// 'text' fit for one line of a message: at most `limit` bytes, others than printable ASCII and UTF-8 written as \xNN.
std::string Quoted(std::string_view text, std::size_t limit = 40);

// Refuses what no text reader can use, with a cure: empty files, UTF-16 and UTF-32, known binary formats, NUL bytes,
// control characters. Errors give path:line.
Status CheckText(const std::string& path, std::string_view bytes);

// Length of a UTF-8 byte order mark at the start: 3 or 0.
std::size_t BomSize(std::string_view bytes);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_TEXT_H_
