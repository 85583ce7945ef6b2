// The catalogue of effects that a model may lack, and a rig's own candidates beside it. One file per effect under
// src/model/effects/ states its parameters and how it enters a model; adding a file there adds the effect everywhere.
// Meaning and names: docs/reference/effects.md.
#ifndef GAPSCOPE_MODEL_EFFECT_H_
#define GAPSCOPE_MODEL_EFFECT_H_

#include <compare>
#include <functional>
#include <map>
#include <optional>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/experiment/experiment.h"

namespace gapscope {

class Rig;
class Structure;

// What an effect acts on: `on` in results and in `--with EFFECT@ON`.
enum class EffectPlace {
  kMotor,        // an actuator
  kServo,        // an actuator with position feedback
  kJoint,        // any hinge or slide joint
  kDrivenJoint,  // a joint with an actuator
  kSpringJoint,  // a joint that has a spring in the base model
  kSignal,       // a measured signal
  kBody,         // a body with a joint of its own
  kModel,        // kOnModel: all of it
  kNamed,        // Effect::on alone
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
  double mass_kg = 1;          // of a body
  double length_m = 1;         // of a body, from its frame
};

// How a parameter scales with the rig.
enum class ScaleKind { kOne, kTorque, kAngle, kSpeed, kStiffness, kDrag, kPower, kCommand, kCubic, kMass, kLength };
double ScaleOf(ScaleKind kind, const Scales& scales);
// Whether it scales a torque, or a torque per something of the motion: stiffness, drag.
bool IsOfTorque(ScaleKind kind);

struct EffectParameter {
  std::string key, unit;  // "stiffness_n_m_per_rad", "N m/rad"
  ParameterRole role = ParameterRole::kSize;
  ScaleKind scale = ScaleKind::kOne;
  double neutral = 0;  // the effect does nothing here; in multiples of the scale, like all below
  double low = 0, high = 0;
  double reach_rad = 0;        // on hinges the bounds reach at least so far to both sides, however little the logs move
  std::vector<double> trials;  // values to screen with; empty: it stays at `start`
  double start = 0;            // where a fit starts when nothing better is known
  bool voltage_only = false;   // acts on a voltage drive; else fixed at neutral
  Parameter::With with = Parameter::With::kNone;  // how it acts with the effect's first parameter
  bool takes_over =
      false;  // another start of a fit: all of the first parameter's torque, at the scale, made by this one
  bool of_torque = false;  // it is one, whatever its scale says
  int from_centre = -1;    // on a body: its numbers count from the centre of mass along this axis of the body's frame
};

// What an effect makes of the motion, whatever its formula.
enum class EffectCharacter {
  kOther,
  kConstantTorque,  // what shifts the rest of a joint that a servo or a spring holds, and nothing else
  kDryFriction,     // a joint that sticks
  kSecondMass,      // a motor side that moves beside the load
};
// A term of the base model that an effect would double: there it is a parameter, no effect.
enum class BaseTerm { kNone, kDryFriction, kSpring };

// A simpler effect that this one holds, on the same place: exactly, or only as far as its bounds let it (a cable whose
// rest angle lies far away is nearly a bias).
struct Contained {
  std::string effect;
  bool exactly = true;
  bool usual = false;  // where the simpler one is there, this one mostly is
};
// What this effect usually is where a simpler one is fitted already: fits start from there, and the simpler one is told
// alone only where the logs exclude it. Each start gives every parameter `of_simpler` times the simpler one's first,
// plus `value` (SI); both 0: its own `start`.
struct StartValue {
  double of_simpler = 0, value = 0;
};
struct StartsFrom {
  std::string effect;
  std::vector<std::vector<StartValue>> starts;
};

struct Effect {
  std::string name;
  std::string title = "";  // as people write it: "Coulomb friction"; empty: the name without underscores
  EffectPlace place;
  std::vector<EffectParameter> parameters;
  std::string meaning;     // one line for the user
  std::string signature;   // how it shows in a log
  std::string told_apart;  // what separates it from its partners
  std::vector<std::string> partners;
  bool of_motion = false;  // a torque that only the joint's own angle and speed make: what roughness looks like
  bool of_range = false;   // looked for on joints that the MJCF gives a range: others have no stops
  bool of_time = false;    // says how late something is: no better known than the log's stamps
  std::string host = "";   // what does the same, of whoever sends the commands or reads the sensors; empty: nothing
  EffectCharacter character = EffectCharacter::kOther;
  BaseTerm base_term = BaseTerm::kNone;
  int actuator_stage = 0;  // of a drive's own model (tune --actuator), in the order of its parameters; 0: none of it
  // Other effects by their names.
  std::vector<Contained> contains = {};
  StartsFrom starts_from = {};
  std::string same_on_one_signal = "";  // the same motion where one command and one signal are all that is logged
  std::string same_but_constant = "";   // on one joint apart from this one by a constant torque alone
  std::string unlikely_beside = "";     // on an upright axis, which does not feel gravity, this one is the likely one
  std::string on = "";                  // of EffectPlace::kNamed
  // Enters the effect in the structure; parameter i has the name `names[i]`.
  std::function<Status(Structure& structure, const std::string& on, const std::vector<std::string>& names)> apply;
};

// All effects of the program, sorted by name; a name that acts differently on motors and joints stands twice. A rig
// has these and its own: Rig::effects().
const std::vector<Effect>& Catalogue();
std::vector<std::string> EffectNames();  // each once
// The title of an effect; of a name that the catalogue lacks (a rig's own, another version's result), the name in
// words.
std::string EffectTitle(const std::string& name);

// The rig's own size at a place, a parameter that expressions of effects there may use.
enum class RigSize {
  kTorque,   // Scales::torque_n_m
  kPeak,     // the drive's peak torque as the experiment's limits state it; else kTorque
  kInertia,  // Scales::inertia_kg_m2
};
std::string ScaleName(const std::string& on, RigSize size);
bool IsScaleName(std::string_view name);

// `on` of an effect that all its places share with one size: every drive, or every measured signal. A place of the rig
// that has this name goes first.
inline constexpr const char* kOnAll = "all";

// `on` of an effect on the model as a whole.
inline constexpr const char* kOnModel = "model";

// One effect on one place, or on all.
struct EffectUse {
  std::string effect, on;
  std::string Text() const { return effect + "@" + on; }
  auto operator<=>(const EffectUse&) const = default;
};

// Scales by joint and by actuator.
using ScaleTable = std::map<std::string, Scales>;

// A candidate of the experiment that is not asked about: no library registers its plugin, or that refuses the model or
// crashes.
struct LeftOutCandidate {
  std::string name, why;
  std::string Text() const { return "the candidate '" + name + "' is left out: " + why; }
};

// A program's own effect, beside the files of effects/: before the catalogue is first read.
void AddToCatalogue(Effect effect);

// "cable_spring@arm" or "cable_spring" (then on the first place where it makes sense). Errors: unknown effect, unknown
// place, with what is allowed; one that stands twice; as CheckTogether. On a rig with one drive EFFECT@all is that
// drive.
Result<std::vector<EffectUse>> ParseEffects(const std::vector<std::string>& texts, const Rig& rig);
// Error: an effect on all places and on one of them beside it, whose size would be a sum of two.
Status CheckTogether(const std::vector<EffectUse>& uses, const Rig& rig);
// Error: what the experiment switches off does not exist, or cannot act there.
Status CheckSwitchedOff(const Rig& rig);
// Every effect on every place where it makes sense and is not switched off; on a rig with several drives also on all of
// them, where one size can be meant for all: the effect's numbers are times and shares, which no drive's own size
// scales.
std::vector<EffectUse> AllUses(const Rig& rig);
// Where a use acts: its place; of EFFECT@all each drive (of effects on joints, each driven joint), or each signal.
std::vector<std::string> PlacesOf(const EffectUse& use, const Rig& rig);
// The stages that a drive's own model is made of, each on the first place where it makes sense.
std::vector<EffectUse> ActuatorModel(const Rig& rig);
// Enters an effect: its parameters are named EFFECT@ON.KEY, bounds and nominal (neutral) in SI by the scales. On all
// places the same parameters act on each, their bounds by the largest scale of any.
Status ApplyEffect(Structure& structure, const EffectUse& use, const ScaleTable& scales);
// The catalogue's entry of a use (which must be valid): one name may act differently on motors and joints; and its
// parameters with names and values in SI.
const Effect& EffectOf(const EffectUse& use, const Rig& rig);
struct PlacedParameter {
  std::string name, key, unit;  // name in the model, key in results
  ParameterRole role = ParameterRole::kSize;
  ScaleKind scale = ScaleKind::kOne;  // kCommand: of an electric drive; of others it is their torque
  double neutral, low, high, start;
  std::vector<double> trials;
};
std::vector<PlacedParameter> PlacedParameters(const EffectUse& use, const Rig& rig, const ScaleTable& scales);
// The effect that would bring a parameter of that name to the rig; nothing: none would.
std::optional<EffectUse> UseWithParameter(const std::string& name, const Rig& rig);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_EFFECT_H_
