#include "src/export/python_text.h"

#include <fmt/core.h>
#include <fmt/ranges.h>

#include <cctype>
#include <cmath>

namespace gapscope {

std::string PyText(std::string_view text) {
  std::string quoted = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\')
      (quoted += '\\') += c;
    else if (static_cast<unsigned char>(c) < ' ')
      quoted += fmt::format("\\x{:02x}", static_cast<unsigned char>(c));
    else
      quoted += c;
  }
  return quoted + '"';
}

std::string PyPattern(std::string_view name) {
  std::string pattern;
  for (const char c : name) {
    const auto byte = static_cast<unsigned char>(c);
    if (byte < 128 && !std::isalnum(byte) && c != '_') pattern += '\\';
    pattern += c;
  }
  return PyText(pattern);
}

std::string PyNumber(double value) {
  if (!std::isfinite(value)) return fmt::format("float(\"{}\")", value);
  const std::string text = fmt::format("{:.10g}", value);
  return text.find_first_of(".e") == std::string::npos ? text + ".0" : text;
}

std::string PyTuple(const std::vector<std::string>& items) {
  return fmt::format("({}{})", fmt::join(items, ", "), items.size() == 1 ? "," : "");
}

std::string PyNumbers(std::span<const double> values) {
  std::vector<std::string> items;
  for (const double value : values) items.push_back(PyNumber(value));
  return PyTuple(items);
}

}  // namespace gapscope
