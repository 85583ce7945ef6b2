// Values as Python source.
#ifndef GAPSCOPE_EXPORT_PYTHON_TEXT_H_
#define GAPSCOPE_EXPORT_PYTHON_TEXT_H_

#include <span>
#include <string>
#include <string_view>
#include <vector>

namespace gapscope {

// "text" in quotes, everything in it escaped.
std::string PyText(std::string_view text);
// A regular expression in quotes that matches this name alone.
std::string PyPattern(std::string_view name);
// A float, to ten digits.
std::string PyNumber(double value);
// (a, b, c) of items that are source already; of none and of one too.
std::string PyTuple(const std::vector<std::string>& items);
std::string PyNumbers(std::span<const double> values);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_PYTHON_TEXT_H_
