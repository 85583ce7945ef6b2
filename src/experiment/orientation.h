// A measured orientation: four columns of a log become three signals, the rotation vector since the log's first row.
// What a prediction misses by is the rotation from the measured to the predicted orientation, in the measured frame:
//
//   predicted - measured = log(conj(q_measured) q_predicted)
//
// so that signs and lengths of quaternions, and how an orientation is written as three numbers, count for nothing.
#ifndef GAPSCOPE_EXPERIMENT_ORIENTATION_H_
#define GAPSCOPE_EXPERIMENT_ORIENTATION_H_

#include <array>
#include <vector>

#include "src/core/rotation.h"
#include "src/experiment/recording.h"
#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

inline constexpr int kTurns = 3, kQuaternion = 4;  // numbers of a rotation vector and of a quaternion

// The three signals of one orientation, which stand one after the other in the experiment, from `index` on. Errors: a
// row that is no unit quaternion, to a hundredth; those of ExtractColumn.
Result<std::array<Recording::Measured, kTurns>> BindOrientation(const Experiment& experiment, std::size_t index,
                                                                const Log& log, const Timeline& timeline,
                                                                const std::array<const Column*, kQuaternion>& columns,
                                                                std::vector<Finding>* findings);

// The orientation at a row, from the first of its three signals.
inline Quaternion OrientationAt(const Recording::Measured* turns, std::size_t row) {
  return turns->reference * ExpRotation({turns[0].values[row], turns[1].values[row], turns[2].values[row]});
}

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_ORIENTATION_H_
