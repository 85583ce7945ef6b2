// Options as the words of a command line that gives the same values again.
#ifndef GAPSCOPE_CORE_OPTION_WORDS_H_
#define GAPSCOPE_CORE_OPTION_WORDS_H_

#include <string>
#include <vector>

#include "src/core/options.h"

namespace gapscope {

// Each value in its words, defaults too: "--window=0.5"; first what is given by its place. Numbers to the last digit.
// What is not given (a flag that is off, no text, a number that stands for that) has no word.
std::vector<std::string> WordsOf(const std::vector<Option>& options);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_OPTION_WORDS_H_
