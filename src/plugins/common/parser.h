// muParser as this project's expressions use it: experiment files and gapscope.expression read one language.
#ifndef GAPSCOPE_PLUGINS_COMMON_PARSER_H_
#define GAPSCOPE_PLUGINS_COMMON_PARSER_H_

#include <muParser.h>

#include <algorithm>
#include <array>
#include <numbers>
#include <string_view>

namespace gapscope::plugins {

inline constexpr std::size_t kLongestExpression = 4096;
// What names are made of: NAME@ON.KEY is one.
inline constexpr const char* kNameChars = "0123456789_abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ.@";

// What the formula of a torque may read beside its parameters: rad, rad/s, the command's unit, s.
enum FormulaInput { kAngle, kSpeed, kCommand, kTime, kFormulaInputCount };
inline constexpr std::array<const char*, kFormulaInputCount> kFormulaInputs = {"angle", "speed", "command", "time"};
// How late it reads the command, a parameter too.
inline constexpr const char* kFormulaDelay = "command_delay_s";

// muParser recurses on parentheses.
inline bool IsTooLong(std::string_view text) {
  constexpr int kMostParentheses = 64;
  return text.size() > kLongestExpression || std::count(text.begin(), text.end(), '(') > kMostParentheses;
}

// muParser assigns to variables with '=', '+=' ...: not here.
inline bool Assigns(std::string_view text) {
  for (std::size_t i = 0; i < text.size(); ++i) {
    if (text[i] != '=') continue;
    if (i + 1 < text.size() && text[i + 1] == '=') {
      ++i;
      continue;
    }
    if (i == 0 || (text[i - 1] != '<' && text[i - 1] != '>' && text[i - 1] != '!')) return true;
  }
  return false;
}

// A parser of that text that knows `pi` and names with dots, and no variable yet.
inline void SetText(mu::Parser* parser, std::string_view text) {
  parser->DefineNameChars(kNameChars);
  parser->DefineConst("pi", std::numbers::pi);
  parser->SetExpr(std::string(text));
}

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_COMMON_PARSER_H_
