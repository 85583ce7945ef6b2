// State feedback from an estimated state: an observer that the rig's own controller runs.
#ifndef GAPSCOPE_REPLAY_OBSERVER_H_
#define GAPSCOPE_REPLAY_OBSERVER_H_

#include <Eigen/Core>
#include <span>

namespace gapscope {

// x^' = A x^ + B u + L (y - C x^), u = -K (x^ - x_r), C x_r = references (least norm). L from a Kalman filter or from
// placed poles (Luenberger): `gapscope::KalmanGain`, `ObserverGain`. a: n x n, b: n, c: inputs x n, gain (L): n x
// inputs, feedback (K): n.
struct ObserverSpec {
  Eigen::MatrixXd a, c, gain;
  Eigen::VectorXd b, feedback;
};

// Solved exactly between two samples, readings and command held (augmented matrix exponential; Franklin, Powell,
// Workman, Digital Control of Dynamic Systems, 4.3).
class Observer {
 public:
  explicit Observer(ObserverSpec spec);
  // The state that the readings show, at rest.
  void Reset() { settled_ = false; }
  // The law's output after `period_s` under the command `sent`, with these readings and references at its end.
  double Step(std::span<const double> readings, std::span<const double> references, double sent, double period_s);
  const Eigen::VectorXd& state() const { return state_; }

 private:
  void Discretise(double period_s);

  ObserverSpec spec_;
  Eigen::MatrixXd left_inverse_;  // of C
  Eigen::MatrixXd step_, read_;   // x^ <- step x^ + push u + read y
  Eigen::VectorXd push_, state_, next_, wanted_, readings_, references_;
  double period_s_ = 0;
  bool settled_ = false;
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_OBSERVER_H_
