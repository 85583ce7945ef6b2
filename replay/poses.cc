#include "replay/poses.h"

#include <algorithm>
#include <cmath>

namespace gapscope {
namespace {

enum class Which { kMeasured, kPredicted };

// Writes the joints that the log measures into `track`; rows without a value keep what they have (predicted) or lose
// their pose (measured).
void WriteMeasuredJoints(const Model& model, std::span<const double> values, const Recording& recording,
                         const LogReplay* replay, PoseTrack& track) {
  const std::size_t nq = track.nq();
  for (std::size_t s = 0; s < recording.measured.size(); ++s) {
    const SignalSource& source = model.source(recording.measured[s].index);
    if (!TraitsOf(source.kind).gives_angle) continue;
    const double offset = source.offset >= 0 ? values[source.offset] : 0;
    const std::vector<double>& column = replay ? replay->signals[s].predicted : recording.measured[s].values;
    for (std::size_t row = 0; row < track.time_s.size(); ++row) {
      double* qpos = track.qpos.data() + row * nq;
      if (replay && !std::isfinite(column[row])) continue;
      qpos[source.qpos] = column[row] - offset;
      for (const auto& [joint, from] : model.mirrored_joints()) {
        if (from == source.joint && !replay) qpos[model.compiled().jnt_qposadr[joint]] = qpos[source.qpos];
      }
    }
  }
}

bool IsPose(const double* qpos, std::size_t nq) {
  return std::all_of(qpos, qpos + nq, [](double q) { return std::isfinite(q); });
}

}  // namespace

PoseTrack PredictedPoses(const Model& model, std::span<const double> values, const Recording& recording,
                         const LogReplay& replay) {
  GS_CHECK(replay.qpos.size() == recording.rows() * static_cast<std::size_t>(model.compiled().nq));
  PoseTrack track{.time_s = recording.time_s, .qpos = replay.qpos};
  WriteMeasuredJoints(model, values, recording, &replay, track);
  return track;
}

PoseTrack MeasuredPoses(const Model& model, std::span<const double> values, const Recording& recording,
                        const PoseTrack& predicted) {
  PoseTrack track = predicted;
  // A simulation that ran away says nothing about joints that nobody measured: they stay where they were.
  const std::size_t nq = track.nq();
  for (std::size_t row = 0; row < track.time_s.size(); ++row) {
    for (std::size_t i = 0; i < nq; ++i) {
      double& q = track.qpos[row * nq + i];
      if (!std::isfinite(q)) q = row > 0 ? track.qpos[(row - 1) * nq + i] : model.compiled().qpos0[i];
    }
  }
  WriteMeasuredJoints(model, values, recording, nullptr, track);
  std::vector<double> speeds(static_cast<std::size_t>(model.compiled().nv));
  for (std::size_t row = 0; row < track.time_s.size() && !model.free_starts().empty(); ++row)
    PlaceFreeBodies(model, recording, row, values, std::span(track.qpos).subspan(row * nq, nq), speeds);
  return track;
}

bool PoseAt(const mjModel& model, const PoseTrack& track, double time_s, std::span<double> qpos) {
  const auto& time = track.time_s;
  const std::size_t nq = track.nq();
  GS_CHECK(nq == static_cast<std::size_t>(model.nq) && qpos.size() == nq);
  if (time.empty()) return false;
  const std::size_t after = static_cast<std::size_t>(std::upper_bound(time.begin(), time.end(), time_s) - time.begin());
  const std::size_t before = after > 0 ? after - 1 : 0;
  const double* a = track.qpos.data() + before * nq;
  if (!IsPose(a, nq)) return false;
  std::copy(a, a + nq, qpos.begin());
  if (after == 0 || after == time.size() || time_s <= time[before]) return true;
  const double* b = track.qpos.data() + after * nq;
  if (!IsPose(b, nq)) return true;
  const double share = (time_s - time[before]) / (time[after] - time[before]);
  std::vector<double> way(static_cast<std::size_t>(model.nv));
  mj_differentiatePos(&model, way.data(), 1, a, b);
  mj_integratePos(&model, qpos.data(), way.data(), share);
  return true;
}

}  // namespace gapscope
