// Poses of a mechanism over a recording: what the log measured and what a replay predicted, read at any time between
// the stamps.
#ifndef GAPSCOPE_REPLAY_POSES_H_
#define GAPSCOPE_REPLAY_POSES_H_

#include <span>
#include <vector>

#include "replay/replay.h"

namespace gapscope {

// qpos (mj_model.nq numbers) at each stamp, row by row. A row with NaN in it has no pose (diverged, or no measurement).
struct PoseTrack {
  std::vector<double> time_s;
  std::vector<double> qpos;
  std::size_t nq() const { return time_s.empty() ? 0 : qpos.size() / time_s.size(); }
};

// `replay`, made with ReplayOptions::keep_poses of the same model and values, so that measured joints stand exactly
// where the predicted signal says (with its sensor's delay, without its zero offset), the others where the simulation
// had them.
PoseTrack PredictedPoses(const Model& model, std::span<const double> values, const Recording& recording,
                         const LogReplay& replay);

// Measured joints where the log says (without the zero offset of `values`), the others as in `predicted`, of the same
// recording and model.
PoseTrack MeasuredPoses(const Model& model, std::span<const double> values, const Recording& recording,
                        const PoseTrack& predicted);

// The pose at `time_s` by interpolation between the stamps around it (along the shortest way where a joint has a
// quaternion), held beyond the ends. Where the later stamp has no pose, the earlier one stays. `qpos` has model.nq
// numbers. Returns false, leaving `qpos` alone, where there is no pose.
bool PoseAt(const mjModel& model, const PoseTrack& track, double time_s, std::span<double> qpos);

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_POSES_H_
