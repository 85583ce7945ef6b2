#include "src/model/structure.h"

#include <algorithm>
#include <cmath>
#include <functional>
#include <set>

#include "src/core/units.h"
#include "src/experiment/expression.h"

namespace gapscope {
namespace {

constexpr double kTinyFriction = 1e-9;  // keeps the solver's friction row alive at zero friction
constexpr double kTinyInertia = 1e-9;   // of the motor side's body before its armature is written
constexpr const char* kMaxDelay_s = "0.13";
constexpr double kGapTimeConstant_s = 0.004;  // how stiff the flanks of a gap are

std::string NameOf(mjsElement* element) { return mjs_getString(mjs_getName(element)); }

Error NoSuch(const std::string& what, const std::string& name, const std::vector<std::string>& names) {
  std::string all;
  for (const auto& n : names) all += (all.empty() ? "" : ", ") + n;
  return Error{.what = "the model has no such " + what, .actual = "'" + name + "'", .allowed = all};
}

std::string TextOf(double value) {
  char text[32];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// Combines a second effect on the same stage: the lower of two limits, else the sum.
void Combine(Structure::Terms& terms, const std::string& key, const std::string& expression) {
  auto [entry, added] = terms.emplace(key, expression);
  if (added) return;
  entry->second = key == "torque_limit_n_m" || key == "power_w" ? "min(" + entry->second + "," + expression + ")"
                                                                : entry->second + "+(" + expression + ")";
}

void AddText(mjSpec* spec, const std::string& name, const std::string& value) {
  mjsText* text = mjs_addText(spec);
  mjs_setName(text->element, name.c_str());
  mjs_setString(text->data, value.c_str());
}

// A plugin instance of that name. Its attributes stand in custom texts: mjSpec's attribute map is a C++ object that
// crosses no library boundary.
void AddInstance(mjSpec* spec, const std::string& plugin, const std::string& instance,
                 const std::map<std::string, std::string>& attributes) {
  mjs_activatePlugin(spec, plugin.c_str());
  mjsPlugin* element = mjs_addPlugin(spec);
  mjs_setName(element->element, instance.c_str());
  mjs_setString(element->name, instance.c_str());
  mjs_setString(element->plugin_name, plugin.c_str());
  element->active = 1;
  for (const auto& [key, value] : attributes) AddText(spec, instance + "." + key, value);
}

void Attach(mjsPlugin* use, const std::string& plugin, const std::string& instance) {
  use->active = 1;
  mjs_setString(use->plugin_name, plugin.c_str());
  mjs_setString(use->name, instance.c_str());
}

}  // namespace

Result<Structure> Structure::Load(const Experiment& experiment) {
  char message[1024] = "";
  Structure structure;
  structure.spec.reset(mj_parseXML(experiment.model_path.c_str(), nullptr, message, sizeof message));
  if (!structure.spec) {
    std::string text = message;
    std::replace(text.begin(), text.end(), '\n', ' ');
    return Error{.what = "cannot read the MJCF: " + text, .where = experiment.model_path};
  }
  const SpecPtr copy(mj_copySpec(structure.spec.get()));
  structure.base_.reset(mj_compile(copy.get(), nullptr));
  if (!structure.base_) {
    std::string text = mjs_getError(copy.get());
    std::replace(text.begin(), text.end(), '\n', ' ');
    return Error{.what = "the MJCF does not compile: " + text, .where = experiment.model_path};
  }
  structure.experiment_ = &experiment;
  structure.parameters = experiment.parameters;
  structure.settings = experiment.settings;
  return structure;
}

mjsJoint* Structure::FindJoint(const std::string& name) const {
  mjsElement* element = mjs_findElement(spec.get(), mjOBJ_JOINT, name.c_str());
  return element ? mjs_asJoint(element) : nullptr;
}

mjsActuator* Structure::FindActuator(const std::string& name) const {
  mjsElement* element = mjs_findElement(spec.get(), mjOBJ_ACTUATOR, name.c_str());
  return element ? mjs_asActuator(element) : nullptr;
}

std::vector<std::string> Structure::Joints() const {
  std::vector<std::string> names;
  for (mjsElement* e = mjs_firstElement(spec.get(), mjOBJ_JOINT); e; e = mjs_nextElement(spec.get(), e)) {
    const mjsJoint* joint = mjs_asJoint(e);
    if ((joint->type == mjJNT_HINGE || joint->type == mjJNT_SLIDE) && !NameOf(e).empty()) names.push_back(NameOf(e));
  }
  return names;
}

std::vector<std::string> Structure::Actuators() const {
  std::vector<std::string> names, joints;
  for (mjsElement* e = mjs_firstElement(spec.get(), mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec.get(), e)) {
    const mjsActuator* actuator = mjs_asActuator(e);
    const std::string target = mjs_getString(actuator->target);
    // Further actuators on the same joint are inputs of the first one's drive.
    if (actuator->trntype == mjTRN_JOINT && std::find(joints.begin(), joints.end(), target) != joints.end()) continue;
    joints.push_back(target);
    if (!NameOf(e).empty()) names.push_back(NameOf(e));
  }
  return names;
}

std::string Structure::JointOf(const std::string& actuator) const {
  const mjsActuator* found = FindActuator(actuator);
  return found && found->trntype == mjTRN_JOINT ? mjs_getString(found->target) : "";
}

std::string Structure::ActuatorOf(const std::string& joint) const {
  for (const auto& name : Actuators()) {
    if (JointOf(name) == joint) return name;
  }
  return "";
}

bool Structure::IsServo(const std::string& actuator) const {
  const mjsActuator* found = FindActuator(actuator);
  if (!found) return false;
  if (!found->plugin.active) return found->biastype == mjBIAS_AFFINE && found->biasprm[1] != 0;
  // A plugin's law is only known to the compiled model.
  const int id = mj_name2id(base_.get(), mjOBJ_ACTUATOR, actuator.c_str());
  const int instance = id < 0 ? -1 : base_->actuator_plugin[id];
  const char* law = instance < 0 ? nullptr : mj_getPluginConfig(base_.get(), instance, "law");
  // A motor without a law follows a position (src/plugins/motor/README.md).
  if (instance < 0 || std::string_view(mjs_getString(found->plugin.plugin_name)) != "gapscope.motor") return false;
  return !law || !*law || std::string_view(law) == "position" || std::string_view(law) == "duty";
}

bool Structure::HasSpring(const std::string& joint) const {
  const mjsJoint* found = FindJoint(joint);
  return found && found->stiffness[0] != 0;
}

bool Structure::HasFriction(const std::string& joint) const {
  const mjsJoint* found = FindJoint(joint);
  return found && found->frictionloss > 0;
}

std::vector<std::string> Structure::Signals() const {
  std::vector<std::string> names;
  for (const auto& measured : experiment_->measured) names.push_back(measured.signal);
  return names;
}

std::string Structure::JointOfSignal(const std::string& signal) const {
  for (const auto& measured : experiment_->measured) {
    if (measured.signal == signal) return measured.kind == SignalKind::kTorque ? JointOf(measured.on) : measured.on;
  }
  return "";
}

std::string Structure::CommandUnit(const std::string& actuator) const {
  for (const auto& command : experiment_->commands) {
    if (command.actuator == actuator) return command.unit;
  }
  return "1";
}

void Structure::Set(const std::string& field, std::vector<std::string> expressions) {
  settings.push_back({.field = field, .expressions = std::move(expressions), .where = "effect"});
}

Status Structure::AddMotorTerm(const std::string& actuator, const std::string& key, const std::string& expression) {
  const std::string joint = JointOf(actuator);
  if (joint.empty()) return NoSuch("actuator on a joint", actuator, Actuators());
  Combine(motor_[joint], key, expression);
  return Ok();
}

Status Structure::AddFrictionTerm(const std::string& joint, const std::string& key, const std::string& expression) {
  if (!FindJoint(joint)) return NoSuch("joint", joint, Joints());
  Combine(friction_[joint], key, expression);
  return Ok();
}

Status Structure::AddSpringTerm(const std::string& joint, const std::string& key, const std::string& expression) {
  if (!FindJoint(joint)) return NoSuch("joint", joint, Joints());
  // Two springs on one joint keep their own rest angle: a sum of terms about zero does not exist, so two effects that
  // set the same number are refused.
  if (spring_[joint].contains(key)) {
    return Error{.what = "the joint '" + joint + "' has two effects that set '" + key + "'",
                 .allowed = "one",
                 .cure = "drop one of them"};
  }
  spring_[joint][key] = expression;
  return Ok();
}

Status Structure::AddSplit(Split split) {
  if (!FindJoint(split.joint)) return NoSuch("joint", split.joint, Joints());
  for (const auto& other : splits) {
    if (other.joint == split.joint) {
      return Error{.what = "the joint '" + split.joint + "' is split twice",
                   .allowed = "backlash or joint_compliance, not both"};
    }
  }
  splits.push_back(std::move(split));
  return Ok();
}

std::string Structure::MotorSide(const std::string& joint) const {
  const auto found = motor_joint.find(joint);
  return found == motor_joint.end() ? joint : found->second;
}

void Structure::AddNumeric(const std::string& name, double value) {
  if (mjs_findElement(spec.get(), mjOBJ_NUMERIC, name.c_str())) return;
  mjsNumeric* numeric = mjs_addNumeric(spec.get());
  mjs_setName(numeric->element, name.c_str());
  mjs_setDouble(numeric->data, &value, 1);
  numeric->size = 1;
}

double Structure::NominalOf(const std::string& expression) const {
  std::map<std::string, double> values;
  for (const auto& parameter : parameters) values[parameter.name] = parameter.nominal;
  for (const auto& value : experiment_->values) values[value.name] = value.fallback.value_or(1);
  const auto result = EvaluateOnce(expression, values, "effect");
  return result.ok() ? result.value() : 0;
}

Status Structure::Finish() {
  GS_RETURN_IF_ERROR(FinishSplits());
  GS_RETURN_IF_ERROR(FinishMotors());
  GS_RETURN_IF_ERROR(FinishFriction());
  return FinishSprings();
}

// The load keeps the joint, its body and everything measured; the motor side is a body of its own beside it that turns
// about the same axis and carries the actuator, the damping and the dry friction. A fixed tendon (motor angle less load
// angle) is the spring or the gap between them.
Status Structure::FinishSplits() {
  for (const auto& split : splits) {
    mjsJoint* joint = FindJoint(split.joint);
    mjsBody* body = mjs_getParent(joint->element);
    const std::string motor = split.joint + ".motor", tendon = split.joint + ".transmission";
    mjsBody* side = mjs_addBody(mjs_getParent(body->element), nullptr);
    mjs_setName(side->element, motor.c_str());
    std::copy_n(body->pos, 3, side->pos);
    std::copy_n(body->quat, 4, side->quat);
    side->alt = body->alt;
    side->mass = kTinyInertia;
    std::fill_n(side->ipos, 3, 0.0);
    std::fill_n(side->inertia, 3, kTinyInertia);
    side->explicitinertial = 1;
    mjsJoint* turn = mjs_addJoint(side, nullptr);
    mjs_setName(turn->element, motor.c_str());
    turn->type = joint->type;
    std::copy_n(joint->pos, 3, turn->pos);
    std::copy_n(joint->axis, 3, turn->axis);
    turn->ref = joint->ref;
    std::copy_n(joint->damping, mjNPOLY + 1, turn->damping);
    turn->frictionloss = joint->frictionloss;
    std::copy_n(joint->solref_friction, mjNREF, turn->solref_friction);
    std::copy_n(joint->solimp_friction, mjNIMP, turn->solimp_friction);
    turn->armature = kTinyInertia;
    std::fill_n(joint->damping, mjNPOLY + 1, 0.0);
    joint->frictionloss = 0;
    for (mjsElement* e = mjs_firstElement(spec.get(), mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec.get(), e)) {
      mjsActuator* actuator = mjs_asActuator(e);
      if (actuator->trntype == mjTRN_JOINT && mjs_getString(actuator->target) == split.joint)
        mjs_setString(actuator->target, motor.c_str());
    }
    mjsTendon* link = mjs_addTendon(spec.get(), nullptr);
    mjs_setName(link->element, tendon.c_str());
    mjs_wrapJoint(link, motor.c_str(), 1);
    mjs_wrapJoint(link, split.joint.c_str(), -1);
    link->springlength[0] = link->springlength[1] = 0;
    if (!split.gap.empty()) {
      link->limited = mjLIMITED_TRUE;
      link->range[0] = -1, link->range[1] = 1;
      link->solref_limit[0] = kGapTimeConstant_s, link->solref_limit[1] = 1;
      const mjtNum solimp[] = {0.95, 0.99, 0.0001, 0.5, 2};
      std::copy_n(solimp, 5, link->solimp_limit);
      Set("tendon/" + tendon + "/solref_limit", {std::to_string(kGapTimeConstant_s), split.damping});
      Set("tendon/" + tendon + "/range", {"-0.5*(" + split.gap + ")", "0.5*(" + split.gap + ")"});
    } else {
      link->stiffness[0] = 1;
      link->damping[0] = 1e-6;
      Set("tendon/" + tendon + "/stiffness", {split.stiffness});
      Set("tendon/" + tendon + "/damping", {split.damping});
    }
    for (auto& setting : settings) {
      for (const char* moved : {"/damping", "/damping_quadratic", "/frictionloss"}) {
        if (setting.field == "joint/" + split.joint + moved) setting.field = "joint/" + motor + moved;
      }
    }
    motor_joint[split.joint] = motor;
    // Motor terms are kept by joint: they follow the actuator.
    if (auto node = motor_.extract(split.joint); !node.empty()) {
      node.key() = motor;
      motor_.insert(std::move(node));
    }
    if (auto node = friction_.extract(split.joint); !node.empty()) {
      node.key() = motor;
      friction_.insert(std::move(node));
    }
  }
  return Ok();
}

Status Structure::FinishMotors() {
  for (const auto& [joint, terms] : motor_) {
    std::vector<mjsActuator*> inputs;
    for (mjsElement* e = mjs_firstElement(spec.get(), mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec.get(), e)) {
      mjsActuator* actuator = mjs_asActuator(e);
      if (actuator->trntype == mjTRN_JOINT && mjs_getString(actuator->target) == joint) inputs.push_back(actuator);
    }
    mjsActuator* drive = inputs.front();
    std::string instance;
    if (drive->plugin.active) {
      if (std::string(mjs_getString(drive->plugin.plugin_name)) != "gapscope.motor") {
        return Error{.what = "the actuator '" + NameOf(drive->element) + "' is a plugin of another kind",
                     .where = experiment_->model_path,
                     .actual = mjs_getString(drive->plugin.plugin_name),
                     .allowed = "a native actuator or gapscope.motor"};
      }
      instance = mjs_getString(drive->plugin.name);
    } else {
      instance = NameOf(drive->element);
      std::string roles;
      for (const mjsActuator* input : inputs) {
        const bool plain = input->gaintype == mjGAIN_FIXED && input->dyntype == mjDYN_NONE &&
                           (input->biastype == mjBIAS_NONE || input->biastype == mjBIAS_AFFINE);
        const bool feedforward = input != drive && input->biastype == mjBIAS_NONE && input->gainprm[0] == 1;
        if (!plain || (input != drive && !feedforward)) {
          return Error{
              .what = "the actuator '" + NameOf(input->element) + "' cannot take motor effects",
              .where = experiment_->model_path,
              .allowed =
                  "a stateless fixed-gain, affine-bias actuator, and plain motors of gain 1 beside it as feed-forward",
              .cure = "replace it by gapscope.motor"};
        }
        roles += input == drive ? "target" : " feedforward";
      }
      const double numbers[] = {drive->gainprm[0], drive->biasprm[0], drive->biasprm[1], drive->biasprm[2]};
      const bool affine = drive->biastype == mjBIAS_AFFINE;
      const char* keys[] = {"gain", "bias0", "bias1", "bias2"};
      for (int i = 0; i < 4; ++i) AddNumeric(instance + "." + keys[i], i == 0 || affine ? numbers[i] : 0);
      const bool electric = CommandUnit(instance) == "V" || CommandUnit(instance) == "A";
      AddInstance(spec.get(), "gapscope.motor", instance,
                  {{"law", "affine"}, {"inputs", roles}, {"dead_zone_on", electric ? "command" : "torque"}});
      for (mjsActuator* input : inputs) {
        Attach(&input->plugin, "gapscope.motor", instance);
        input->biastype = mjBIAS_NONE;
        std::fill_n(input->biasprm, mjNBIAS, 0.0);
      }
    }
    // Room for the longest delays that the catalogue allows, both together; a <config> of the model's own goes first.
    if (terms.contains("command_delay_s") || terms.contains("torque_delay_s"))
      AddText(spec.get(), instance + ".max_delay_s", kMaxDelay_s);
    // Lags and the sag keep their state in activations of the first actuator.
    drive->actdim = std::max(0, drive->actdim);  // MuJoCo's default, -1, counts as none
    for (const char* stage : {"time_constant_s", "second_time_constant_s", "sag_fraction"})
      drive->actdim += terms.contains(stage) ? 1 : 0;
    for (const auto& [key, expression] : terms) {
      AddNumeric(instance + "." + key, NominalOf(expression));
      Set("numeric/" + instance + "." + key, {expression});
    }
  }
  return Ok();
}

Status Structure::FinishFriction() {
  for (auto& [name, terms] : friction_) {
    const std::string joint = MotorSide(name);
    mjsJoint* element = FindJoint(joint);
    // MuJoCo's defaults creep: make the friction rows stiff (see docs/effects.md).
    const mjtNum solimp[] = {0.9999, 0.9999, 0.001, 0.5, 2};
    std::copy_n(solimp, mjNIMP, element->solimp_friction);
    element->solref_friction[0] = -1;
    element->solref_friction[1] = -0.9999 / spec->option.timestep;  // at -1/h stops give energy back
    const std::string base = "joint/" + joint + "/frictionloss";
    const auto set =
        std::find_if(settings.begin(), settings.end(), [&](const FieldSetting& s) { return s.field == base; });
    const std::string base_level = set != settings.end() ? set->expressions.front() : TextOf(element->frictionloss);
    if (element->frictionloss <= 0) element->frictionloss = kTinyFriction;
    if (set != settings.end()) settings.erase(set);
    if (terms.size() == 1 && terms.begin()->first == "friction_n_m") {
      Set(base, {TextOf(kTinyFriction) + "+" + base_level + "+" + terms.begin()->second});
      continue;
    }
    Set(base, {TextOf(kTinyFriction)});
    Combine(terms, "friction_n_m", base_level);
    const std::string instance = joint + ".friction";
    mjsBody* body = mjs_getParent(element->element);
    if (body->plugin.active) {
      return Error{.what = "the body of joint '" + joint + "' already has a plugin",
                   .where = experiment_->model_path,
                   .actual = mjs_getString(body->plugin.plugin_name),
                   .allowed = "one plugin per body",
                   .cure = "move it to a body of its own"};
    }
    AddInstance(spec.get(), "gapscope.friction", instance, {{"joint", joint}, {"row_softness", "0.01"}});
    Attach(&body->plugin, "gapscope.friction", instance);
    for (const auto& [key, expression] : terms) {
      AddNumeric(instance + "." + key, NominalOf(expression));
      Set("numeric/" + instance + "." + key, {expression});
    }
    if (terms.contains("load_coefficient")) {
      // A force-less actuator gives the plugin its turn after the drive, so that it sees this step's torque.
      mjsActuator* turn = mjs_addActuator(spec.get(), nullptr);
      mjs_setName(turn->element, instance.c_str());
      turn->trntype = mjTRN_JOINT;
      mjs_setString(turn->target, joint.c_str());
      Attach(&turn->plugin, "gapscope.friction", instance);
    }
  }
  return Ok();
}

Status Structure::FinishSprings() {
  for (const auto& [joint, terms] : spring_) {
    mjsJoint* element = FindJoint(joint);
    const bool linear = std::all_of(terms.begin(), terms.end(), [](const auto& t) {
      return t.first == "stiffness_n_m_per_rad" || t.first == "rest_rad";
    });
    if (linear && element->stiffness[0] == 0) {
      // MuJoCo's own spring does it.
      element->stiffness[0] = kTinyFriction;
      for (const auto& [key, expression] : terms)
        Set("joint/" + joint + (key == "rest_rad" ? "/springref" : "/stiffness"), {expression});
      continue;
    }
    const std::string instance = joint + ".spring";
    // A body carries one plugin: a friction plugin may be there, so the spring stands on a massless child.
    mjsBody* holder = mjs_addBody(mjs_getParent(element->element), nullptr);
    mjs_setName(holder->element, instance.c_str());
    holder->mass = kTinyInertia;
    std::fill_n(holder->inertia, 3, kTinyInertia * 1e-6);
    holder->explicitinertial = 1;
    AddInstance(spec.get(), "gapscope.spring", instance, {{"joint", joint}});
    Attach(&holder->plugin, "gapscope.spring", instance);
    for (const auto& [key, expression] : terms) {
      AddNumeric(instance + "." + key, NominalOf(expression));
      Set("numeric/" + instance + "." + key, {expression});
    }
  }
  return Ok();
}

}  // namespace gapscope
