// What the model says about torques at a measured motion: the drive's, and what inertia, gravity, springs and
// neighbouring links ask for.
#ifndef GAPSCOPE_IDENTIFY_TORQUE_H_
#define GAPSCOPE_IDENTIFY_TORQUE_H_

#include <vector>

#include "src/identify/filter.h"

namespace gapscope {

// A log's motion behind the low pass, one entry per grid row; NaN where it is not known.
struct Motion {
  std::vector<double> time_s;
  std::vector<double> angle_rad, speed_rad_per_s, acceleration_rad_per_s2;  // of the joint in question
  std::vector<double> drive_n_m;  // torque of the drive on that joint: logged where the log has it, else the model's at
                                  // the logged command
  std::vector<double>
      demand_n_m;  // what the rest asks for: M a + bias - springs, without dry and viscous friction of that joint
  std::vector<double> others_n_m;  // demand without the joint's own inertia (its body and armature)
  bool torque_logged = false;
};

// Errors: the joint's angle is not logged; another joint of the model that is not logged moves it.
Result<Motion> MotionOf(const IdentifyInput& input, std::size_t log, int joint, const IdentifyOptions& options);

// True where the joint slides: |speed| above `least` now, and `quick` (the speed behind a wider low pass, same grid) of
// its sign over `reach` rows to both sides.
std::vector<char> Sliding(const std::vector<double>& speed, const std::vector<double>& quick, double least_rad_per_s,
                          std::size_t reach);

}  // namespace gapscope

#endif  // GAPSCOPE_IDENTIFY_TORQUE_H_
