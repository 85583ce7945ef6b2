// Units as users write them in logs and experiment files, converted to SI and radians on reading.
#ifndef GAPSCOPE_CORE_UNITS_H_
#define GAPSCOPE_CORE_UNITS_H_

#include <string>
#include <string_view>

#include "src/core/result.h"

namespace gapscope {

struct Unit {
  std::string si;     // the unit used inside: "rad", "rad/s", "s", "V", "A", "N m", "1" ...
  double factor = 1;  // value in SI = factor * value as written
};

// "deg", "rpm", "ms", "mA", "counts/2048" ... Errors: unknown unit, with the nearest known one.
Result<Unit> ParseUnit(std::string_view text);

// The candidate closest to `name` by edit distance, for error messages; empty when none is close.
template <class Range>
std::string Nearest(std::string_view name, const Range& candidates);
std::size_t EditDistance(std::string_view a, std::string_view b);

template <class Range>
std::string Nearest(std::string_view name, const Range& candidates) {
  std::string best;
  std::size_t best_distance = name.size() / 2 + 2;
  for (const auto& candidate : candidates) {
    const std::string_view text = candidate;
    if (const std::size_t distance = EditDistance(name, text); distance < best_distance) {
      best_distance = distance;
      best = std::string(text);
    }
  }
  return best;
}

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_UNITS_H_
