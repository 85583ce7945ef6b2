// Units as users write them in logs and experiment files, converted to SI and radians on reading.
#ifndef GAPSCOPE_CORE_UNITS_H_
#define GAPSCOPE_CORE_UNITS_H_

#include <array>
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

// Powers of s, m, kg, A and degC; rad is 1.
using Dimension = std::array<double, 5>;

// "N m s/rad", "kg m^2", "1/s": whole powers of SI's symbols, '/' before each one that divides. Error: another unit,
// with the nearest symbol, or what it is in SI.
Result<Dimension> ParseSiUnit(std::string_view text);
// "kg m^2 s^-2"; "1".
std::string TextOf(const Dimension& dimension);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_UNITS_H_
