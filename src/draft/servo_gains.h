// Gains of a position servo from a log: of its torque where that is measured, else of the torque that the motion takes
// by the model's inverse dynamics.
#ifndef GAPSCOPE_DRAFT_SERVO_GAINS_H_
#define GAPSCOPE_DRAFT_SERVO_GAINS_H_

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "src/draft/scaling.h"

namespace gapscope {

struct ServoGains {
  double kp = 0, kd = 0;  // N m/rad, N m s/rad
  double limit = 0;       // N m; 0: none is known
  double armature = 0;    // kg m^2; 0: the MJCF's
  std::string from;       // where they come from, for a comment
  std::string doubt;      // why one may not trust them, a sentence for all servos; empty: none
  bool certain = false;   // nothing speaks against them
  bool armature_made_up = false;
};

// One for each actuator of the pairing; of those that are proposed as position servos, else of velocity servos kd
// alone. torque = kp (target - angle) - kd speed + c is fitted by least squares; of the torque that the motion takes
// friction and an armature are left to the servo. A fit counts that explains 80 % of the torque's variance with kp
// known to a fifth. Else gains are made up: 5 Hz, critically damped, and stiff enough that gravity bends the joint by
// less than 0.1 rad. `logs`: one or more with the same columns and step.
std::vector<ServoGains> FitServos(const mjModel& model, const std::vector<const Samples*>& logs,
                                  const std::vector<Guess>& guesses, const Pairing& pairing, const Scalings& scalings);

// A servo turns a rotor that an MJCF of bodies alone leaves out. Without it, light links under stiff servos are more
// than a time step can follow: such joints get as much armature as makes them slow enough.
void AddArmature(const mjModel& model, const Pairing& pairing, std::vector<ServoGains>* gains);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_SERVO_GAINS_H_
