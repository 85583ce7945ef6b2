// The past of a drive or a sensor, kept in `mjData.plugin_state` so that mj_resetData, mj_setState and mj_copyData
// treat it like any other state.
//
// A ring of samples (t, q, qdot, ctrl...) at the starts of past steps, and the sample of the step that is open now: the
// engine's `compute` opens a step, `advance` closes it, so RK4's four computes make one sample. Times may be irregular.
//   motion at t - D   q by cubic Hermite through (q, qdot) of the two samples around it, the present being the last
//                     one; qdot linearly (the cubic's own derivative swings within a step where the integrator's q and
//                     qdot disagree by its O(h), and the gradient in D with it). Before the oldest sample q goes on
//                     linearly with that sample's qdot; right after a reset that sample is the present
//   command at t - D  zero-order hold of what was sent; over a step its exact mean on [t0 - D, t0 + h - D], so that a
//                     delay of whole steps is exact and a delay in between has a gradient; before the oldest sample
//                     the oldest command
// Sources: Hermite interpolation, de Boor, "A Practical Guide to Splines", ch. IV; the mean over a step is the impulse
// that a held and shifted command gives to an inertia.
#ifndef GAPSCOPE_PLUGINS_MOTOR_HISTORY_H_
#define GAPSCOPE_PLUGINS_MOTOR_HISTORY_H_

#include <mujoco/mujoco.h>

#include <algorithm>
#include <cmath>

namespace gapscope::plugins {

// How long a history is where nothing else is said: as the longest delays that gapscope's effects may have, a late
// command and a late torque together.
inline constexpr double kDefaultMaxDelay_s = 0.13;

struct Motion {
  double q, qdot;
};

// A view on `Size(capacity, inputs)` doubles that the caller owns; all zero is an empty history.
// Layout: [count, next, capacity x (t, q, qdot, ctrl...), open step's (t, q, qdot, ctrl...)].
class History {
 public:
  History(double* state, int capacity, int inputs)
      : state_(state), capacity_(capacity), stride_(kFixed + inputs), inputs_(inputs) {}

  static int Size(int capacity, int inputs) { return kHeader + (capacity + 1) * (kFixed + inputs); }
  // The capacity of a history that takes `size` doubles; 0 when there is none.
  static int Capacity(int size, int inputs) { return std::max(0, (size - kHeader) / (kFixed + inputs) - 1); }

  int capacity() const { return capacity_; }
  int count() const { return static_cast<int>(state_[0]); }
  void Clear() { state_[0] = state_[1] = 0; }

  // Appends a sample; the oldest one makes room. `ctrl`: one value per input, held from t on. Times ascend.
  // A host that starts in the middle of a log pushes what the log holds before the start, latest time last.
  void Push(double t, double q, double qdot, const double* ctrl) {
    Write(Row(static_cast<int>(state_[1])), t, q, qdot, ctrl);
    Step();
  }

  // Begins the step at time t (again, if it was begun before). Samples at or after t are from a future that the host
  // has undone: they go.
  void Open(double t, double q, double qdot, const double* ctrl) {
    while (count() > 0 && Sample(count() - 1)[0] >= t) {
      state_[0] -= 1;
      state_[1] = state_[1] == 0 ? capacity_ - 1 : state_[1] - 1;
    }
    Write(OpenRow(), t, q, qdot, ctrl);
  }
  // Ends the step: its sample joins the past.
  void Close() {
    std::copy_n(OpenRow(), stride_, Row(static_cast<int>(state_[1])));
    Step();
  }

  // The motion at `now_t - delay`, when `now` is the motion at now_t, at or after the open step's start.
  Motion MotionAt(double delay, double now_t, Motion now, double step) const {
    if (!(delay > 0)) return now;
    const double t = now_t - delay;
    const double* open = OpenRow();
    if (t >= open[0]) return Between(open, now_t, now, t);
    const int k = Find(t, step);
    if (k < 0) {
      const double* oldest = count() > 0 ? Sample(0) : open;
      return {oldest[1] + oldest[2] * (t - oldest[0]), oldest[2]};
    }
    const double* next = k + 1 < count() ? Sample(k + 1) : open;
    return Between(Sample(k), next[0], {next[1], next[2]}, t);
  }

  // The mean over [t0 - delay, t0 + step - delay] of each held command, t0 the open step's start.
  void MeanCommand(double delay, double step, double* mean) const {
    const double* open = OpenRow();
    if (!(delay > 0)) {
      std::copy_n(open + kFixed, inputs_, mean);
      return;
    }
    const double begin = open[0] - delay, end = begin + step;
    const double negligible = 1e-9 * step;  // rounding of time stamps, so that whole steps are exact
    // Segments from the latest: the open step's command, then those of the past; the oldest one reaches back for ever.
    int k = end - negligible > open[0] ? count() : Find(end - negligible, step);
    double upper = end;
    std::fill_n(mean, inputs_, 0.0);
    while (true) {
      const double* row = k >= count() || count() == 0 ? open : Sample(std::max(k, 0));
      const double lower = k <= 0 ? begin : std::max(row[0], begin);
      const bool last = k <= 0 || lower <= begin + negligible;
      const double weight = ((last ? begin : lower) - upper) / (begin - end);
      for (int i = 0; i < inputs_; ++i) mean[i] += weight * row[kFixed + i];
      if (last) return;
      upper = lower;
      --k;
    }
  }

 private:
  static constexpr int kHeader = 2, kFixed = 3;

  double* Row(int index) const { return state_ + kHeader + index * stride_; }
  double* OpenRow() const { return Row(capacity_); }
  // Sample k of count(), 0 the oldest.
  const double* Sample(int k) const {
    int index = static_cast<int>(state_[1]) - count() + k;
    return Row(index < 0 ? index + capacity_ : index);
  }
  void Write(double* row, double t, double q, double qdot, const double* ctrl) const {
    row[0] = t, row[1] = q, row[2] = qdot;
    if (ctrl) std::copy_n(ctrl, inputs_, row + kFixed);  // null: an encoder has no inputs
  }
  void Step() {
    state_[1] = state_[1] + 1 < capacity_ ? state_[1] + 1 : 0;
    state_[0] = std::min<double>(state_[0] + 1, capacity_);
  }
  // The latest sample at or before t; -1 when all are later. Starts from a guess at even steps.
  int Find(double t, double step) const {
    const int n = count();
    if (n == 0) return -1;
    const double back = (Sample(n - 1)[0] - t) / step;
    int k = back > 0 ? n - 1 - static_cast<int>(std::min<double>(back, n - 1)) : n - 1;
    while (k >= 0 && Sample(k)[0] > t) --k;
    while (k + 1 < n && Sample(k + 1)[0] <= t) ++k;
    return k;
  }
  static Motion Between(const double* a, double b_t, Motion b, double t) {
    const double dt = b_t - a[0];
    if (!(dt > 0)) return b;
    const double s = (t - a[0]) / dt, r = 1 - s;
    return {r * r * (1 + 2 * s) * a[1] + s * s * (1 + 2 * r) * b.q + s * r * dt * (r * a[2] - s * b.qdot),
            r * a[2] + s * b.qdot};
  }

  double* state_;
  int capacity_, stride_, inputs_;
};

// Where the state of a gapscope.motor instance lies in `d->plugin_state`, for hosts.
struct MotorState {
  // Slots before the history.
  enum Slot { kEstimate, kPrimed, kStepOpen, kStepTime, kSlots };

  double* slots = nullptr;
  int capacity = 0;  // of the history; 0: it keeps none
  int inputs = 0;    // the instance's actuators

  // The drive's own torque estimate [N m] at the start of the latest step: after delay, lag, dead zone and limits,
  // before torque-constant droop, asymmetry and gear efficiency.
  double estimate_n_m() const { return slots[kEstimate]; }
  History history() const { return History(slots + kSlots, capacity, inputs); }
  // Keeps what the host wrote to `d->act` as the lag's and the sag's state. Without this the first compute after
  // mj_resetData starts them at rest: the lag at the present request, the sag at the present load.
  void MarkPrimed() const { slots[kPrimed] = 1; }
};

// The state of plugin instance `instance` (of mj_name2id(m, mjOBJ_PLUGIN, name)), which is a gapscope.motor.
inline MotorState FindMotorState(const mjModel* m, mjData* d, int instance) {
  MotorState state;
  state.slots = d->plugin_state + m->plugin_stateadr[instance];
  for (int i = 0; i < m->nactuator; ++i) state.inputs += m->actuator_plugin[i] == instance;
  state.capacity = History::Capacity(m->plugin_statenum[instance] - MotorState::kSlots, state.inputs);
  return state;
}

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_MOTOR_HISTORY_H_
