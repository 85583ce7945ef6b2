// What kind of drive an actuator is: the one answer to "is this a servo", and to "does this switch a drive off".
#ifndef GAPSCOPE_MODEL_DRIVE_FACTS_H_
#define GAPSCOPE_MODEL_DRIVE_FACTS_H_

#include <mujoco/mujoco.h>

#include <string>

namespace gapscope {

struct DriveFacts {
  bool feeds_back_position = false;  // its law does: a servo, whatever its gains
  bool holds_position = false;       // and its gain is not zero in this model, so that it holds its joint
  bool enables = false;              // it is a drive's input `enable`: while it is zero the drive gives no torque
  std::string input = "";            // which of a gapscope.motor's inputs it is, as `inputs` names it; empty: none
};

// Of a native actuator by its bias, of a gapscope.motor by its law (src/plugins/motor/README.md), of another plugin
// nothing is known.
DriveFacts FactsOf(const mjModel& model, int actuator);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_DRIVE_FACTS_H_
