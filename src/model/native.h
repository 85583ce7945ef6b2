// An MJCF without our plugins, and what becomes of each effect there.
#ifndef GAPSCOPE_MODEL_NATIVE_H_
#define GAPSCOPE_MODEL_NATIVE_H_

#include <string>
#include <vector>

#include "src/model/effect.h"

namespace gapscope {

// From the best to the worst.
enum class Fidelity {
  kExact,
  kApproximated,
  kHost,     // by whoever sends the commands or reads the sensors
  kDropped,  // the model moves as if it were not there
};
std::string FidelityName(Fidelity fidelity);

struct NativeEffect {
  EffectUse use;
  Fidelity fidelity = Fidelity::kExact;
  std::string how = "";  // what stands for it, or why nothing does
};

// Which of MuJoCo's elements an engine that reads MJCF acts on. What it does not, it may ignore without a word.
struct NativeFeatures {
  bool passive_motors = true;  // <dcmotor input="none">: torques that an angle or nothing makes
  bool delays = true;          // an actuator's `delay`
  bool polynomials = true;     // of a joint's stiffness and damping
  double time_step_s = 0;      // 0: the MJCF's own
};

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_NATIVE_H_
