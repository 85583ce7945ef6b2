// A model's structure while effects are added to it: a copy of the rig's MJCF as a spec, parameters, settings of
// fields, and what the host does itself (delays of logged columns). Effects state terms; Finish() turns them into
// plugin instances, native elements and extra joints.
#ifndef GAPSCOPE_MODEL_STRUCTURE_H_
#define GAPSCOPE_MODEL_STRUCTURE_H_

#include <functional>
#include <map>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "src/model/effect.h"
#include "src/model/native.h"
#include "src/model/rig.h"
#include "src/plugins/common/parameters.h"

namespace gapscope {

// A number in an expression or an attribute, to the last digit.
std::string ExactText(double value);

// The plugin instance of a candidate of the experiment's own.
inline std::string OwnInstance(const std::string& joint, const std::string& candidate) {
  return joint + ".own." + candidate;
}

// The body whose inertial frame a field moves; null: the field is another.
mjsBody* BodyOfInertia(mjSpec& spec, const std::string& field);

class Structure {
 public:
  // key of a plugin's live parameter -> expression of parameters
  using Terms = std::map<std::string, std::string>;

  // `rig` must outlive the structure.
  explicit Structure(const Rig& rig);
  const Rig& rig() const { return rig_; }

  // Terms that effects add to the drive, the friction and the springs of a joint, by the keys of the plugins'
  // parameters (src/plugins). A drive is named by its actuator.
  Status AddMotorTerm(const std::string& actuator, const std::string& key, const std::string& expression);
  Status AddFrictionTerm(const std::string& joint, const std::string& key, const std::string& expression);
  Status AddSpringTerm(const std::string& joint, const std::string& key, const std::string& expression);
  // Names of the motor's side and of what links it to the load, behind the joint's.
  static constexpr const char *kMotorSide = ".motor", *kLink = ".transmission";
  // Splits the joint's driven inertia into a motor side (`share` of it) and a load side: on a spring with `stiffness`
  // and `damping`, or with a `gap` whose flanks have `damping` as their ratio.
  struct Split {
    std::string joint, share, stiffness, damping, gap;  // expressions
  };
  Status AddSplit(Split split);
  // A mass without extent, fixed to a body at a position in its frame.
  Status AddPointMass(const std::string& body, const std::string& mass, const std::vector<std::string>& position);
  // A torque of the experiment's own on a joint, by a passive plugin that reads numerics and texts INSTANCE.KEY:
  // gapscope.expression, or one of the user's.
  struct OwnTorque {
    std::string name, joint, plugin;
    std::map<std::string, std::string> config;
    bool of_command;  // it reads the command of the joint's drive
    Terms parameters;
  };
  void AddOwnTorque(OwnTorque torque) { own_torques_.push_back(std::move(torque)); }
  // Other expressions in the place of what the experiment or the MJCF says of a field. Error: two effects do it.
  Status Replace(const std::string& field, std::vector<std::string> expressions);
  void Set(const std::string& field, std::vector<std::string> expressions);
  void AddParameter(Parameter parameter) { parameters.push_back(std::move(parameter)); }

  // What the terms become.
  enum class Form {
    kReplay,   // a model whose delays of logged columns the host does
    kPlugins,  // a model of its own
    kNative,   // one without our plugins
  };
  // Turns the terms into elements of the spec. Call once, after all effects. Error of kNative: the rig's own MJCF has
  // plugins.
  Status Finish();

  SpecPtr spec;
  Form form = Form::kReplay;
  const EffectUse* entering = nullptr;                 // whose terms are being added
  std::function<double(const std::string&)> value_of;  // of a form that is written: numbers of expressions
  // Of kNative: a joint's inertia where it starts, all others free, kg m2.
  std::function<double(const std::string&)> inertia_of;
  // Of kNative: what the engine has, and what became of the effects that added terms.
  NativeFeatures features;
  std::vector<NativeEffect> told;
  std::map<std::string, double> delays_s;   // by drive, where the engine's own configuration delays
  std::map<std::string, SentCommand> sent;  // by drive, where whoever sends commands changes them
  std::map<std::string, DriveLaw> laws;     // by drive, where code of ours makes its torque; without the gains
  std::vector<Parameter> parameters;
  std::vector<FieldSetting> settings;
  std::map<std::string, std::string> command_delay;  // drive -> parameter
  std::map<std::string, std::string> signal_delay;   // signal -> parameter
  std::map<std::string, std::string> motor_joint;    // split joint -> its motor-side joint
  std::vector<Split> splits;

 private:
  // Joins a term with one that another effect set on the same stage.
  static void AddTerm(std::span<const plugins::ParameterSpec> specs, Terms* terms, const std::string& key,
                      const std::string& expression);
  mjsJoint* FindJoint(const std::string& name) const;
  std::vector<mjsActuator*> ActuatorsOn(const std::string& joint) const;
  std::string MotorSide(const std::string& joint) const;
  void FinishSplit(const Split& split);
  void Link(const Split& split, const std::string& motor);
  void Stiffen(mjsJoint* joint);
  Status FinishMotor(const std::string& joint, const Terms& terms);
  // The plugin instance that the drive's inputs are turned into; its name.
  Result<std::string> ConvertDrive(const std::vector<mjsActuator*>& inputs);
  Status FinishFriction(const std::string& name, Terms terms);
  std::string Take(const std::string& field, double own);
  bool TakesSpring(const mjsJoint& joint, const Terms& terms) const;
  void FinishSpring(const std::string& joint, Terms terms);
  void AddStop(const std::string& joint, Terms* terms);
  void FinishOwnTorque(const OwnTorque& torque);
  // The same without plugins. Groups of terms, by which Enter and Tell know them:
  static constexpr const char *kMotorTerms = "motor", *kFrictionTerms = "friction", *kSpringTerms = "spring",
                              *kSplitTerms = "split";
  Status FinishNative();
  // A term's number (0: there is no such term), and a field's as the experiment sets it, else the MJCF's own.
  double ValueIn(const Terms& terms, const std::string& key) const;
  double ValueOf(const std::string& field, double own) const;
  void Enter(const std::string& group, const std::string& place, const std::string& key);
  void Tell(const std::string& group, const std::string& place, const std::string& key, Fidelity fidelity,
            const std::string& how, bool by_law = false);
  void TellOf(const NativeEffect& effect);
  // The effects that have a term; none: it is the rig's own.
  std::vector<EffectUse> OwnersOf(const std::string& group, const std::string& place, const std::string& key) const;
  Fidelity AddPassive(const std::string& joint, double amplitude, double per_rad, double phase);
  void NativeSpring(const std::string& joint, const Terms& terms);
  void NativeElastic(const std::string& joint, const Terms& terms);
  Status NativeFriction(const std::string& joint, const Terms& terms);
  void NativeDelay(const std::string& joint, const std::string& key, double delay_s,
                   const std::vector<mjsActuator*>& inputs);
  void NativeMotor(const std::string& joint, const Terms& terms);
  void NativeSent(const std::string& joint, const Terms& terms, const std::vector<mjsActuator*>& inputs);
  // Joints whose drives have terms that the engine lacks; none, where gapscope.torch cannot stand for each of them.
  std::set<std::string> LawJoints() const;
  bool SpringsByLaw() const { return features.drive_laws && features.passive_motors == PassiveMotors::kHost; }
  bool TakesLaw(const std::string& joint) const;
  void NativeLaw(const std::string& joint);
  void NativeLawFriction(const std::string& joint, DriveLaw* law);
  void TellLaw(const std::string& group, const std::string& joint, const std::string& key);
  // A number in the place of what the experiment or the MJCF says of a field.
  void Put(const std::string& field, double number);
  void NativeLag(const std::string& joint, const Terms& terms, const std::vector<mjsActuator*>& inputs);
  // 1 - first d/dt + second d^2/dt^2, of what a delay or a lag does to feedback.
  struct Lateness {
    double first_s = 0, second_s2 = 0;
  };
  // False: it has no native form, and nothing was changed.
  bool MakeFeedbackLate(const std::string& joint, Lateness late, const std::vector<mjsActuator*>& inputs);
  // A passive plugin acts from a body of its own, without mass, since a body carries one plugin.
  void HoldPlugin(const mjsJoint* joint, const std::string& plugin, const std::string& instance);
  void AddNumeric(const std::string& name, double value);
  // The live parameters of an instance, set by the terms.
  void AddLive(const std::string& instance, const Terms& terms);
  double NominalOf(const std::string& expression) const;

  const Rig& rig_;
  std::map<std::string, Terms> motor_, friction_, spring_;  // by joint
  std::vector<OwnTorque> own_torques_;
  std::vector<std::string> replaced_;                     // fields
  std::map<std::string, std::vector<EffectUse>> owners_;  // of terms, by group/place/key
};

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_STRUCTURE_H_
