// Loops that an MJCF closes by <connect> or <weld>.
#ifndef GAPSCOPE_DRAFT_LOOPS_H_
#define GAPSCOPE_DRAFT_LOOPS_H_

#include <mujoco/mujoco.h>

#include <vector>

#include "src/draft/scaling.h"

namespace gapscope {

// How far apart the ends of a loop are where measured joints stand as in the log's first row and others as in the
// MJCF, in m (rad of a weld's turn). A replay pulls them together at once.
double LoopGap(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
               const Scalings& scalings);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_LOOPS_H_
