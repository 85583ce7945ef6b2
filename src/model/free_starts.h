// Free bodies whose pose a log measures: a window starts them there.
#ifndef GAPSCOPE_MODEL_FREE_STARTS_H_
#define GAPSCOPE_MODEL_FREE_STARTS_H_

#include <mujoco/mujoco.h>

#include <array>
#include <vector>

#include "src/core/result.h"
#include "src/core/rotation.h"
#include "src/experiment/experiment.h"

namespace gapscope {

// Of one free joint: which measured signals say where its body is. Both sensors ride on the body.
struct FreeStart {
  int qpos = -1, dof = -1;                     // first of seven, of six
  std::array<int, 3> position = {-1, -1, -1};  // indices in experiment.measured, x y z; -1: not measured
  int rotation = -1;                           // index of the first of the orientation's three; -1: not measured
  Vector3 place = {};                          // of the position's sensor on the body, in its frame, m
  Quaternion mounted = kNoRotation;            // from the body's frame to the orientation's sensor
};

// Those of the joints that a `framepos` with all three elements or a `framequat` measures, in the world's frame; the
// first such sensor of a body counts. Errors: 'start: true' of a signal that says no such thing.
Result<std::vector<FreeStart>> FindFreeStarts(const mjModel& model, const Experiment& experiment);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_FREE_STARTS_H_
