// Unit, sign and scale of each column: as its name or file states them, by regression against the columns that it must
// agree with, by the joint's range, else as is usual.
#ifndef GAPSCOPE_DRAFT_SCALING_H_
#define GAPSCOPE_DRAFT_SCALING_H_

#include <mujoco/mujoco.h>

#include <string>
#include <vector>

#include "src/draft/pairing.h"

namespace gapscope {

struct Scaling {
  std::string unit = "1";
  double scale = 1, add = 0;  // SI = unit * scale * raw + add
  double factor = 1;          // of both, SI per raw unit
  bool certain = false;
  bool by_data = false;  // a regression gave it
  bool is_unit = false;  // and it is a unit, not a scale of its own
  std::string doubt;     // one sentence; empty: none
};

struct Scalings {
  std::vector<Scaling> positions, velocities;  // per joint of the pairing
  std::vector<Scaling> commands, torques;      // per actuator
};

// Columns of one family (pos_meas1, pos_meas2 ...) have one unit.
Scalings ScaleColumns(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses,
                      const Pairing& pairing);

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_SCALING_H_
