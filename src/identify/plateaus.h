// Stretches of a log in which the command stands still, and what the signals settled to.
#ifndef GAPSCOPE_IDENTIFY_PLATEAUS_H_
#define GAPSCOPE_IDENTIFY_PLATEAUS_H_

#include <vector>

#include "src/identify/filter.h"

namespace gapscope {

struct Plateau {
  int log = 0;
  double from_s = 0, to_s = 0;  // the settled part: the second half of the stretch
  double command = 0;
  double speed = 0, acceleration = 0;  // of the driven joint: slope of its angle, and change of the slope from the
                                       // settled part's first half to its second, per second
  double current = 0, torque = 0;      // means; NaN without the column
  std::size_t rows = 0;
};

// Stretches of at least `least_s` with an equal command of the first command column. `current`: per recording, empty
// where there is none.
std::vector<Plateau> FindPlateaus(const IdentifyInput& input, int joint,
                                  const std::vector<std::vector<double>>& current, const IdentifyOptions& options,
                                  double least_s);

}  // namespace gapscope

#endif  // GAPSCOPE_IDENTIFY_PLATEAUS_H_
