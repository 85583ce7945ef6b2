// A model's structure while effects are added to it: the MJCF as a spec, parameters, settings of fields, and what the
// host does itself (delays of logged columns). Effects state terms; Finish() turns them into plugin instances, native
// elements and extra joints.
#ifndef GAPSCOPE_MODEL_STRUCTURE_H_
#define GAPSCOPE_MODEL_STRUCTURE_H_

#include <map>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "src/experiment/experiment.h"
#include "src/model/effect.h"

namespace gapscope {

class Structure {
 public:
  // key of a plugin's live parameter -> expression of parameters
  using Terms = std::map<std::string, std::string>;

  static Result<Structure> Load(const Experiment& experiment);

  // Terms that effects add, by joint.
  Status AddMotorTerm(const std::string& actuator, const std::string& key, const std::string& expression);
  Status AddFrictionTerm(const std::string& joint, const std::string& key, const std::string& expression);
  Status AddSpringTerm(const std::string& joint, const std::string& key, const std::string& expression);
  // Splits the joint's driven inertia into a motor side (`share` of it) and a load side: on a spring with `stiffness`
  // and `damping`, or with a `gap` whose flanks have `damping` as their ratio.
  struct Split {
    std::string joint, share, stiffness, damping, gap;  // expressions
  };
  Status AddSplit(Split split);
  void Set(const std::string& field, std::vector<std::string> expressions);
  void AddParameter(Parameter parameter) { parameters.push_back(std::move(parameter)); }

  // What there is.
  std::vector<std::string> Joints() const;                 // named hinge and slide joints
  std::vector<std::string> Actuators() const;              // named actuators that are not a sibling input of another
  std::string JointOf(const std::string& actuator) const;  // empty: not on a joint
  std::string ActuatorOf(const std::string& joint) const;  // first actuator on the joint; empty: none
  bool IsServo(const std::string& actuator) const;         // feeds back the position
  bool HasSpring(const std::string& joint) const;
  bool HasFriction(const std::string& joint) const;
  std::vector<std::string> Signals() const;                    // measured signals of the experiment
  std::string JointOfSignal(const std::string& signal) const;  // empty: no such signal
  std::string CommandUnit(const std::string& actuator) const;  // SI unit of its command: "V", "A", "rad" ...

  // Turns the terms into elements of the spec. Call once, after all effects.
  Status Finish();

  SpecPtr spec;
  bool for_export = false;  // what the host does itself must enter the model too
  std::vector<Parameter> parameters;
  std::vector<FieldSetting> settings;
  std::string command_delay;                        // parameter; empty: none
  std::map<std::string, std::string> signal_delay;  // signal -> parameter
  std::map<std::string, std::string> motor_joint;   // split joint -> its motor-side joint
  std::vector<Split> splits;

 private:
  mjsJoint* FindJoint(const std::string& name) const;
  mjsActuator* FindActuator(const std::string& name) const;
  std::string MotorSide(const std::string& joint) const;
  Status FinishSplits();
  Status FinishMotors();
  Status FinishFriction();
  Status FinishSprings();
  double NominalOf(const std::string& expression) const;
  void AddNumeric(const std::string& name, double value);

  const Experiment* experiment_ = nullptr;
  ModelPtr base_;                                           // compiled, without effects
  std::map<std::string, Terms> motor_, friction_, spring_;  // by joint
};

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_STRUCTURE_H_
