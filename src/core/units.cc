#include "src/core/units.h"

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <map>
#include <numbers>
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

Status CheckSiUnit(std::string_view text) {
  static const std::vector<std::string> kSymbols = {"1", "rad", "s", "m", "kg", "N", "V", "A", "W", "ohm", "degC"};
  std::size_t at = 0;
  do {
    const std::size_t end = std::min(text.find_first_of(" /", at), text.size());
    std::string symbol(text.substr(at, end - at));
    at = end + 1;
    if (const auto power = symbol.find_last_not_of("0123456789^-"); power != std::string::npos)
      symbol.resize(power + 1);
    if (std::find(kSymbols.begin(), kSymbols.end(), symbol) != kSymbols.end()) continue;
    Error error = NoSuch("unknown unit", std::string(text), kSymbols, "");
    error.allowed = "powers of " + error.allowed + ", as in N m s/rad";
    const auto other = Table().find(symbol);
    error.cure = other != Table().end() ? "write the value in " + other->second.si : DidYouMean(symbol, kSymbols);
    return error;
  } while (at <= text.size());
  return Ok();
}

}  // namespace gapscope
