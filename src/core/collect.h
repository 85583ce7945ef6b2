// A vector of what a function, or a pointer to a member, gives for each element of a range, in its order.
#ifndef GAPSCOPE_CORE_COLLECT_H_
#define GAPSCOPE_CORE_COLLECT_H_

#include <functional>
#include <iterator>
#include <type_traits>
#include <vector>

namespace gapscope {

template <class Range, class Of>
auto Collect(const Range& range, const Of& of) {
  std::vector<std::decay_t<decltype(std::invoke(of, *std::begin(range)))>> result;
  result.reserve(std::size(range));
  for (const auto& element : range) result.push_back(std::invoke(of, element));
  return result;
}

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_COLLECT_H_
