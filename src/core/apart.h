// Work that may end the process, done in a process of its own first.
#ifndef GAPSCOPE_CORE_APART_H_
#define GAPSCOPE_CORE_APART_H_

#include <functional>
#include <string>

namespace gapscope {

// Runs `work` in a copy of this process that is thrown away, its output too. Empty: it returned an empty text; else
// that text, or how it ended ("it crashes: Segmentation fault", "it does not return within 20 s").
std::string TryApart(const std::function<std::string()>& work, unsigned most_s = 20);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_APART_H_
