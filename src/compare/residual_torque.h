// What torque is missing: the torque that would make the model move as the log did, less what the model gives. Mapped
// over angle and speed it shows the form of a missing effect: a step across zero speed is dry friction, a slope along
// the angle a spring.
#ifndef GAPSCOPE_COMPARE_RESIDUAL_TORQUE_H_
#define GAPSCOPE_COMPARE_RESIDUAL_TORQUE_H_

#include <span>
#include <string>
#include <vector>

#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope {

struct ResidualTorque {
  std::string joint;
  std::vector<double> angle_rad, speed_rad_per_s, torque_n_m;  // one per row that was used
};

// For each joint with a measured position: inverse dynamics of the measured motion (angle, speed and acceleration by
// local fits over +-20 ms) less the actuators' torque under the logged commands, over the same time, at most about
// `most_rows` rows evenly spread. Delays, lags and a supply remember what the log says of the time before. A row has
// the torques of all joints. Empty when a joint of the model is not measured: its motion is not known.
std::vector<ResidualTorque> EstimateResidualTorque(const Model& model, std::span<const double> values,
                                                   const Recording& recording, std::size_t most_rows = 20000);

// Means over a grid of angle and speed.
struct TorqueMap {
  std::string joint;
  std::vector<double> angle_edges_rad, speed_edges_rad_per_s;
  std::vector<double> mean_n_m;  // by speed, then angle; NaN: fewer than `least` rows in the cell
  std::vector<std::size_t> rows;
};
TorqueMap MapTorque(const ResidualTorque& residual, std::size_t angles, std::size_t speeds, std::size_t least = 3);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_RESIDUAL_TORQUE_H_
