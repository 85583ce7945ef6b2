// Work that may end the process, done in a process of its own.
#ifndef GAPSCOPE_CORE_APART_H_
#define GAPSCOPE_CORE_APART_H_

#include <functional>
#include <string>

namespace gapscope {

// Runs `work` in a copy of this process that is thrown away, its output too. Empty: it returned an empty text; else
// that text, or how it ended ("it crashes: Segmentation fault", "it does not return within 20 s").
std::string TryApart(const std::function<std::string()>& work, unsigned most_s = 20);

struct ApartEnd {
  int status = 0;     // what `work` returned
  std::string crash;  // how it ended where it returned nothing: "Segmentation fault", or what it threw
};

// Runs `work` to its end in a copy of this process, its output shown, and passes on interruptions meanwhile. What ends
// the copy from outside ends this process too. Where there is no room for a copy it is run here. Not beside threads:
// the copy has none of them.
ApartEnd RunApart(const std::function<int()>& work);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_APART_H_
