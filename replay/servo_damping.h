// Servos that a plugin stands for, in steps of first order: what makes them bear stiff damping.
#ifndef GAPSCOPE_REPLAY_SERVO_DAMPING_H_
#define GAPSCOPE_REPLAY_SERVO_DAMPING_H_

#include <vector>

#include "src/model/model.h"

namespace gapscope {

// A plugin's forces are explicit in speed, and an explicit step does not bear a damping that is gone within it. Held,
// the damping of each servo that a plugin stands for is its joint's, in which steps are implicit, and a torque against
// it is applied: the motion is the same but for the step's own error.
class ServoDamping {
 public:
  // As the servos of the MJCF have it before effects. By Runge-Kutta, which evaluates forces within a step: none.
  ServoDamping(const Model& model, const mjModel& mujoco);

  void Hold(mjModel* m);
  void Release(mjModel* m);
  // Of the speeds now, where it is held; else nothing.
  void Apply(mjData* d) const;
  bool held() const { return held_; }

 private:
  struct Servo {
    int dof;
    double damping, of_joint = 0;  // N m s/rad: its own; the joint's, while held
  };
  std::vector<Servo> servos_;
  bool held_ = false;
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_SERVO_DAMPING_H_
