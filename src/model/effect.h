// The catalogue of effects that a model may lack. One file per effect under src/model/effects/ states its parameters
// and how it enters a model; adding a file there adds the effect everywhere. Meaning and names: docs/effects.md.
#ifndef GAPSCOPE_MODEL_EFFECT_H_
#define GAPSCOPE_MODEL_EFFECT_H_

#include <compare>
#include <map>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/experiment/experiment.h"

namespace gapscope {

class Structure;

// What an effect acts on: `on` in results and in `--with EFFECT@ON`.
enum class EffectPlace {
  kMotor,        // an actuator
  kServo,        // an actuator with position feedback
  kJoint,        // any hinge or slide joint
  kDrivenJoint,  // a joint with an actuator
  kSpringJoint,  // a joint that has a spring in the base model
  kSignal,       // a measured signal
};

// A rig's own size, so that one catalogue serves all rigs: bounds and trial values of effect parameters are multiples
// of these.
struct Scales {
  double torque_n_m = 1;       // largest torque on the joint in the logs
  double angle_rad = 1;        // largest excursion
  double speed_rad_per_s = 1;  // largest speed
  double sample_s = 0.002;     // median sample time
  double command = 1;          // largest command, in its unit
  double inertia_kg_m2 = 1;    // of the joint's driven inertia, at the initial pose
};

// How a parameter scales with the rig.
enum class ScaleKind { kOne, kTorque, kAngle, kSpeed, kStiffness, kDrag, kPower, kCommand, kCubic };
double ScaleOf(ScaleKind kind, const Scales& scales);

struct EffectParameter {
  std::string key, unit;  // "stiffness_n_m_per_rad", "N m/rad"
  ScaleKind scale = ScaleKind::kOne;
  double neutral = 0;  // the effect does nothing here; in multiples of the scale, like all below
  double low = 0, high = 0;
  std::vector<double> trials;  // values to screen with; empty: a shape parameter that stays at `start`
  double start = 0;            // where a fit starts when nothing better is known
  bool shape = false;          // simpler models have a fixed value for it: does not count as a parameter
  bool voltage_only = false;   // acts on a voltage drive; else fixed at neutral
  Parameter::With with = Parameter::With::kNone;  // how it acts with the effect's first parameter
};

struct Effect {
  std::string name;
  EffectPlace place;
  std::vector<EffectParameter> parameters;
  std::string meaning;     // one line for the user
  std::string signature;   // how it shows in a log
  std::string told_apart;  // what separates it from its partners
  std::vector<std::string> partners;
  // Enters the effect in the structure; parameter i has the name `names[i]`.
  Status (*apply)(Structure& structure, const std::string& on, const std::vector<std::string>& names);
};

// All effects, sorted by name; a name that acts differently on motors and joints stands twice.
const std::vector<Effect>& Catalogue();

// The rig's own size at a place, a parameter that expressions of effects there may use.
enum class RigSize { kTorque, kInertia };  // Scales::torque_n_m, Scales::inertia_kg_m2
std::string ScaleName(const std::string& on, RigSize size);

// One effect on one place.
struct EffectUse {
  std::string effect, on;
  std::string Text() const { return effect + "@" + on; }
  auto operator<=>(const EffectUse&) const = default;
};

// Scales by joint and by actuator.
using ScaleTable = std::map<std::string, Scales>;

// "cable_spring@arm" or "cable_spring" (then on the first place where it makes sense). Errors: unknown effect, unknown
// place, with what is allowed.
Result<EffectUse> ParseEffectUse(const std::string& text, const Structure& structure);
// Every effect on every place where it makes sense.
std::vector<EffectUse> AllUses(const Structure& structure);
// Enters an effect: its parameters are named EFFECT@ON.KEY, bounds and nominal (neutral) in SI by the scales.
Status ApplyEffect(Structure& structure, const EffectUse& use, const ScaleTable& scales);
// The catalogue's entry of a use (which must be valid), and its parameters with names and values in SI.
const Effect& EffectOf(const EffectUse& use, const Structure& structure);
struct PlacedParameter {
  std::string name, key, unit;  // name in the model, key in results
  double neutral, low, high, start;
  bool shape = false;
  std::vector<double> trials;
};
std::vector<PlacedParameter> PlacedParameters(const EffectUse& use, const Structure& structure,
                                              const ScaleTable& scales);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_EFFECT_H_
