// Signals of a log on a regular grid behind one zero-phase low pass, with derivatives.
//
// The filter is a Gaussian, the same one for every channel: what is linear in the signals holds for the filtered
// signals exactly, so that filtering costs no bias, and a derivative is that of the filtered signal. Quantised angles
// give usable speeds and accelerations this way without any delay.
#ifndef GAPSCOPE_IDENTIFY_FILTER_H_
#define GAPSCOPE_IDENTIFY_FILTER_H_

#include <vector>

#include "src/experiment/recording.h"
#include "src/identify/identification.h"

namespace gapscope {

class SmoothLog {
 public:
  // Rows of `recording` between the times of `options`, at its median step; cut-off (-3 dB) of `options`.
  SmoothLog(const Recording& recording, const IdentifyOptions& options);

  double dt_s() const { return dt_; }
  double cutoff_hz() const { return cutoff_hz_; }
  std::size_t size() const { return rows_; }
  double time_s(std::size_t i) const { return begin_ + static_cast<double>(i) * dt_; }

  // `order` 0, 1, 2: the filtered signal or its derivative at each grid time less `late_s`. NaN near the ends and near
  // missing values. Sampled: linear between stamps. Held: from stamp to stamp.
  std::vector<double> Sampled(const std::vector<double>& values, int order, double late_s = 0) const;
  std::vector<double> Held(const std::vector<double>& values, double late_s = 0) const;
  // A signal that is already on the grid.
  std::vector<double> OnGrid(const std::vector<double>& grid, int order, double late_s = 0) const;
  std::vector<double> GridOf(const std::vector<double>& values, bool held) const;
  // What is held just before each grid time less `late_s`: a row's own command acts after its stamp.
  std::vector<double> HeldBefore(const std::vector<double>& values, double late_s) const;

  // Grid rows that no stamp of a regular log stands for: ticks that were missed. Empty when the log is irregular all
  // over.
  std::vector<std::size_t> Missed() const;

  // How many grid rows an estimate made with the filter reaches to either side.
  std::size_t reach() const { return reach_; }

 private:
  const Recording& recording_;
  double dt_ = 0, begin_ = 0, sigma_ = 0, cutoff_hz_ = 0;
  std::size_t rows_ = 0, reach_ = 0;
};

// The cut-off, at most that of SmoothLog, at which the sensors' noise is below `share` of the variance of the
// derivative of `order` of the joint's angle in every log: a regressor with noise in it makes its coefficient too small
// by that share. `options.cutoff_hz` where it is given. At least 0.5 Hz.
double QuietCutoff(const IdentifyInput& input, int joint, int order, double share, const IdentifyOptions& options);

// Variance of the sensors' noise in the filtered derivative of `order` of a joint's angle, mean over the logs.
double NoiseVariance(const IdentifyInput& input, int joint, int order, const IdentifyOptions& options);

// The measured signal of a kind on a joint (or, for a torque, on an actuator of it); null: none.
const Recording::Measured* FindSignal(const Model& model, const Recording& recording, SignalKind kind, int joint);
// The joint that the first command drives, or the one of that name. Error: no such joint, none driven.
Result<int> DrivenJoint(const Model& model, const std::string& name);
std::string JointName(const Model& model, int joint);
// A column of the log behind a recording that the experiment does not bind, on the recording's rows. Errors: not there,
// unknown unit.
Result<std::vector<double>> ExtraColumn(const Model& model, const Recording& recording, const std::string& column,
                                        const std::string& unit);

}  // namespace gapscope

#endif  // GAPSCOPE_IDENTIFY_FILTER_H_
