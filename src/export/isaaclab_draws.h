// Joint draws in what is written for Isaac Lab: each environment has a row of randomization.npz.
#ifndef GAPSCOPE_EXPORT_ISAACLAB_DRAWS_H_
#define GAPSCOPE_EXPORT_ISAACLAB_DRAWS_H_

#include <string>
#include <vector>

#include "src/export/isaaclab.h"

namespace gapscope {

// A member of ACTUATORS and its joint.
struct DrawnDrive {
  std::string name;
  int joint = -1;
  bool late = false, by_law = false;
};

// Parts of the file. No functions: nothing of it is drawn, and the terms say what varies.
struct IsaacLabDraws {
  std::string functions;  // what the events call
  std::string terms;      // DRAWS, and DRAWN_ACTUATORS where a delay is drawn
  bool late = false;      // a delay is drawn: the actuators must be Isaac Lab's own in Python
};
IsaacLabDraws WriteIsaacLabDraws(const TargetInput& input, const IsaacLabNames& names,
                                 const std::vector<DrawnDrive>& drives);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPORT_ISAACLAB_DRAWS_H_
