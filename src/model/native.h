// An MJCF without our plugins, and what becomes of each effect there.
#ifndef GAPSCOPE_MODEL_NATIVE_H_
#define GAPSCOPE_MODEL_NATIVE_H_

#include <map>
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
  std::string how = "";    // what stands for it, or why nothing does
  bool by_law = false;     // what stands for it is code beside the MJCF (ExportedModel::laws)
  bool by_sender = false;  // whoever sends commands changes them (ExportedModel::sent)
};

// Torques that an angle or nothing makes, by a motor: with `input="none"`, or with an input that nobody drives. Else a
// drive's law has them with its own (drive_laws), or a host may send them so.
enum class PassiveMotors { kNone, kHost, kIdleInput, kNoInput };
// An actuator's `delay`; or whole steps, in the engine's own configuration (ExportedModel::delay_steps).
enum class CommandDelays { kNone, kWholeSteps, kExact };

// Which of MuJoCo's elements an engine that reads MJCF acts on. What it does not, it may ignore without a word.
struct NativeFeatures {
  PassiveMotors passive_motors = PassiveMotors::kNoInput;
  CommandDelays delays = CommandDelays::kExact;
  bool polynomials = true;        // of a joint's stiffness and damping
  bool springs_on_drives = true;  // a spring of a joint that is driven
  bool tendons = true;            // stops, gaps and springs between two joints
  bool lags = true;               // an actuator's activation
  bool runge_kutta = true;        // else the implicitfast integrator in its place
  bool late_in_stages = false;    // all of its stages read what is late at the step's begin; MuJoCo's at their own time
  bool drive_laws = false;        // its loop takes torques of a law of ours: gapscope.torch's Drive
  double time_step_s = 0;         // 0: the MJCF's own
};

// What whoever sends a drive's command u takes off it first, and then its factor 1 + asymmetry sign u.
struct SentCommand {
  double dead_zone = 0, asymmetry = 0;
  double Of(double command) const;
};

// The arguments of gapscope.torch's Drive, by name; with "friction.", "spring." or "stop." before it, of
// its parameter of that name.
using DriveLaw = std::map<std::string, double>;
// Of those of its friction the one that is the time step's, not the mechanism's.
inline constexpr char kFrictionSlope[] = "friction.slope_n_m_s_per_rad";

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_NATIVE_H_
