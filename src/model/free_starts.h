// Bodies whose pose a log measures: free ones start a window there, held ones stand there.
#ifndef GAPSCOPE_MODEL_FREE_STARTS_H_
#define GAPSCOPE_MODEL_FREE_STARTS_H_

#include <mujoco/mujoco.h>

#include <array>
#include <vector>

#include "src/core/result.h"
#include "src/core/rotation.h"
#include "src/experiment/experiment.h"

namespace gapscope {

// Of one body: which measured signals say where it is. Both sensors ride on it.
struct FreeStart {
  int body = -1;
  int qpos = -1, dof = -1;                     // of its free joint: first of seven, of six; -1: it is held
  std::array<int, 3> position = {-1, -1, -1};  // indices in experiment.measured, x y z; -1: not measured
  int rotation = -1;                           // index of the first of the orientation's three; -1: not measured
  Vector3 place = {};                          // of the position's sensor on the body, in its frame, m
  Quaternion mounted = kNoRotation;            // from the body's frame to the orientation's sensor
};

// Of the free bodies and of those that the experiment holds: those that a `framepos` with all three elements or a
// `framequat` measures, in the world's frame; the first such sensor of a body counts. Errors: 'start: true' of a signal
// that says no such thing.
Result<std::vector<FreeStart>> FindFreeStarts(const mjModel& model, const Experiment& experiment);

// The body that a sensor's object rides on; -1: on none.
int BodyOfSensor(const mjModel& m, int sensor);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_FREE_STARTS_H_
