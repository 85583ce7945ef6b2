// The experiment file: how a log is bound to a model. docs/reference/experiment.md documents it key by key.
#ifndef GAPSCOPE_EXPERIMENT_EXPERIMENT_H_
#define GAPSCOPE_EXPERIMENT_EXPERIMENT_H_

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "src/core/enum_names.h"
#include "src/core/result.h"
#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

// A number that every log brings with it: from its header, or the mean of a column over the log.
struct LogValue {
  std::string name;    // as expressions use it: "log.kp"
  std::string header;  // name in the log's header; empty: `column`
  std::string column;
  double factor = 1;               // to SI
  std::optional<double> fallback;  // when the log has neither
};

// What a command asks for, as its unit tells.
enum class CommandKind { kVoltage, kCurrent, kTorque, kAngle, kOther };
inline bool IsElectric(CommandKind kind) { return kind == CommandKind::kVoltage || kind == CommandKind::kCurrent; }

// A column that drives an actuator, held from its row to the next.
struct CommandSpec {
  std::string actuator;
  std::vector<std::string> columns;  // the first one that the log has
  std::string unit;                  // SI unit of the command: "V", "A", "N m", "rad" ...
  CommandKind kind = CommandKind::kOther;
  double factor = 1, offset = 0;  // command in SI = factor * column + offset
  bool unit_stated = false;       // or a scale
  bool optional = false;          // without the column: `fallback`
  std::string fallback = "0";     // expression of log values
  std::string where = "";         // file:line:column, for errors
};

// A drive that the experiment adds to an MJCF without it: kp (command - angle) - kd speed, clipped; kd (command -
// speed); or the command itself.
struct AddedActuator {
  enum class Kind { kPosition, kVelocity, kTorque };
  std::string name, joint = "";
  Kind kind = Kind::kPosition;
  double kp = 0, kd = 0;                                  // N m/rad, N m s/rad (N/m, N s/m of a slide)
  std::optional<double> force_limit = {}, armature = {};  // N m, kg m^2 (N, kg)
  std::string where = "";                                 // file:line:column, for errors
};

// A body that the experiment file names in a list.
struct NamedBody {
  std::string name, where = "";  // file:line:column
};

// kOrientation: one of the three numbers of a sensor's rotation vector (orientation.h).
enum class SignalKind { kPosition, kVelocity, kTorque, kSensor, kOrientation };

// Of what in the model a signal is.
enum class SignalSite { kJoint, kActuator, kSensor };

// From which a simulation reads a signal: the state alone; forces, which follow the command at once; or all that
// MuJoCo's sensors may read, accelerations among it.
enum class SignalStage { kState, kForces, kSensors };

struct SignalTraits {
  SignalKind kind;
  const char* name;      // as the experiment file says it
  const char* units[2];  // SI, of a hinge and of a slide; a sensor's type says its own
  SignalSite site;
  bool has_zero;     // its sensor has a zero of its own, which a log may be off by
  bool gives_angle;  // it is the joint's coordinate
  bool gives_speed;  // it is the joint's speed
  SignalStage stage;
};
std::span<const SignalTraits> AllSignalTraits();
const SignalTraits& TraitsOf(SignalKind kind);

// Second-order low-pass that the rig applies to a signal before it is logged, w^2 / (s^2 + 2 z w s + w^2): names of
// parameters; empty: none.
struct SensorFilter {
  std::string cutoff, damping_ratio;
};

// A column that is compared with the model.
struct MeasuredSpec {
  std::string signal;                // name in results: "arm_rad"
  std::vector<std::string> columns;  // the first one that the log has; of an orientation all four, w x y z
  SignalKind kind = SignalKind::kPosition;
  std::string on;                 // joint, actuator or sensor: SignalTraits::site
  int element = -1;               // of a sensor of several numbers; -1: it is not said which
  int elements = 0;               // how many columns `columns_of_elements` gives the sensor; 0: there is no such list
  std::string unit;               // SI unit: "rad", "rad/s", "N m"
  double factor = 1, offset = 0;  // measured in SI = factor * column + offset
  bool unit_stated = false;       // or a scale
  double resolution = 0;          // size of one sensor count, SI; 0: unknown
  SensorFilter filter;
  bool optional = false;
  bool scored = true;  // counts in the error
  WrapRepair wrap = WrapRepair::kKeep;
  double wrap_period = 0;
  std::string offset_parameter;     // predicted = model + this parameter; empty: none
  std::string body, site;           // whose pose `on` is, a sensor that the experiment adds; empty: `on` is the MJCF's
  std::optional<bool> starts = {};  // a free body's pose, from which windows start; none: where it is one
  std::string where;                // file:line:column, for errors
};

struct Parameter {
  std::string name, unit, doc;
  double nominal = 0, low = 0, high = 0;
  bool frozen = false;    // not tuned unless freed by name
  bool if_known = false;  // frozen, but tuned where the logs know it
  // Another parameter, a size, with which this one acts linearly though not alone: kAngle: size * (cos, sin) of this;
  // kRest: size * this; kCubic: the third power's coefficient about that rest. Empty: none.
  enum class With { kNone, kAngle, kRest, kCubic } with = With::kNone;
  std::string size;
  // Whose it is: the experiment's, an added effect's, or the rig's own size, which effects are scaled by: neither tuned
  // nor shown.
  enum class Owner { kBase, kEffect, kScale } owner = Owner::kBase;
  bool of_torque = false;  // an effect's torque, or torque per something of the motion: stiffness, drag
};

// A field of the compiled model and the expressions of parameters and log values that give its components.
struct FieldSetting {
  std::string field;  // "joint/arm/damping"
  std::vector<std::string> expressions;
  std::string where;  // file:line:column, for errors
};

// What a parameter of an effect says.
enum class ParameterRole {
  kSize,   // how strong it is
  kPlace,  // where it lies: a rest angle, a phase, a number of periods
  kShape,  // how its curve bends: simpler models have a fixed value for it, so it does not count as a parameter
  kTime,   // how late it is
};

// A parameter of an effect that the experiment states, in SI.
struct OwnParameter {
  std::string key, unit, where = "";
  double neutral = 0;  // the effect does nothing here
  double low = 0, high = 0;
  std::vector<double> trials;                        // values to screen with
  double start = 0;                                  // where a fit starts when nothing better is known
  std::optional<ParameterRole> role = std::nullopt;  // none: as the expression shows
};

// An effect of the experiment's own: a torque on a joint by a formula or by a plugin, or other expressions for fields
// of the model. One of torque, plugin and settings is not empty.
struct OwnEffect {
  std::string name, meaning = "";
  std::string joint = "";                          // of a torque
  std::string torque = "";                         // an expression as gapscope.expression reads it, N m
  std::string plugin = "";                         // the name that its library registers
  std::map<std::string, std::string> config = {};  // of the plugin
  std::vector<FieldSetting> settings = {};  // expressions of its own and the experiment's parameters, and log values
  std::vector<OwnParameter> parameters = {};
  std::string where = "", torque_where = "";  // file:line:column, for errors; torque_where: of the plugin too
  std::string fault = "";                     // why it is not asked about; empty: it is
};

// An effect that is not asked about, on one place or (empty) on all.
struct SwitchedOff {
  std::string effect, on, where;
};

// How far an experiment on the rig may go, as magnitudes about zero; 0: no limit is stated. Exactly one of joint and
// actuator is named.
struct Limit {
  std::string joint, actuator;
  double position = 0, speed = 0;  // of the joint: rad and rad/s (m and m/s)
  double command = 0, torque = 0;  // of the actuator: the command in its SI unit; N m (N) at its joint
  std::string where = "";          // file:line:column, for errors
};

enum class ReplayMode { kFreeRun, kWindows, kClosedLoop };
template <>
std::span<const EnumName<ReplayMode>> EnumNames<ReplayMode>();  // "free_run", "windows", "closed_loop"

struct ReplayDefaults {
  ReplayMode mode = ReplayMode::kFreeRun;
  double window_s = 1.0;
  std::string
      while_column;    // rows from the first one where this column is zero or missing on are left out; empty: all rows
  double start_s = 0;  // rows before this are left out (a rig that is still handled by hand, say)
};

struct Experiment {
  std::string path;        // of the experiment file
  std::string model_path;  // of the MJCF
  ReadOptions read;
  TimelineOptions timeline;
  std::vector<LogValue> values;
  std::vector<AddedActuator> actuators;
  std::vector<NamedBody> hold;     // their free joint, which may be named too, is taken away: a robot on a stand
  std::vector<NamedBody> inertia;  // their inertia is tuned as far as logs know it (pseudo_inertia.h)
  std::vector<CommandSpec> commands;
  std::vector<MeasuredSpec> measured;
  std::vector<Parameter> parameters;
  std::vector<FieldSetting> settings;
  std::vector<OwnEffect> candidates;
  std::vector<SwitchedOff> without;
  std::vector<Limit> limits;
  ReplayDefaults replay;
};

// Reads and checks an experiment file. Errors give file:line:column; an unknown key names the nearest valid one.
Result<Experiment> LoadExperiment(const std::string& path);

// {parameter: value} from a YAML file, for `--params`. Errors: not a map of numbers, a value that is not finite.
Result<std::map<std::string, double>> LoadParameterValues(const std::string& path);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_EXPERIMENT_H_
