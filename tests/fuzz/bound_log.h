// An experiment file, and a log in memory that binds to those of the corpus.
#ifndef GAPSCOPE_TESTS_FUZZ_BOUND_LOG_H_
#define GAPSCOPE_TESTS_FUZZ_BOUND_LOG_H_

#include <cmath>

#include "src/experiment/experiment.h"
#include "src/experiment/recording.h"
#include "tests/fuzz/fuzz.h"

namespace gapscope::fuzz {

inline const Log& BoundLog() {
  static const Log log = [] {
    Log made{.path = "log.csv", .format = "csv", .header_line = 0};
    for (const char* name : {"time_s", "u", "q", "w", "tau", "on"}) {
      Column& column = made.columns.emplace_back(Column{.name = name, .unit = ""});
      for (int k = 0; k < 40; ++k)
        column.values.push_back(column.name == "time_s" ? 0.004 * k : std::sin(0.1 * k) + (column.name == "on"));
    }
    made.header["kp"] = 2;
    return made;
  }();
  return log;
}

}  // namespace gapscope::fuzz

#endif  // GAPSCOPE_TESTS_FUZZ_BOUND_LOG_H_
