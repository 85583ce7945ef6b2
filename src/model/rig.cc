#include "src/model/rig.h"

#include <algorithm>

#include "src/core/collect.h"
#include "src/model/add_actuators.h"
#include "src/model/claimed_sizes.h"
#include "src/model/element_names.h"
#include "src/model/own_candidates.h"
#include "src/model/pseudo_inertia.h"

namespace gapscope {
namespace {

// MuJoCo reports what it cannot refuse otherwise through mju_error, which by default ends the process.
[[noreturn]] void ThrowMujocoError(const char* message) { throw std::runtime_error(message); }
// What MuJoCo warns about (a state that blows up) is an outcome of a replay; by default it would write MUJOCO_LOG.TXT
// into the user's folder.
void DropMujocoWarning(const char*) {}

// In the order in which they are computed. mj_copySpec puts those of bodies first: friction would no longer follow the
// drive whose torque it holds.
std::vector<std::string> PluginInstances(const mjSpec& spec) {
  std::vector<std::string> names;
  auto* all = const_cast<mjSpec*>(&spec);  // MuJoCo's look-ups take no const
  for (mjsElement* e = mjs_firstElement(all, mjOBJ_PLUGIN); e; e = mjs_nextElement(all, e))
    names.emplace_back(mjs_getString(mjs_getName(e)));
  return names;
}

}  // namespace

std::string OneLine(std::string text) {
  std::replace(text.begin(), text.end(), '\n', ' ');
  return text;
}

namespace {

// The MJCF with what the experiment adds to it.
Result<SpecPtr> ReadSpec(Experiment* experiment) {
  char message[1024] = "";
  SpecPtr spec(mj_parseXML(experiment->model_path.c_str(), nullptr, message, sizeof message));
  if (!spec) return Error{.what = "cannot read the MJCF: " + OneLine(message), .where = experiment->model_path};
  GS_RETURN_IF_ERROR(CheckClaimedSizes(*spec, experiment->model_path));
  GS_RETURN_IF_ERROR(AddToSpec(experiment, spec.get()));
  return spec;
}

}  // namespace

Result<std::shared_ptr<const Rig>> Rig::Load(const Experiment& experiment) {
  mju_user_error = ThrowMujocoError;
  mju_user_warning = DropMujocoWarning;
  std::shared_ptr<Rig> rig(new Rig);
  rig->experiment_ = rig->as_given_ = experiment;
  GS_ASSIGN(const SpecPtr read, ReadSpec(&rig->experiment_));
  rig->spec_.reset(mj_copySpec(read.get()));
  rig->copies_ = PluginInstances(*rig->spec_) == PluginInstances(*read);
  try {
    // What was read is compiled, not a copy: copying leaves out what refers to nothing, which is an error here.
    rig->compiled_.reset(mj_compile(read.get(), nullptr));
  } catch (const std::exception& e) {
    return Error{.what = "MuJoCo refuses the model: " + OneLine(e.what()), .where = experiment.model_path};
  }
  if (!rig->compiled_) {
    return Error{.what = "the MJCF does not compile: " + OneLine(mjs_getError(read.get())),
                 .where = experiment.model_path};
  }
  GS_RETURN_IF_ERROR(AddInertiaParameters(*rig->compiled_, &rig->experiment_));
  rig->effects_ = Catalogue();
  GS_ASSIGN(CandidateEffects own, OwnCandidates(*rig));
  std::move(own.effects.begin(), own.effects.end(), std::back_inserter(rig->effects_));
  rig->left_out_ = std::move(own.left_out);
  std::stable_sort(rig->effects_.begin(), rig->effects_.end(),
                   [](const Effect& a, const Effect& b) { return a.name < b.name; });
  GS_RETURN_IF_ERROR(CheckSwitchedOff(*rig));
  return std::shared_ptr<const Rig>(std::move(rig));
}

SpecPtr Rig::CopySpec() const {
  const std::lock_guard lock(copying_);
  if (!copies_) {
    Experiment experiment = as_given_;
    if (auto again = ReadSpec(&experiment); again.ok()) return std::move(again).value();  // else the file has changed
  }
  return SpecPtr(mj_copySpec(spec_.get()));
}

std::vector<std::string> Rig::Joints() const {
  std::vector<std::string> names;
  for (mjsElement* e = mjs_firstElement(spec_.get(), mjOBJ_JOINT); e; e = mjs_nextElement(spec_.get(), e)) {
    const mjsJoint* joint = mjs_asJoint(e);
    const std::string name = mjs_getString(mjs_getName(e));
    if ((joint->type == mjJNT_HINGE || joint->type == mjJNT_SLIDE) && !name.empty()) names.push_back(name);
  }
  return names;
}

std::vector<std::string> Rig::Actuators() const {
  std::vector<std::string> names, joints;
  for (mjsElement* e = mjs_firstElement(spec_.get(), mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec_.get(), e)) {
    const mjsActuator* actuator = mjs_asActuator(e);
    const std::string target = mjs_getString(actuator->target), name = mjs_getString(mjs_getName(e));
    // Further actuators on the same joint are inputs of the first one's drive.
    if (actuator->trntype == mjTRN_JOINT && std::find(joints.begin(), joints.end(), target) != joints.end()) continue;
    joints.push_back(target);
    if (!name.empty()) names.push_back(name);
  }
  return names;
}

std::string Rig::JointOf(const std::string& actuator) const {
  const int id = mj_name2id(compiled_.get(), mjOBJ_ACTUATOR, actuator.c_str());
  const bool on_joint = id >= 0 && compiled_->actuator_trntype[id] == mjTRN_JOINT;
  return on_joint ? NameOf(*compiled_, mjOBJ_JOINT, compiled_->actuator_trnid[2 * id]) : "";
}

std::string Rig::ActuatorOf(const std::string& joint) const {
  for (const auto& name : Actuators()) {
    if (JointOf(name) == joint) return name;
  }
  return "";
}

DriveFacts Rig::FactsOf(const std::string& actuator) const {
  const int id = mj_name2id(compiled_.get(), mjOBJ_ACTUATOR, actuator.c_str());
  return id < 0 ? DriveFacts{} : gapscope::FactsOf(*compiled_, id);
}

bool Rig::HasSpring(const std::string& joint) const {
  const int id = mj_name2id(compiled_.get(), mjOBJ_JOINT, joint.c_str());
  return id >= 0 && compiled_->jnt_stiffness[id] != 0;
}

bool Rig::HasFriction(const std::string& joint) const {
  const int id = mj_name2id(compiled_.get(), mjOBJ_JOINT, joint.c_str());
  return id >= 0 && compiled_->dof_frictionloss[compiled_->jnt_dofadr[id]] > 0;
}

bool Rig::HasRange(const std::string& joint) const {
  const int id = mj_name2id(compiled_.get(), mjOBJ_JOINT, joint.c_str());
  return id >= 0 && compiled_->jnt_range[2 * id] < compiled_->jnt_range[2 * id + 1];
}

bool Rig::Sets(const std::string& field) const {
  return std::ranges::any_of(experiment_.settings, [&](const FieldSetting& setting) { return setting.field == field; });
}

std::vector<std::string> Rig::Bodies() const {
  std::vector<std::string> names;
  for (int body = 1; body < compiled_->nbody; ++body) {
    const std::string name = NameOf(*compiled_, mjOBJ_BODY, body);
    if (compiled_->body_jntnum[body] > 0 && !name.empty()) names.push_back(name);
  }
  return names;
}

int Rig::JointsAbove(const std::string& body) const {
  const mjModel& m = *compiled_;
  int joints = 0;
  for (int at = mj_name2id(&m, mjOBJ_BODY, body.c_str()); at > 0; at = m.body_parentid[at]) {
    for (int j = m.body_jntadr[at]; j < m.body_jntadr[at] + m.body_jntnum[at]; ++j)
      joints += m.jnt_type[j] == mjJNT_HINGE || m.jnt_type[j] == mjJNT_SLIDE;
  }
  return joints;
}

std::array<double, 3> Rig::CentreOf(const std::string& body) const {
  const double* centre = compiled_->body_ipos + 3 * mj_name2id(compiled_.get(), mjOBJ_BODY, body.c_str());
  return {centre[0], centre[1], centre[2]};
}

std::vector<std::string> Rig::Signals() const { return Collect(experiment_.measured, &MeasuredSpec::signal); }

std::string Rig::JointOfSignal(const std::string& signal) const {
  for (const auto& measured : experiment_.measured) {
    if (measured.signal != signal) continue;
    const SignalSite site = TraitsOf(measured.kind).site;
    return site == SignalSite::kJoint ? measured.on : site == SignalSite::kActuator ? JointOf(measured.on) : "";
  }
  return "";
}

int Rig::CommandOfSignal(const std::string& signal) const {
  const auto& commands = experiment_.commands;
  if (commands.size() == 1) return 0;
  const std::string joint = JointOfSignal(signal);
  for (std::size_t c = 0; !joint.empty() && c < commands.size(); ++c) {
    if (JointOf(commands[c].actuator) == joint) return static_cast<int>(c);
  }
  return -1;
}

CommandKind Rig::KindOfCommand(const std::string& actuator) const {
  for (const auto& command : experiment_.commands) {
    if (command.actuator == actuator) return command.kind;
  }
  return CommandKind::kOther;
}

}  // namespace gapscope
