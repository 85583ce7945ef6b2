#include "src/export/target.h"

namespace gapscope {

// Source: mujoco-mjx 3.17 _src/types.py (no DCMOTOR), passive.py and forward.py (delay and polynomials are stored and
// never read).
ExportTarget Target_mjx() {
  return {.name = "mjx",
          .what = "MJX 3.17 and Playground",
          .has = {.passive_motors = PassiveMotors::kNone, .delays = CommandDelays::kNone, .polynomials = false}};
}

}  // namespace gapscope
