// A compiled model whose parameters have names. Compiled once per structure (a rig and a set of effects), shared and
// const; each worker copies it and writes parameters into its copy through a ParameterWriter (parameter_writer.h).
#ifndef GAPSCOPE_MODEL_MODEL_H_
#define GAPSCOPE_MODEL_MODEL_H_

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "src/experiment/experiment.h"
#include "src/model/effect.h"
#include "src/model/fields.h"
#include "src/model/free_starts.h"
#include "src/model/native.h"
#include "src/model/rig.h"

namespace gapscope {

// Where a measured signal is found in a simulation.
struct SignalSource {
  SignalKind kind = SignalKind::kPosition;
  int joint = -1, qpos = -1, dof = -1;
  int actuator = -1;  // torque: of this actuator's joint
  int estimate = -1;  // torque: address in plugin_state of a gapscope.motor's own estimate; -1: qfrc_actuator of `dof`
  int sensor = -1;    // address in sensordata; of an orientation that of its quaternion
  int offset = -1;    // parameter that is added to the prediction
  int delay = -1;     // parameter: how late the signal is logged
  int cutoff = -1, damping_ratio = -1;  // parameters of the low-pass between mechanism and log
};

// A model outside a replay: what an MJCF of it is made of.
struct ExportedModel {
  SpecPtr spec;  // compiled, with the values in it
  ModelPtr compiled;
  // Which parameters make a field what it is: "joint/arm/damping", "numeric/motor.torque_limit_n_m".
  struct Origin {
    std::string field;
    std::vector<std::string> parameters;
  };
  std::vector<Origin> origins;
  std::vector<std::string> left_out;  // fields that each log sets anew, where none was given
  std::vector<NativeEffect> native;   // what became of each effect
  // Steps that the engine's own configuration delays commands by, by drive: the MJCF does not.
  std::map<std::string, int> delay_steps;
  // What is to be sent for commands, by drive.
  std::map<std::string, SentCommand> sent;
  // Drives whose torques code beside the MJCF makes, instead of the MJCF's own gains.
  std::map<std::string, DriveLaw> laws;
};

// Whether bodies that touch are looked for.
enum class Contacts { kAsTheMjcf, kNone };

class Model {
 public:
  // The rig with effects added, and numbers of gapscope.motor that drives have beside them. Errors: a name in the
  // experiment that the MJCF lacks (file:line and the nearest), effects that do not go together, an expression that
  // does not parse, a model that does not compile.
  static Result<std::shared_ptr<const Model>> Build(std::shared_ptr<const Rig> rig,
                                                    const std::vector<EffectUse>& effects = {},
                                                    const ScaleTable& scales = {},
                                                    Contacts contacts = Contacts::kAsTheMjcf,
                                                    const std::map<std::string, DriveLaw>& drives = {});
  // The experiment's model as it stands: of a rig of its own. Errors: as Rig::Load and Build.
  static Result<std::shared_ptr<const Model>> Load(const Experiment& experiment);

  const mjModel& compiled() const { return *compiled_; }
  const std::shared_ptr<const Rig>& rig() const { return rig_; }
  const Experiment& experiment() const { return rig_->experiment(); }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  const std::vector<EffectUse>& effects() const { return effects_; }
  // Index of a parameter; -1: none of that name.
  int IndexOf(const std::string& name) const;
  // As IndexOf; error with the nearest name.
  Result<int> Find(const std::string& name, const std::string& where) const;
  std::vector<double> Nominal() const;
  // What a fit moves unless told otherwise: indices of the parameters that are not frozen and have bounds.
  std::vector<int> FreeParameters() const;

  const std::vector<int>& command_actuators() const { return command_ctrl_; }  // ctrl address per experiment command
  const SignalSource& source(std::size_t measured) const {
    return sources_[measured];
  }  // by index in experiment.measured
  const std::vector<SignalSource>& sources() const { return sources_; }
  // Per experiment command: parameter that says how late it acts (of its drive, all of whose inputs are late alike);
  // -1: on time.
  const std::vector<int>& command_delays() const { return command_delays_; }
  bool DelaysEveryCommand() const;
  // Parameters that are times, s, over which the past acts on: of lags and of a supply that sags.
  const std::vector<int>& memories() const { return memories_; }
  // {joint, joint that it starts with}: unmeasured joints that an effect added.
  const std::vector<std::pair<int, int>>& mirrored_joints() const { return mirrored_; }
  // Bodies that start where a measured pose is.
  const std::vector<FreeStart>& free_starts() const { return free_starts_; }
  // Bodies on `hold` that stand where a measured pose is.
  const std::vector<FreeStart>& held_starts() const { return held_starts_; }
  // Whether its bodies could touch each other.
  bool MayCollide() const;
  // Whether quick steps (StepKind) are another thing than its own: by Runge-Kutta two bodies on a stiff link always
  // take their own.
  bool HasQuickSteps() const { return compiled().opt.integrator != mjINT_RK4 || mirrored_.empty(); }

  // The tuned MJCF with its plugin elements: loads in any MuJoCo with the plugin library. `values` as Nominal(),
  // `log_values` of one log.
  Result<std::string> ToXml(std::span<const double> values, const std::map<std::string, double>& log_values,
                            const ScaleTable& scales) const;
  // What ToXml writes. Without `log_values`, fields that depend on them stay as the rig's MJCF has them. A
  // `time_step_s` of 0 is the MJCF's own. Errors: a parameter that is not finite; as Build.
  Result<ExportedModel> Export(std::span<const double> values, const std::map<std::string, double>* log_values,
                               const ScaleTable& scales, double time_step_s = 0) const;
  // The same without our plugins, of what an engine has. Errors: the rig's own MJCF has plugins; as Export.
  Result<ExportedModel> ExportNative(std::span<const double> values, const std::map<std::string, double>* log_values,
                                     const NativeFeatures& features) const;

  // The same structure with everything that is only drawn, which compiled() leaves out; bodies stand where `values` put
  // them. qpos means the same in both. Error: the MJCF does not compile with its pictures (a missing texture, say).
  Result<ModelPtr> CompileForDrawing(std::span<const double> values,
                                     const std::map<std::string, double>& log_values) const;

 private:
  friend class ParameterWriter;
  Result<ExportedModel> ExportFrom(Structure& structure, std::span<const double> values,
                                   const std::map<std::string, double>* log_values, const ScaleTable& scales) const;
  struct Setting {
    std::string name, where;  // "joint/arm/damping"; file and line
    std::vector<std::string> expressions;
    Field field;
  };
  struct SplitSetting {
    int load_joint, motor_joint;
    std::string share;
  };

  Model() = default;
  // Compiles a finished structure and resolves its settings in the result; they leave the structure.
  Status Compile(Structure* structure);
  Status ResolveSettings(std::vector<FieldSetting> settings);
  Status CheckInertias() const;
  Status ResolveNames();
  void FindDelays(const Structure& structure);
  void FindMemories();
  void FindMirrored();

  std::shared_ptr<const Rig> rig_;
  std::vector<EffectUse> effects_;
  std::vector<Parameter> parameters_;
  ModelPtr compiled_;
  std::vector<Setting> settings_;
  std::vector<SplitSetting> splits_;
  std::vector<int> command_ctrl_;
  std::vector<SignalSource> sources_;
  std::vector<std::pair<int, int>> mirrored_;
  std::vector<FreeStart> free_starts_, held_starts_;
  std::vector<int> command_delays_;
  std::vector<int> memories_;
};

// An MJCF of a compiled spec. Error: MuJoCo cannot write it; `where` names its file.
Result<std::string> SpecToXml(const mjSpec& spec, const std::string& where);

// Inertia of the joint's own body (without its children) about the joint's axis, with the armature of the joint; kg
// m^2.
double DrivenInertia(const mjModel& model, int joint);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_MODEL_H_
