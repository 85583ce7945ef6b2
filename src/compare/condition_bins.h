// Private to src/compare: which condition each row belongs to, family by family.
#ifndef GAPSCOPE_COMPARE_CONDITION_BINS_H_
#define GAPSCOPE_COMPARE_CONDITION_BINS_H_

#include <span>
#include <string>
#include <vector>

#include "src/compare/conditions.h"

namespace gapscope {

// names[bin[row]] is the condition of a row; -1: the row takes no part.
struct Partition {
  ConditionFamily family;
  std::vector<std::string> names;
  std::vector<int> bin;
};

// All families but kFrequency for which `input` has data, in the order of the enum. `used[row]` is 0 for rows left out.
std::vector<Partition> MakePartitions(const ConditionInput& input, const std::vector<char>& used);

// "0.2", "15", "1e-05": up to six digits, whatever the locale.
std::string NumberText(double value);

// `value` to two significant digits.
double RoundToTwoDigits(double value);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_CONDITION_BINS_H_
