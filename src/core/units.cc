#include "src/core/units.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
#include <sstream>
#include <vector>

#include "src/core/names.h"

namespace gapscope {
namespace {

const std::map<std::string, Unit, std::less<>>& Table() {
  constexpr double kDeg = std::numbers::pi / 180;
  constexpr double kRpm = 2 * std::numbers::pi / 60;
  // clang-format off
  static const std::map<std::string, Unit, std::less<>> table = {
      {"1", {"1", 1}},          {"%", {"1", 0.01}},
      {"s", {"s", 1}},          {"ms", {"s", 1e-3}},        {"us", {"s", 1e-6}},       {"ns", {"s", 1e-9}},
      {"rad", {"rad", 1}},      {"mrad", {"rad", 1e-3}},    {"deg", {"rad", kDeg}},    {"rev", {"rad", 360 * kDeg}},
      {"rad/s", {"rad/s", 1}},  {"deg/s", {"rad/s", kDeg}}, {"rpm", {"rad/s", kRpm}},  {"rev/s", {"rad/s", 60 * kRpm}},
      {"rad/s^2", {"rad/s^2", 1}},
      {"m/s^2", {"m/s^2", 1}},  {"gn", {"m/s^2", 9.80665}}, {"T", {"T", 1}},           {"mT", {"T", 1e-3}},
      {"V", {"V", 1}},          {"mV", {"V", 1e-3}},        {"dV", {"V", 0.1}},
      {"A", {"A", 1}},          {"mA", {"A", 1e-3}},
      {"N m", {"N m", 1}},      {"Nm", {"N m", 1}},         {"mN m", {"N m", 1e-3}},   {"mNm", {"N m", 1e-3}},
      {"m", {"m", 1}},          {"mm", {"m", 1e-3}},        {"m/s", {"m/s", 1}},       {"N", {"N", 1}},
      {"kg", {"kg", 1}},        {"g", {"kg", 1e-3}},        {"ohm", {"ohm", 1}},       {"degC", {"degC", 1}},
  };
  // clang-format on
  return table;
}

// Powers of s, m, kg, A, degC.
const std::map<std::string, Dimension, std::less<>>& Symbols() {
  static const std::map<std::string, Dimension, std::less<>> symbols = {
      {"1", {}},
      {"rad", {}},
      {"s", {1}},
      {"m", {0, 1}},
      {"kg", {0, 0, 1}},
      {"A", {0, 0, 0, 1}},
      {"degC", {0, 0, 0, 0, 1}},
      {"N", {-2, 1, 1}},
      {"W", {-3, 2, 1}},
      {"V", {-3, 2, 1, -1}},
      {"ohm", {-3, 2, 1, -2}},
  };
  return symbols;
}

}  // namespace

Result<Unit> ParseUnit(std::string_view text) {
  if (const auto found = Table().find(text); found != Table().end()) return found->second;
  // "counts/2048": an encoder of 2048 counts per revolution.
  if (constexpr std::string_view kCounts = "counts/"; text.starts_with(kCounts)) {
    const double per_rev = std::strtod(std::string(text.substr(kCounts.size())).c_str(), nullptr);
    if (std::isfinite(per_rev) && per_rev >= 1) return Unit{"rad", 2 * std::numbers::pi / per_rev};
  }
  std::vector<std::string> names;
  for (const auto& [name, unit] : Table()) names.push_back(name);
  Error error = NoSuch("unknown unit", std::string(text), names, "");
  error.allowed += ", counts/<per revolution>";
  return error;
}

Result<Dimension> ParseSiUnit(std::string_view text) {
  Dimension product{};
  double sign = 1;
  std::size_t at = 0;
  do {
    const std::size_t end = std::min(text.find_first_of(" /", at), text.size());
    std::string symbol(text.substr(at, end - at));
    double power = 1;
    if (const auto last = symbol.find_last_not_of("0123456789^-"); last != std::string::npos) {
      const std::size_t digits = symbol.find_first_not_of('^', last + 1);
      if (digits != std::string::npos) power = std::strtod(symbol.c_str() + digits, nullptr);
      symbol.resize(last + 1);
    }
    const auto known = Symbols().find(symbol);
    if (known == Symbols().end()) {
      std::vector<std::string> names;
      for (const auto& [name, dimension] : Symbols()) names.push_back(name);
      Error error = NoSuch("unknown unit", std::string(text), names, "");
      error.allowed = "powers of " + error.allowed + ", as in N m s/rad";
      const auto other = Table().find(symbol);
      error.cure = other != Table().end() ? "write the value in " + other->second.si : DidYouMean(symbol, names);
      return error;
    }
    for (std::size_t i = 0; i < product.size(); ++i) product[i] += sign * power * known->second[i];
    sign = end < text.size() && text[end] == '/' ? -1 : 1;
    at = end + 1;
  } while (at <= text.size());
  return product;
}

std::string TextOf(const Dimension& dimension) {
  constexpr std::array kNames{"s", "m", "kg", "A", "degC"};
  std::ostringstream text;
  for (const std::size_t i : {2, 1, 0, 3, 4}) {
    if (dimension[i] == 0) continue;
    text << (text.view().empty() ? "" : " ") << kNames[i];
    if (dimension[i] != 1) text << '^' << dimension[i];
  }
  return text.view().empty() ? "1" : text.str();
}

}  // namespace gapscope
