// Why an effect is believed: the torque that it adds along a log, beside the torque that is missing without it. Where
// the two curves lie on each other the effect does what the mechanism does.
#ifndef GAPSCOPE_COMPARE_TORQUE_CURVE_H_
#define GAPSCOPE_COMPARE_TORQUE_CURVE_H_

#include <optional>
#include <string>
#include <vector>

#include "src/compare/residual_torque.h"

namespace gapscope {

// Means over bins of one coordinate of a joint, each with about as many rows; empty bins are left out.
struct TorqueCurve {
  enum class Over { kAngle, kSpeed };
  std::string joint;
  Over over = Over::kAngle;
  std::vector<double> at;                 // mean of the coordinate in each bin, rad or rad/s
  std::vector<double> missing_n_m;        // without the effect: what the motion needs beyond the model
  std::vector<double> low_n_m, high_n_m;  // two thirds of the bin's rows lie between
  std::vector<double> effect_n_m;         // what the effect adds
};

// Both of the same log and parameters, by models without and with the effect. Of the joint on which the effect's torque
// is largest beside what is missing there; over its angle or its speed, whichever the effect's torque changes more
// with. Nothing: the effect changes no torque (a late sensor of several), or the torques are not known.
std::optional<TorqueCurve> CompareTorques(const std::vector<ResidualTorque>& without,
                                          const std::vector<ResidualTorque>& with, std::size_t bins);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_TORQUE_CURVE_H_
