#include "src/report/console.h"

#include <unistd.h>

#include <algorithm>
#include <cmath>
#include <cstdlib>
#include <string_view>

#include "src/core/statistics.h"

namespace gapscope {

Console ConsoleOf(int descriptor) {
  const char* off = std::getenv("NO_COLOR");
  const char* terminal = std::getenv("TERM");
  return {.colour = isatty(descriptor) && !(off && *off) && terminal && std::string_view(terminal) != "dumb"};
}

std::string Sparkline(std::span<const double> values) {
  static const char* const kBlocks[] = {"\u2581", "\u2582", "\u2583", "\u2584", "\u2585", "\u2586", "\u2587", "\u2588"};
  double most = 0;
  for (const double v : values) {
    if (std::isfinite(v)) most = std::max(most, v);
  }
  std::string line;
  for (const double v : values) {
    if (!std::isfinite(v)) {
      line += ' ';
    } else {
      line += kBlocks[most > 0 ? std::clamp(static_cast<int>(std::ceil(8 * v / most)) - 1, 0, 7) : 0];
    }
  }
  return line;
}

std::vector<double> ErrorOverTime(std::span<const double> time_s, std::span<const double> measured,
                                  std::span<const double> predicted, std::size_t parts) {
  std::vector<double> sums(parts, 0);
  std::vector<std::size_t> rows(parts, 0);
  const double length = time_s.empty() ? 0 : time_s.back() - time_s.front();
  for (std::size_t r = 0; r < time_s.size(); ++r) {
    const double error = measured[r] - predicted[r];
    if (!std::isfinite(error)) continue;
    const std::size_t part = length > 0
                                 ? std::min(parts - 1, static_cast<std::size_t>(static_cast<double>(parts) *
                                                                                (time_s[r] - time_s.front()) / length))
                                 : 0;
    sums[part] += error * error;
    ++rows[part];
  }
  for (std::size_t p = 0; p < parts; ++p)
    sums[p] = rows[p] > 0 ? std::sqrt(sums[p] / static_cast<double>(rows[p])) : kNaN;
  return sums;
}

std::string Wrapped(const std::string& text, std::size_t width, const std::string& indent) {
  std::string wrapped;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < text.size();) {
    std::size_t end = text.find(' ', begin);
    if (end == std::string::npos) end = text.size();
    if (column > 0 && column + 1 + end - begin > width) {
      wrapped += '\n' + indent;
      column = indent.size();
    } else if (column > 0) {
      wrapped += ' ', ++column;
    }
    wrapped.append(text, begin, end - begin);
    column += end - begin;
    begin = end + 1;
  }
  return wrapped;
}

std::string WrappedCommand(const std::string& command, std::size_t width) {
  const std::string break_before = " --", continued = " \\\n   ";
  std::string wrapped;
  std::size_t column = 0;
  for (std::size_t begin = 0; begin < command.size();) {
    const std::size_t end = std::min(command.find(break_before, begin + 1), command.size());
    if (column > 0 && column + end - begin + 2 > width) {
      wrapped += continued;
      column = 3;
    }
    wrapped.append(command, begin, end - begin);
    column += end - begin;
    begin = end;
  }
  return wrapped;
}

}  // namespace gapscope
