// gapscope.encoder: a joint's angle as an encoder and its drive report it, as a sensor plugin.
//
// delay -> offset -> quantisation, and, when asked for, the speed that the drive computes from those readings: their
// difference over the step through a first-order filter. Equations and attributes: README.md.
#ifndef GAPSCOPE_PLUGINS_ENCODER_ENCODER_H_
#define GAPSCOPE_PLUGINS_ENCODER_ENCODER_H_

#include <mujoco/mujoco.h>

#include <memory>
#include <string>

#include "src/plugins/common/parameters.h"
#include "src/plugins/motor/history.h"

namespace gapscope::plugins {

// Resolved once per mjData; all that changes is in plugin_state.
class Encoder {
 public:
  enum Parameter { kResolution, kOffset, kDelay, kTimeConstant, kParameters };
  static constexpr std::array<ParameterSpec, kParameters> kSpecs = {{
      {"resolution_rad", "rad", 0, 0, 10},
      {"offset_rad", "rad", 0, -1e6, 1e6},
      {"delay_s", "s", 0, 0, 10},
      {"time_constant_s", "s", 0, 0, 1e3},
  }};

  // Null when `init` must fail (see refusal.h); an instance that was refused on a finished model is inert: it reads
  // zero.
  static std::unique_ptr<Encoder> Create(const mjModel* m, int instance);
  static int StateSize(const mjModel* m, int instance);

  // Writes the reading(s) at d->time.
  void Compute(const mjModel* m, mjData* d, int capability) const;
  // The step is over: its reading is the last one.
  void Advance(const mjModel* m, mjData* d) const;

 private:
  // Reads what the MJCF says; why the instance cannot work, or an empty text.
  std::string Resolve(const mjModel* m, int instance);
  // State before the history: the last reading and the one of the step that is open.
  enum Slot { kOpen, kHasLast, kLastTime, kLastAngle, kLastSpeed, kTime, kAngle, kSpeed, kSlots };
  static double MaxDelay(const mjModel* m, int instance);

  LiveParameters<kParameters> live_;
  double max_delay_s_ = 0;
  bool inert_ = false, velocity_ = false;
  int state_ = 0, capacity_ = 0, output_ = 0, qpos_ = 0, dof_ = 0;
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_ENCODER_ENCODER_H_
