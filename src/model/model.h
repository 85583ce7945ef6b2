// A compiled model whose parameters have names. Compiled once per structure (the base MJCF and a set of effects),
// shared and const; each worker copies it and writes parameters into its copy through a ParameterWriter.
#ifndef GAPSCOPE_MODEL_MODEL_H_
#define GAPSCOPE_MODEL_MODEL_H_

#include <map>
#include <memory>
#include <span>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "src/experiment/experiment.h"
#include "src/experiment/expression.h"
#include "src/model/effect.h"
#include "src/model/fields.h"

namespace gapscope {

// Where a measured signal is found in a simulation.
struct SignalSource {
  SignalKind kind = SignalKind::kPosition;
  int joint = -1, qpos = -1, dof = -1;
  int actuator = -1;  // torque: of this actuator's joint
  int estimate = -1;  // torque: address in plugin_state of a gapscope.motor's own estimate; -1: qfrc_actuator of `dof`
  int offset = -1;    // parameter that is added to the prediction
  int delay = -1;     // parameter: how late the signal is logged
  int cutoff = -1, damping_ratio = -1;  // parameters of the low-pass between mechanism and log
};

// A joint split in a motor side and a load side (backlash, compliance).
struct SplitJoint {
  int load_joint = -1, motor_joint = -1;
  Expression share;
};

class Model {
 public:
  // Errors: the MJCF does not load or compile (with its own message), a name in the experiment that the MJCF lacks
  // (file:line and the nearest), an effect that makes no sense here, an expression that does not parse.
  static Result<std::shared_ptr<const Model>> Build(const Experiment& experiment,
                                                    const std::vector<EffectUse>& effects = {},
                                                    const ScaleTable& scales = {});

  const mjModel& compiled() const { return *compiled_; }
  const Experiment& experiment() const { return experiment_; }
  const std::vector<Parameter>& parameters() const { return parameters_; }
  const std::vector<EffectUse>& effects() const { return effects_; }
  // Index of a parameter; -1: none of that name.
  int IndexOf(const std::string& name) const;
  // As IndexOf; error with the nearest name.
  Result<int> Find(const std::string& name, const std::string& where) const;
  std::vector<double> Nominal() const;

  const std::vector<int>& command_actuators() const { return command_ctrl_; }  // ctrl address per experiment command
  const SignalSource& source(std::size_t measured) const {
    return sources_[measured];
  }  // by index in experiment.measured
  const std::vector<SignalSource>& sources() const { return sources_; }
  int command_delay() const { return command_delay_; }  // parameter, or -1
  // {joint, joint that it starts with}: unmeasured joints that an effect added.
  const std::vector<std::pair<int, int>>& mirrored_joints() const { return mirrored_; }

  // "cable_spring@arm" ... as uses in this experiment's structure (see ParseEffectUse); all uses that make sense in it.
  Result<std::vector<EffectUse>> ParseEffects(const std::vector<std::string>& texts) const;
  Result<std::vector<EffectUse>> PossibleEffects() const;
  // The catalogue's entry of an effect there: one name may act differently on motors and joints.
  Result<const Effect*> EffectAt(const EffectUse& use) const;
  // The parameters that an effect would add.
  Result<std::vector<PlacedParameter>> EffectParameters(const EffectUse& use, const ScaleTable& scales) const;

  // The tuned MJCF with its plugin elements: loads in any MuJoCo with the plugin library. `values` as Nominal(),
  // `log_values` of one log.
  Result<std::string> ToXml(std::span<const double> values, const std::map<std::string, double>& log_values,
                            const ScaleTable& scales) const;

  // The same structure with everything that is only drawn, which compiled() leaves out; bodies stand where `values` put
  // them. qpos means the same in both. Error: the MJCF does not compile with its pictures (a missing texture, say).
  Result<ModelPtr> CompileForDrawing(std::span<const double> values,
                                     const std::map<std::string, double>& log_values) const;

 private:
  friend class ParameterWriter;
  struct Setting {
    std::string where;
    std::vector<std::string> expressions;
    Field field;
  };
  struct SplitSetting {
    int load_joint, motor_joint;
    std::string share;
  };

  Model() = default;
  Status ResolveNames();

  Experiment experiment_;
  std::vector<EffectUse> effects_;
  std::vector<Parameter> parameters_;
  ModelPtr compiled_;
  SpecPtr spec_;
  std::vector<Setting> settings_;
  std::vector<SplitSetting> splits_;
  std::vector<int> command_ctrl_;
  std::vector<SignalSource> sources_;
  std::vector<std::pair<int, int>> mirrored_;
  int command_delay_ = -1;
};

// Writes parameter values into one copy of a model. Not thread-safe: one per worker.
class ParameterWriter {
 public:
  // `target` must be a copy of model.compiled() and outlive the writer, as must `model`; `data` is scratch for MuJoCo's
  // derived constants.
  ParameterWriter(const Model& model, mjModel* target, mjData* data);
  ParameterWriter(const ParameterWriter&) = delete;
  ParameterWriter& operator=(const ParameterWriter&) = delete;

  // Writes all settings. Returns false, having written what it could, when an expression is not finite or a mass or
  // inertia is negative.
  bool Write(std::span<const double> values, const std::map<std::string, double>& log_values);

 private:
  struct Bound {
    std::vector<Expression> expressions;
    const Field* field;
  };
  void WriteSplits();

  const Model& model_;
  mjModel* target_;
  mjData* data_;
  std::vector<double> variables_;
  std::vector<std::string> log_names_;
  std::vector<Bound> bound_;
  std::vector<SplitJoint> splits_;
};

// Inertia of the joint's own body (without its children) about the joint's axis, with the armature of the joint; kg
// m^2.
double DrivenInertia(const mjModel& model, int joint);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_MODEL_H_
