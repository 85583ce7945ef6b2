// Names that a user writes, beside those that exist: the error for one that does not.
#ifndef GAPSCOPE_CORE_NAMES_H_
#define GAPSCOPE_CORE_NAMES_H_

#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// "a, b, c".
std::string Join(const std::vector<std::string>& names);

// Insertions, deletions and changes of a letter between the two, whatever the case.
std::size_t EditDistance(std::string_view a, std::string_view b);
// The candidate closest to `name` by edit distance; empty when none is close.
std::string Nearest(std::string_view name, const std::vector<std::string>& candidates);
// "did you mean 'NEAREST'?", or `otherwise` when none is close.
std::string DidYouMean(std::string_view name, const std::vector<std::string>& candidates,
                       const std::string& otherwise = "");
// `what` is wrong with `name`; allowed are `names`, of which the nearest is asked for.
Error NoSuch(const std::string& what, const std::string& name, const std::vector<std::string>& names,
             const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_NAMES_H_
