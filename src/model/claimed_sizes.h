// Sizes that an MJCF states as a number, for which MuJoCo takes memory at once.
#ifndef GAPSCOPE_MODEL_CLAIMED_SIZES_H_
#define GAPSCOPE_MODEL_CLAIMED_SIZES_H_

#include <mujoco/mujoco.h>

#include <string>

#include "src/core/result.h"

namespace gapscope {

// A line of text must not take all memory there is, nor a height field have more points than MuJoCo counts (an int).
// `where`: the MJCF. Errors: more than 10,000 user numbers of an element, 10^8 user data or points of a height field.
Status CheckClaimedSizes(const mjSpec& spec, const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_CLAIMED_SIZES_H_
