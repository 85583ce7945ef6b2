// One field of a CSV line: where it ends, and what it says. The slow, complete path of the reader; plain numbers never
// come here.
#ifndef GAPSCOPE_LOG_CSV_FIELDS_H_
#define GAPSCOPE_LOG_CSV_FIELDS_H_

#include <string>
#include <string_view>
#include <vector>

namespace gapscope {

// The delimiter ' ' stands for runs of blanks and tabs.
inline constexpr char kBlanks = ' ';

struct FieldText {
  std::string_view text;  // trimmed, quotes taken off
  std::size_t end = 0;    // offset behind the field: of the delimiter or the end of the line
  bool quoted = false;
  bool unterminated = false;  // a quote without its partner on the same line, or text behind the closing quote
};

// The field that starts at `offset` of a line (or of a longer text, then up to the line's end).
FieldText FieldAt(std::string_view line, std::size_t offset, char delimiter);

// All fields of a line. A doubled quote within quotes becomes one. `unterminated` is set if any field's quote is.
std::vector<std::string> SplitLine(std::string_view line, char delimiter, bool* unterminated);

enum class FieldKind {
  kNumber,    // also true and false, as 1 and 0
  kMissing,   // empty, nan, NA, null ...
  kInfinite,  // inf, written as such
  kTooLarge,  // a number beyond the range of double
  kText,
};
struct FieldValue {
  FieldKind kind = FieldKind::kMissing;
  double value = 0;
  bool decimal_comma = false;
};

// What a trimmed field says. "1,5" is a number only with `comma_allowed`.
FieldValue ParseField(std::string_view text, bool comma_allowed);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_CSV_FIELDS_H_
