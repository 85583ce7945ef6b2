// Text from files and names as it may be shown to people.
#ifndef GAPSCOPE_CORE_VISIBLE_H_
#define GAPSCOPE_CORE_VISIBLE_H_

#include <string>
#include <string_view>

namespace gapscope {

// Control characters, and those that turn the direction of writing (Unicode Standard Annex 9), as \uXXXX: the escape of
// JSON, or behind another `escape`. Line breaks, tabs and the colours of Console stay, and what is no UTF-8.
std::string MadeVisible(std::string_view text, std::string_view escape = "\\u");

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_VISIBLE_H_
