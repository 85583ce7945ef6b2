// What every direct identification gives: values with intervals, how well the relation holds, and what to think of it.
#ifndef GAPSCOPE_IDENTIFY_IDENTIFICATION_H_
#define GAPSCOPE_IDENTIFY_IDENTIFICATION_H_

#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/log/log.h"

namespace gapscope {

struct Estimate {
  std::string name, unit;
  double value = 0, low = 0, high = 0;  // 95 % interval; NaN bounds: none could be computed
};

// Points behind the values, for tables and plots. Cells that do not exist are NaN.
struct PointTable {
  std::string name;
  std::vector<std::string> columns;
  std::vector<std::vector<double>> rows;
};

struct Identification {
  std::string method;    // "pd"
  std::string relation;  // the equation, in the names of `values`
  std::vector<Estimate> values;
  double r2 = 0, rmse = 0;           // of the relation, over the rows used
  std::string unit;                  // of rmse
  std::size_t rows = 0;              // used
  std::vector<std::string> remarks;  // one sentence each: what to beware of
  std::vector<PointTable> tables;

  const Estimate* Find(const std::string& name) const {
    for (const auto& value : values) {
      if (value.name == name) return &value;
    }
    return nullptr;
  }
};

struct IdentifyInput {
  const Model& model;
  const std::vector<double>& values;         // of the model's parameters
  const std::vector<Recording>& recordings;  // at least one
};

struct IdentifyOptions {
  double cutoff_hz = 0;         // of the zero-phase low pass; 0: a twelfth of the sample rate, at most 15 Hz
  double from_s = 0, to_s = 0;  // part of the logs; to 0: their end
  std::string joint;            // empty: the method's own choice
  std::string current_column = "current_a", current_unit = "A";
  double longest_delay_s = 0.05;  // pd
  double torque_limit = 0;        // pd: rows at or above it are left out; 0: runs of equal extreme values
  double torque_delay_s = 0;  // of a servo whose torque is logged (identify pd): which target a logged torque has seen
  double coulomb_n_m = -1;    // steady: held at this; below zero: fitted
  bool free_inertia = false;  // friction, cable: scale the model's inertial torques to the log instead of trusting them
  double rated_torque_n_m = 0, rated_speed_rad_per_s = 0;  // tn-curve: a data sheet's point to compare with
  double bounds_share = 0.5;                               // state-space: coefficients within this share of nominal
  std::vector<std::size_t> held_out;                       // state-space: logs that are scored, not fitted
};

// torque = kp (target - q) - kd dq, all of it `delay_s` late. Needs a servo's target, position and torque (or duty).
Result<Identification> IdentifyPd(const IdentifyInput& input, const IdentifyOptions& options);
// torque = kt current (1 - droop |current| / peak). Needs torque and a current column.
Result<Identification> IdentifyTorqueConstant(const IdentifyInput& input, const IdentifyOptions& options);
// The envelope of torque against speed. Needs torque and speed (or position).
Result<Identification> IdentifyTnCurve(const IdentifyInput& input, const IdentifyOptions& options);
// Drive torque less inertia, gravity and springs of the model, against speed.
Result<Identification> IdentifyFriction(const IdentifyInput& input, const IdentifyOptions& options);
// current = voltage / resistance + offset at standstill: all, positive, negative voltages.
Result<Identification> IdentifyResistance(const IdentifyInput& input, const IdentifyOptions& options);
// Mean current without voltage and motion.
Result<Identification> IdentifyCurrentOffset(const IdentifyInput& input, const IdentifyOptions& options);
// dd = -w^2 sin(q - rest) - damping dq - friction sign(dq), or -w^2 (q - rest) on a spring.
Result<Identification> IdentifyRingDown(const IdentifyInput& input, const IdentifyOptions& options);
// Own inertia of the driven joint from drive torque and acceleration.
Result<Identification> IdentifyInertia(const IdentifyInput& input, const IdentifyOptions& options);
// Equivalent viscous damping from speeds that have settled.
Result<Identification> IdentifySteady(const IdentifyInput& input, const IdentifyOptions& options);
// Peak of a flexible joint's response, its stiffness and damping.
Result<Identification> IdentifyResonance(const IdentifyInput& input, const IdentifyOptions& options);
// Discrete state space of a flexible joint by constrained convex least squares.
Result<Identification> IdentifyStateSpace(const IdentifyInput& input, const IdentifyOptions& options);
// Spring of a cable on the driven joint, and its rest angle, with the spread over repeats.
Result<Identification> IdentifyCable(const IdentifyInput& input, const IdentifyOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_IDENTIFY_IDENTIFICATION_H_
