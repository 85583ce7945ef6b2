// Which logs, or which rows of a single log, are fitted and which are kept to score.
#ifndef GAPSCOPE_TUNE_SPLIT_H_
#define GAPSCOPE_TUNE_SPLIT_H_

#include <string>
#include <vector>

#include "src/experiment/recording.h"

namespace gapscope {

struct DataSplit {
  std::vector<Recording> train, held_out;
  std::string how;     // one line for the user
  bool asked = false;  // the user said which
};
// `held_out` indices are kept; with none, every third log from the second on; with two logs the second; with one its
// last 30 % of time.
DataSplit SplitData(std::vector<Recording> recordings, const std::vector<std::size_t>& held_out);
// Rows [begin, end) as a recording of its own; time starts anew.
Recording Slice(const Recording& recording, std::size_t begin, std::size_t end);

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_SPLIT_H_
