// An experiment's mechanism: its MJCF, read and compiled once, and what there is in it to act on. Shared and const;
// each model with effects starts from a copy.
#ifndef GAPSCOPE_MODEL_RIG_H_
#define GAPSCOPE_MODEL_RIG_H_

#include <array>
#include <memory>
#include <mutex>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "src/experiment/experiment.h"
#include "src/model/drive_facts.h"
#include "src/model/effect.h"

namespace gapscope {

// A message of MuJoCo's for an error of ours.
std::string OneLine(std::string text);

class Rig {
 public:
  // Errors: the MJCF does not load or compile (with MuJoCo's own message); a candidate of the experiment's own that
  // does not fit it, or an effect switched off that does not exist (file:line).
  static Result<std::shared_ptr<const Rig>> Load(const Experiment& experiment);

  const Experiment& experiment() const { return experiment_; }
  const mjModel& compiled() const { return *compiled_; }
  // What the model may lack: the catalogue and the experiment's own candidates, sorted by name.
  const std::vector<Effect>& effects() const { return effects_; }
  const std::vector<LeftOutCandidate>& left_out() const { return left_out_; }
  // The MJCF to be changed: this one stays as it was read.
  SpecPtr CopySpec() const;

  std::vector<std::string> Joints() const;                 // named hinge and slide joints
  std::vector<std::string> Actuators() const;              // named actuators that are not a sibling input of another
  std::string JointOf(const std::string& actuator) const;  // empty: not on a joint
  std::string ActuatorOf(const std::string& joint) const;  // first actuator on the joint; empty: none
  DriveFacts FactsOf(const std::string& actuator) const;   // of no actuator: nothing
  bool HasSpring(const std::string& joint) const;
  bool HasFriction(const std::string& joint) const;
  bool HasRange(const std::string& joint) const;   // the MJCF says one, whether it holds the joint in it or not
  bool Sets(const std::string& field) const;       // the experiment does, by parameters
  std::vector<std::string> Bodies() const;         // named ones with a joint of their own
  int JointsAbove(const std::string& body) const;  // hinges and slides between the world and the body
  std::array<double, 3> CentreOf(const std::string& body) const;  // of mass, in the body's frame; m
  std::vector<std::string> Signals() const;                       // measured signals of the experiment
  std::string JointOfSignal(const std::string& signal) const;     // empty: no such signal
  // The command that drives the signal's joint, by number in the experiment; of a rig with one command that one. -1:
  // none, or nobody knows which.
  int CommandOfSignal(const std::string& signal) const;
  CommandKind KindOfCommand(const std::string& actuator) const;

 private:
  Rig() = default;

  Experiment experiment_;
  std::vector<Effect> effects_;
  std::vector<LeftOutCandidate> left_out_;
  SpecPtr spec_;
  Experiment as_given_;         // before anything was added to it
  bool copies_ = true;          // a copy of the spec is what was read
  mutable std::mutex copying_;  // MuJoCo does not say that one spec may be copied twice at a time
  ModelPtr compiled_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_RIG_H_
