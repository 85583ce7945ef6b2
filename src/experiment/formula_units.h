// Whether the units in a formula agree: what the parser that evaluates it cannot see.
#ifndef GAPSCOPE_EXPERIMENT_FORMULA_UNITS_H_
#define GAPSCOPE_EXPERIMENT_FORMULA_UNITS_H_

#include <map>
#include <string>

#include "src/core/result.h"

namespace gapscope {

// `units`: names and what they are in, as ParseSiUnit reads it. A number may stand for a quantity of any unit ("0.5 *
// speed" may be a torque), and so may a name without one: what they enter by multiplication is not checked. Errors: a
// sum, a difference or a comparison of different units, a function or a power of something that has one, a result that
// is not in `result`. A formula that the parser refuses is no error here.
Status CheckFormulaUnits(const std::string& formula, const std::map<std::string, std::string>& units,
                         const std::string& result, const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_FORMULA_UNITS_H_
