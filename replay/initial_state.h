// Where a window starts, as the log has it.
#ifndef GAPSCOPE_REPLAY_INITIAL_STATE_H_
#define GAPSCOPE_REPLAY_INITIAL_STATE_H_

#include <span>
#include <vector>

#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope {

// Joints that are not measured start at the model's initial pose, at rest.
struct InitialState {
  std::vector<double> qpos, qvel;
};

// The model's initial pose, at rest.
InitialState AtRest(const Model& model);

// Half width of the fit that gives the initial state from a log (see FitLocally).
inline constexpr double kInitialFitHalfWidth_s = 0.02;

// The initial state at a row: measured joints from a local quadratic fit of their position (less their offset
// parameter) and its slope, or the measured velocity where only that exists; free bodies from their measured pose;
// joints that an effect added start with the joint they belong to.
InitialState InitialStateAt(const Model& model, const Recording& recording, std::size_t row,
                            std::span<const double> values);

// Writes pose and velocity of the free bodies whose pose the log measures: of its position, its orientation or both.
void PlaceFreeBodies(const Model& model, const Recording& recording, std::size_t row, std::span<const double> values,
                     std::span<double> qpos, std::span<double> qvel);

// Puts the bodies on `hold` whose pose the log measures where its first row has them. False: there are none, or they
// stand there already. MuJoCo's derived constants are left as they were (mj_setConst).
bool StandHeldBodies(const Model& model, const Recording& recording, std::span<const double> values, mjModel* written);

// Moves a free body that was placed by its sensors to where it is if its orientation's sensor is turned by `turn` more,
// in the sensor's own frame. `values`: those that it was placed with.
void Remount(const Model& model, const FreeStart& start, std::span<const double> values, const Vector3& turn,
             InitialState* state);

// Index in recording.measured of a signal of the experiment; -1: the log lacks it.
int FindMeasured(const Recording& recording, int index);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_INITIAL_STATE_H_
