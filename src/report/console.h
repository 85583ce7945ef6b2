// Colour, lines and small pictures for a terminal.
#ifndef GAPSCOPE_REPORT_CONSOLE_H_
#define GAPSCOPE_REPORT_CONSOLE_H_

#include <cstddef>
#include <span>
#include <string>
#include <vector>

namespace gapscope {

// How a table may dress its text. Plain by default: what goes into files and pipes.
struct Console {
  bool colour = false;

  std::string Bold(const std::string& text) const { return Dressed("1", text); }
  std::string Good(const std::string& text) const { return Dressed("32", text); }
  std::string Warn(const std::string& text) const { return Dressed("33", text); }
  std::string Bad(const std::string& text) const { return Dressed("31", text); }

 private:
  std::string Dressed(const char* code, const std::string& text) const {
    return colour ? std::string("\033[").append(code).append("m").append(text).append("\033[0m") : text;
  }
};

// Of a stream that goes to a terminal that takes colour, unless the user has set NO_COLOR (no-color.org).
Console ConsoleOf(int descriptor);

// One block character per value, of an eighth to full height; the largest value is full, a blank stands for what is not
// finite. Zero is the lowest block.
std::string Sparkline(std::span<const double> values);

// Root mean square of measured less predicted in `parts` equal stretches of time; NaN where a stretch has no rows.
std::vector<double> ErrorOverTime(std::span<const double> time_s, std::span<const double> measured,
                                  std::span<const double> predicted, std::size_t parts);

// Words on lines of at most `width` characters, all but the first one behind `indent`.
std::string Wrapped(const std::string& text, std::size_t width, const std::string& indent = "");
// A command on such lines, broken before options, for a shell.
std::string WrappedCommand(const std::string& command, std::size_t width);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_CONSOLE_H_
