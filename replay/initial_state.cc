#include "replay/initial_state.h"

#include <algorithm>
#include <cmath>

#include "src/experiment/local_fit.h"
#include "src/experiment/orientation.h"

namespace gapscope {
namespace {

// What the log says `later_s` after a row: a late sensor shows the row's own state only then.
LocalFit FitLater(const Sampled& samples, std::size_t row, double later_s) {
  if (later_s == 0) return FitLocally(samples, row, kInitialFitHalfWidth_s);
  const auto time = samples.time_s;
  const double at = time[row] + later_s;
  while (row + 2 < time.size() && time[row + 1] <= at) ++row;
  const LocalFit a = FitLocally(samples, row, kInitialFitHalfWidth_s);
  if (row + 1 >= time.size()) return a;
  const LocalFit b = FitLocally(samples, row + 1, kInitialFitHalfWidth_s);
  const double share = std::clamp((at - time[row]) / (time[row + 1] - time[row]), 0.0, 1.0);
  LocalFit between = a;
  between.value =
      (1 - share) * (a.value + a.slope * (at - time[row])) + share * (b.value + b.slope * (at - time[row + 1]));
  between.slope = (1 - share) * a.slope + share * b.slope;
  return between;
}

double DelayOf(const SignalSource& source, std::span<const double> values) {
  return source.delay >= 0 ? values[source.delay] : 0;
}
double OffsetOf(const SignalSource& source, std::span<const double> values) {
  return source.offset >= 0 ? values[source.offset] : 0;
}

// A body's pose and motion: velocity in the world, rate in the frame that `turn` is of.
struct BodyState {
  Vector3 place = {}, velocity = {};
  Quaternion turn = kNoRotation;
  Vector3 rate = {};
};

Vector3 Plus(const Vector3& a, const Vector3& b, double factor) {
  return {a[0] + factor * b[0], a[1] + factor * b[1], a[2] + factor * b[2]};
}

BodyState ReadBody(const FreeStart& start, std::span<const double> qpos, std::span<const double> qvel) {
  const double *q = qpos.data() + start.qpos, *v = qvel.data() + start.dof;
  return {.place = {q[0], q[1], q[2]},
          .velocity = {v[0], v[1], v[2]},
          .turn = {q[3], q[4], q[5], q[6]},
          .rate = {v[3], v[4], v[5]}};
}

void WriteBody(const FreeStart& start, const BodyState& body, std::span<double> qpos, std::span<double> qvel) {
  double *q = qpos.data() + start.qpos, *v = qvel.data() + start.dof;
  std::copy(body.place.begin(), body.place.end(), q);
  std::copy(body.turn.begin(), body.turn.end(), q + 3);
  std::copy(body.velocity.begin(), body.velocity.end(), v);
  std::copy(body.rate.begin(), body.rate.end(), v + 3);
}

// The rate of a frame that is mounted on another one: as that one sees it.
void TakeOff(const Quaternion& mounted, BodyState* body) {
  body->turn = Normalised(body->turn * Conjugate(mounted));
  body->rate = Rotate(mounted, body->rate);
}

// Between the body's origin (-1) and its position's sensor (+1), which ride on it.
void MoveAlong(const FreeStart& start, double factor, BodyState* body) {
  body->place = Plus(body->place, Rotate(body->turn, start.place), factor);
  body->velocity = Plus(body->velocity, Rotate(body->turn, Cross(body->rate, start.place)), factor);
}

// Rows around one, for local fits of what is computed from them: as far as FitLocally looks.
struct Around {
  std::size_t first = 0, last = 0;
};
Around RowsAround(const std::vector<double>& time, std::size_t row, double later_s) {
  constexpr double kReach_s = 0.1;
  constexpr std::size_t kFewest = 8;
  Around around{row, row};
  while (around.first > 0 && (time[row] - time[around.first - 1] <= kReach_s || row - around.first < kFewest))
    --around.first;
  while (around.last + 1 < time.size() &&
         (time[around.last + 1] - time[row] <= kReach_s + std::max(later_s, 0.0) || around.last - row < kFewest))
    ++around.last;
  return around;
}

// Orientation and rate at a row, in the sensor's frame: by local fits of the rotation vector since that row.
void FitTurn(const Recording& recording, const Recording::Measured* turns, std::size_t row, double later_s,
             BodyState* body) {
  const Around around = RowsAround(recording.time_s, row, later_s);
  const std::size_t count = around.last - around.first + 1;
  const Quaternion here = OrientationAt(turns, row);
  std::vector<double> since(3 * count);
  for (std::size_t k = 0; k < count; ++k) {
    const Vector3 turn = LogRotation(Conjugate(here) * OrientationAt(turns, around.first + k));
    for (std::size_t e = 0; e < 3; ++e) since[e * count + k] = turn[e];
  }
  Vector3 value = {}, slope = {};
  for (std::size_t e = 0; e < 3; ++e) {
    const Sampled samples{std::span(recording.time_s).subspan(around.first, count),
                          std::span(since).subspan(e * count, count), turns[e].spec.resolution};
    const LocalFit fit = FitLater(samples, row - around.first, later_s);
    value[e] = fit.value, slope[e] = fit.slope;
  }
  body->turn = here * ExpRotation(value);
  // The rate of exp(value) is its slope to first order in the value, which is the little way of a delay.
  body->rate = Plus(slope, Cross(value, slope), -0.5);
}

Vector3 MountOf(const Model& model, const FreeStart& start, std::span<const double> values) {
  Vector3 mount = {};
  for (std::size_t e = 0; e < 3; ++e)
    mount[e] = OffsetOf(model.source(static_cast<std::size_t>(start.rotation) + e), values);
  return mount;
}

// A row of a log, and the values that its sensors are read with.
struct LogAt {
  const Model& model;
  const Recording& recording;
  std::size_t row;
  std::span<const double> values;
};

// Where the log has a body; what it does not measure of it is as it was.
BodyState Placed(const LogAt& at, const FreeStart& start, BodyState body) {
  const auto& [model, recording, row, values] = at;
  const int rotation = FindMeasured(recording, start.rotation), place = FindMeasured(recording, start.position[0]);
  if (rotation >= 0) {
    const auto* turns = recording.measured.data() + rotation;
    FitTurn(recording, turns, row, DelayOf(model.source(turns->index), values), &body);
    TakeOff(start.mounted * ExpRotation(MountOf(model, start, values)), &body);
  }
  for (std::size_t i = 0; i < 3 && place >= 0; ++i) {
    const auto& measured = recording.measured[static_cast<std::size_t>(FindMeasured(recording, start.position[i]))];
    const SignalSource& source = model.source(measured.index);
    const LocalFit fit = FitLater(SampledOf(recording, measured), row, DelayOf(source, values));
    body.place[i] = fit.value - OffsetOf(source, values);
    body.velocity[i] = fit.slope;
  }
  if (place >= 0) MoveAlong(start, -1, &body);
  return body;
}

}  // namespace

int FindMeasured(const Recording& recording, int index) {
  for (std::size_t s = 0; s < recording.measured.size() && index >= 0; ++s) {
    if (recording.measured[s].index == static_cast<std::size_t>(index)) return static_cast<int>(s);
  }
  return -1;
}

InitialState AtRest(const Model& model) {
  const mjModel& m = model.compiled();
  return {.qpos = {m.qpos0, m.qpos0 + m.nq}, .qvel = std::vector<double>(static_cast<std::size_t>(m.nv), 0.0)};
}

void PlaceFreeBodies(const Model& model, const Recording& recording, std::size_t row, std::span<const double> values,
                     std::span<double> qpos, std::span<double> qvel) {
  const LogAt at{model, recording, row, values};
  for (const FreeStart& start : model.free_starts())
    WriteBody(start, Placed(at, start, ReadBody(start, qpos, qvel)), qpos, qvel);
}

bool StandHeldBodies(const Model& model, const Recording& recording, std::span<const double> values, mjModel* written) {
  bool moved = false;
  for (const FreeStart& start : model.held_starts()) {
    const double *place = model.compiled().body_pos + 3 * start.body,
                 *turn = model.compiled().body_quat + 4 * start.body;
    const BodyState body =
        Placed({model, recording, 0, values}, start,
               {.place = {place[0], place[1], place[2]}, .turn = {turn[0], turn[1], turn[2], turn[3]}});
    double *pos = written->body_pos + 3 * start.body, *quat = written->body_quat + 4 * start.body;
    moved = moved || !std::ranges::equal(body.place, std::span(pos, 3)) ||
            !std::ranges::equal(body.turn, std::span(quat, 4));
    std::ranges::copy(body.place, pos);
    std::ranges::copy(body.turn, quat);
  }
  return moved;
}

void Remount(const Model& model, const FreeStart& start, std::span<const double> values, const Vector3& turn,
             InitialState* state) {
  if (turn == Vector3{}) return;
  const Quaternion before = start.mounted * ExpRotation(MountOf(model, start, values)),
                   after = before * ExpRotation(turn);
  BodyState body = ReadBody(start, state->qpos, state->qvel);
  const bool placed = start.position[0] >= 0;
  if (placed) MoveAlong(start, 1, &body);
  TakeOff(Conjugate(before), &body);  // as the sensor has it
  TakeOff(after, &body);
  if (placed) MoveAlong(start, -1, &body);
  WriteBody(start, body, state->qpos, state->qvel);
}

InitialState InitialStateAt(const Model& model, const Recording& recording, std::size_t row,
                            std::span<const double> values) {
  const mjModel& m = model.compiled();
  InitialState state = AtRest(model);
  std::vector<bool> known(m.nv, false);
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model.source(measured.index);
    if (!TraitsOf(source.kind).gives_angle) continue;
    const LocalFit fit = FitLater(SampledOf(recording, measured), row, DelayOf(source, values));
    state.qpos[source.qpos] = fit.value - OffsetOf(source, values);
    state.qvel[source.dof] = fit.slope;
    known[source.dof] = true;
  }
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model.source(measured.index);
    if (!TraitsOf(source.kind).gives_speed || known[source.dof]) continue;
    state.qvel[source.dof] = FitLater(SampledOf(recording, measured), row, DelayOf(source, values)).value;
  }
  PlaceFreeBodies(model, recording, row, values, state.qpos, state.qvel);
  for (const auto& [joint, from] : model.mirrored_joints()) {
    state.qpos[m.jnt_qposadr[joint]] = state.qpos[m.jnt_qposadr[from]];
    state.qvel[m.jnt_dofadr[joint]] = state.qvel[m.jnt_dofadr[from]];
  }
  return state;
}

}  // namespace gapscope
