#include "src/core/visible.h"

#include <algorithm>
#include <array>
#include <cstdio>

namespace gapscope {
namespace {

constexpr std::array<std::string_view, 5> kColours = {"\033[0m", "\033[1m", "\033[31m", "\033[32m", "\033[33m"};

// A character of one to three bytes, and how many it has; of four, and of no UTF-8, one byte, which stays.
struct Character {
  unsigned code = 0;
  std::size_t bytes = 1;
};
Character First(std::string_view text) {
  const auto byte = [&](std::size_t i) { return i < text.size() ? static_cast<unsigned char>(text[i]) : 0U; };
  const auto follows = [&](std::size_t i) { return (byte(i) & 0xc0U) == 0x80U; };
  const unsigned a = byte(0);
  if (a >= 0xc2 && a < 0xe0 && follows(1)) return {((a & 0x1fU) << 6U) | (byte(1) & 0x3fU), 2};
  if (a >= 0xe0 && a < 0xf0 && follows(1) && follows(2))
    return {((a & 0x0fU) << 12U) | ((byte(1) & 0x3fU) << 6U) | (byte(2) & 0x3fU), 3};
  return {a < 0x80 ? a : 0xfffdU, 1};
}

// The colour that a text begins with; empty: none.
std::string_view ColourAt(std::string_view text) {
  const auto* const colour = std::ranges::find_if(kColours, [&](std::string_view c) { return text.starts_with(c); });
  return colour != kColours.end() ? *colour : std::string_view();
}

bool IsHidden(unsigned code) {
  if (code == '\n' || code == '\t') return false;
  const bool control = code < 0x20 || (code >= 0x7f && code < 0xa0);
  const bool direction = code == 0x61c || code == 0x200e || code == 0x200f || (code >= 0x202a && code <= 0x202e) ||
                         (code >= 0x2066 && code <= 0x2069);
  return control || direction;
}

}  // namespace

std::string MadeVisible(std::string_view text, std::string_view escape) {
  std::string shown;
  shown.reserve(text.size());
  for (std::size_t at = 0; at < text.size();) {
    const std::string_view rest = text.substr(at);
    const Character first = First(rest);
    std::size_t stays = first.bytes;
    if (IsHidden(first.code)) stays = ColourAt(rest).size();
    shown += rest.substr(0, stays);
    at += std::max(stays, first.bytes);
    if (stays > 0) continue;
    char digits[8];
    std::snprintf(digits, sizeof digits, "%04x", first.code);
    shown.append(escape).append(digits);
  }
  return shown;
}

}  // namespace gapscope
