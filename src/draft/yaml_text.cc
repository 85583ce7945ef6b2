#include "src/draft/yaml_text.h"

#include <algorithm>
#include <array>
#include <cctype>
#include <cstdio>
#include <string_view>

#include "src/log/text.h"

namespace gapscope {

std::string Num(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.6g", value);
  return text;
}

std::string Quote(const std::string& text) {
  // Words that YAML takes for something else than a text.
  constexpr std::array<std::string_view, 9> kMeant = {"true", "false", "yes", "no", "on", "off", "null", "y", "n"};
  const bool plain = !text.empty() &&
                     std::all_of(text.begin(), text.end(),
                                 [](unsigned char c) { return std::isalnum(c) || c == '_' || c == '/' || c == '-'; }) &&
                     std::isalpha(static_cast<unsigned char>(text[0])) &&
                     std::find(kMeant.begin(), kMeant.end(), ToLower(text)) == kMeant.end();
  if (plain) return text;
  std::string out = "\"";
  for (const char c : text) {
    if (c == '"' || c == '\\') out += '\\';
    out += c;
  }
  return out + "\"";
}

}  // namespace gapscope
