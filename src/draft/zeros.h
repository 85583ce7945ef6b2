// Zeros of angles. A sensor that counts from the end of its turn, not from its middle, puts a joint half a turn off,
// which the joint's range shows.
#ifndef GAPSCOPE_DRAFT_ZEROS_H_
#define GAPSCOPE_DRAFT_ZEROS_H_

#include <mujoco/mujoco.h>

#include <vector>

#include "src/draft/scaling.h"

namespace gapscope {

// Takes half a turn off the angles of a family that only then lies within the joints' ranges, and off the targets that
// they follow; says where an angle leaves its range whatever one does.
void FindZeros(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
               Scalings* scalings);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_ZEROS_H_
