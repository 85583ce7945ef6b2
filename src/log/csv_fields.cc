#include "src/log/csv_fields.h"

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <limits>

#include "src/log/text.h"

namespace gapscope {
namespace {

bool IsLineEnd(char c) { return c == '\n' || c == '\r'; }

bool IsMissing(const std::string& lower) {
  static constexpr std::array<std::string_view, 14> kWords = {
      "", "nan", "-nan", "+nan", "na", "n/a", "null", "none", "nil", "-", "--", "1.#qnan", "-1.#ind", "nan(ind)"};
  return std::find(kWords.begin(), kWords.end(), lower) != kWords.end() || lower == "-nan(ind)";
}

}  // namespace

FieldText FieldAt(std::string_view line, std::size_t offset, char delimiter) {
  const auto is_blank = [&](char c) { return (c == ' ' || c == '\t') && (c != delimiter || delimiter == kBlanks); };
  const auto ends = [&](char c) {
    return IsLineEnd(c) || (delimiter == kBlanks ? c == ' ' || c == '\t' : c == delimiter);
  };
  std::size_t i = offset;
  while (i < line.size() && is_blank(line[i])) ++i;
  FieldText field;
  if (i < line.size() && line[i] == '"') {
    field.quoted = true;
    const std::size_t first = ++i;
    while (i < line.size() && !IsLineEnd(line[i])) {
      if (line[i] == '"') {
        if (i + 1 < line.size() && line[i + 1] == '"') {
          i += 2;
          continue;
        }
        break;
      }
      ++i;
    }
    field.text = line.substr(first, i - first);
    field.unterminated = i >= line.size() || line[i] != '"';
    if (!field.unterminated) ++i;
    while (i < line.size() && !ends(line[i])) {
      if (!is_blank(line[i])) field.unterminated = true;
      ++i;
    }
  } else {
    const std::size_t first = i;
    while (i < line.size() && !ends(line[i])) ++i;
    field.text = line.substr(first, i - first);
  }
  field.text = TrimBlanks(field.text);
  field.end = i;
  return field;
}

std::vector<std::string> SplitLine(std::string_view line, char delimiter, bool* unterminated) {
  std::vector<std::string> fields;
  std::size_t offset = 0;
  while (true) {
    if (delimiter == kBlanks) {
      while (offset < line.size() && (line[offset] == ' ' || line[offset] == '\t')) ++offset;
      if (offset >= line.size()) break;
    }
    const FieldText field = FieldAt(line, offset, delimiter);
    if (field.unterminated && unterminated) *unterminated = true;
    std::string text(field.text);
    if (field.quoted) {
      for (std::size_t at = 0; (at = text.find("\"\"", at)) != std::string::npos; ++at) text.erase(at, 1);
    }
    fields.push_back(std::move(text));
    if (field.end >= line.size()) break;
    offset = field.end + 1;
  }
  return fields;
}

FieldValue ParseField(std::string_view text, bool comma_allowed) {
  FieldValue result;
  std::string lower = text.size() <= 10 ? ToLower(text) : std::string();
  if (text.size() <= 10) {
    if (IsMissing(lower)) return result;
    if (lower == "true" || lower == "false") return {FieldKind::kNumber, lower == "true" ? 1.0 : 0.0, false};
  }
  std::string copy;
  if (comma_allowed && std::count(text.begin(), text.end(), ',') == 1 && text.find('.') == std::string_view::npos) {
    copy = text;
    copy[copy.find(',')] = '.';
    text = copy;
    result.decimal_comma = true;
  }
  if (text.starts_with('+') && text.size() > 1 && text[1] != '-') text.remove_prefix(1);
  const auto [stop, failure] = std::from_chars(text.data(), text.data() + text.size(), result.value);
  if (failure == std::errc::invalid_argument || stop != text.data() + text.size()) return {FieldKind::kText, 0, false};
  if (failure == std::errc::result_out_of_range) {
    // Too small is zero, too large is refused. The exponent's sign tells (or a run of zeros behind the point).
    const std::size_t exponent = text.find_first_of("eE");
    const bool tiny = exponent == std::string_view::npos ? text.find_first_of("123456789") > text.find('.')
                                                         : text.substr(exponent + 1).starts_with('-');
    if (!tiny) return {FieldKind::kTooLarge, 0, false};
    result.value = 0;
  }
  if (std::isnan(result.value)) return {FieldKind::kMissing, 0, false};
  result.kind = std::isinf(result.value) ? FieldKind::kInfinite : FieldKind::kNumber;
  return result;
}

}  // namespace gapscope
