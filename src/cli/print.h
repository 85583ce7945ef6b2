// What commands say to people: as fmt::print, with what could hide something made visible (MadeVisible).
#ifndef GAPSCOPE_CLI_PRINT_H_
#define GAPSCOPE_CLI_PRINT_H_

#include <fmt/format.h>

#include <cstdio>
#include <string>
#include <utility>

#include "src/core/visible.h"

namespace gapscope::cli {

template <class... Values>
void Print(std::FILE* to, fmt::format_string<Values...> text, Values&&... values) {
  const std::string shown = MadeVisible(fmt::format(text, std::forward<Values>(values)...));
  std::fwrite(shown.data(), 1, shown.size(), to);
}

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_PRINT_H_
