// The second half of a Structure: terms become elements of the MJCF.
#include <algorithm>
#include <cmath>

#include "src/experiment/expression.h"
#include "src/model/structure.h"
#include "src/plugins/expression/expression.h"
#include "src/plugins/friction/friction.h"
#include "src/plugins/motor/motor_config.h"
#include "src/plugins/spring/spring.h"

namespace gapscope {
namespace {

constexpr double kTinyFriction = 1e-9;        // keeps the solver's friction row alive at zero friction
constexpr double kTinyInertia = 1e-9;         // of the motor side's body before its armature is written
constexpr double kGapTimeConstant_s = 0.004;  // how stiff the flanks of a gap are

std::string NameOf(mjsElement* element) { return mjs_getString(mjs_getName(element)); }

std::string Sum(const std::string& a, const std::string& b) { return a == "0" ? b : a + "+(" + b + ")"; }

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
  const std::string prefix = instance + ".";
  for (const auto& [key, value] : attributes) AddText(spec, prefix + key, value);
}

void Attach(mjsPlugin* use, const std::string& plugin, const std::string& instance) {
  use->active = 1;
  mjs_setString(use->plugin_name, plugin.c_str());
  mjs_setString(use->name, instance.c_str());
}

}  // namespace

mjsJoint* Structure::FindJoint(const std::string& name) const {
  mjsElement* element = mjs_findElement(spec.get(), mjOBJ_JOINT, name.c_str());
  return element ? mjs_asJoint(element) : nullptr;
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
  for (const auto& value : rig_.experiment().values) values[value.name] = value.fallback.value_or(1);
  const auto result = EvaluateOnce(expression, values, "effect");
  return result.ok() ? result.value() : 0;
}

void Structure::AddLive(const std::string& instance, const Terms& terms) {
  const std::string prefix = instance + ".", field = "numeric/" + prefix;
  for (const auto& [key, expression] : terms) {
    AddNumeric(prefix + key, NominalOf(expression));
    Set(field + key, {expression});
  }
}

Status Structure::Finish() {
  if (form == Form::kNative) return FinishNative();
  for (const Split& split : splits) FinishSplit(split);
  for (const auto& [joint, terms] : motor_) GS_RETURN_IF_ERROR(FinishMotor(joint, terms));
  for (const auto& [joint, terms] : friction_) GS_RETURN_IF_ERROR(FinishFriction(joint, terms));
  for (const auto& [joint, terms] : spring_) FinishSpring(joint, terms);
  for (const OwnTorque& torque : own_torques_) FinishOwnTorque(torque);
  return Ok();
}

// The spring or the gap between the two sides.
void Structure::Link(const Split& split, const std::string& motor) {
  const std::string tendon = split.joint + kLink;
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
}

// The load keeps the joint, its body and everything measured; the motor side is a body of its own beside it that turns
// about the same axis and carries the actuator, the damping and the dry friction. A fixed tendon (motor angle less load
// angle) is the spring or the gap between them.
void Structure::FinishSplit(const Split& split) {
  mjsJoint* joint = FindJoint(split.joint);
  mjsBody* body = mjs_getParent(joint->element);
  const std::string motor = split.joint + kMotorSide;
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
  for (mjsActuator* actuator : ActuatorsOn(split.joint)) mjs_setString(actuator->target, motor.c_str());
  Link(split, motor);
  for (auto& setting : settings) {
    for (const char* moved : {"/damping", "/damping_quadratic", "/frictionloss"}) {
      if (setting.field == "joint/" + split.joint + moved) setting.field = "joint/" + motor + moved;
    }
  }
  motor_joint[split.joint] = motor;
  // Terms are kept by joint: those of the drive and of friction follow the actuator.
  for (auto* terms : {&motor_, &friction_}) {
    if (auto node = terms->extract(split.joint); !node.empty()) {
      node.key() = motor;
      terms->insert(std::move(node));
    }
  }
}

std::vector<mjsActuator*> Structure::ActuatorsOn(const std::string& joint) const {
  std::vector<mjsActuator*> found;
  for (mjsElement* e = mjs_firstElement(spec.get(), mjOBJ_ACTUATOR); e; e = mjs_nextElement(spec.get(), e)) {
    mjsActuator* actuator = mjs_asActuator(e);
    if (actuator->gaintype == mjGAIN_DCMOTOR && actuator->ctrlspec == mjINPUT_NONE) continue;  // no drive
    if (actuator->trntype == mjTRN_JOINT && mjs_getString(actuator->target) == joint) found.push_back(actuator);
  }
  return found;
}

Result<std::string> Structure::ConvertDrive(const std::vector<mjsActuator*>& inputs) {
  mjsActuator* drive = inputs.front();
  std::string roles;
  for (const mjsActuator* input : inputs) {
    const bool plain = input->gaintype == mjGAIN_FIXED && input->dyntype == mjDYN_NONE &&
                       (input->biastype == mjBIAS_NONE || input->biastype == mjBIAS_AFFINE);
    const bool feedforward =
        input != drive && input->biastype == mjBIAS_NONE && input->gainprm[0] == 1 && input->gear[0] == drive->gear[0];
    if (!plain || (input != drive && !feedforward)) {
      return Error{
          .what = "the actuator '" + NameOf(input->element) + "' cannot take motor effects",
          .where = rig_.experiment().model_path,
          .allowed =
              "a stateless fixed-gain, affine-bias actuator, and plain motors of gain 1 and its gear beside it as "
              "feed-forward",
          .cure = "replace it by " + std::string(plugins::kMotorName)};
    }
    roles += input == drive ? "target" : " feedforward";
  }
  const std::string instance = NameOf(drive->element);
  const double numbers[] = {drive->gainprm[0], drive->biasprm[0], drive->biasprm[1], drive->biasprm[2]};
  const bool affine = drive->biastype == mjBIAS_AFFINE;
  const char* keys[] = {"gain", "bias0", "bias1", "bias2"};
  for (int i = 0; i < 4; ++i) AddNumeric(instance + "." + keys[i], i == 0 || affine ? numbers[i] : 0);
  AddInstance(spec.get(), plugins::kMotorName, instance,
              {{"law", "affine"},
               {"inputs", roles},
               {"dead_zone_on", IsElectric(rig_.KindOfCommand(instance)) ? "command" : "torque"}});
  for (mjsActuator* input : inputs) {
    Attach(&input->plugin, plugins::kMotorName, instance);
    input->biastype = mjBIAS_NONE;
    std::fill_n(input->biasprm, mjNBIAS, 0.0);
  }
  return instance;
}

Status Structure::FinishMotor(const std::string& joint, const Terms& terms) {
  const std::vector<mjsActuator*> inputs = ActuatorsOn(joint);
  mjsActuator* drive = inputs.front();
  std::string instance = mjs_getString(drive->plugin.name);
  if (!drive->plugin.active) {
    GS_ASSIGN(instance, ConvertDrive(inputs));
  } else if (mjs_getString(drive->plugin.plugin_name) != std::string_view(plugins::kMotorName)) {
    return Error{.what = "the actuator '" + NameOf(drive->element) + "' is a plugin of another kind",
                 .where = rig_.experiment().model_path,
                 .actual = mjs_getString(drive->plugin.plugin_name),
                 .allowed = "a native actuator or " + std::string(plugins::kMotorName)};
  }
  // Lags and the sag keep their state in activations of the first actuator.
  drive->actdim = std::max(0, drive->actdim);  // MuJoCo's default, -1, counts as none
  for (const auto& [key, expression] : terms)
    drive->actdim += plugins::FindSpec(plugins::kMotorSpecs, key)->needs == plugins::Needs::kActivation ? 1 : 0;
  AddLive(instance, terms);
  return Ok();
}

// MuJoCo's defaults creep: make the friction rows stiff (see docs/reference/effects.md).
void Structure::Stiffen(mjsJoint* joint) {
  const mjtNum solimp[] = {0.9999, 0.9999, 0.001, 0.5, 2};
  std::copy_n(solimp, mjNIMP, joint->solimp_friction);
  joint->solref_friction[0] = -1;
  joint->solref_friction[1] = -0.9999 / spec->option.timestep;  // at -1/h stops give energy back
}

// What the experiment or the MJCF says of a field, as an expression; settings no longer have it.
std::string Structure::Take(const std::string& field, double own) {
  const auto set = std::ranges::find(settings, field, &FieldSetting::field);
  if (set == settings.end()) return ExactText(own);
  std::string expression = set->expressions.front();
  settings.erase(set);
  return expression;
}

Status Structure::FinishFriction(const std::string& name, Terms terms) {
  const std::string joint = MotorSide(name);
  mjsJoint* element = FindJoint(joint);
  const plugins::ParameterSpec &level = plugins::Friction::kSpecs[plugins::Friction::kFriction],
                               &drag = plugins::Friction::kSpecs[plugins::Friction::kQuadratic];
  const std::string of_joint = "joint/" + joint + "/", base = of_joint + level.native;
  const bool own = std::ranges::all_of(
      terms, [&](const auto& term) { return *plugins::FindSpec(plugins::Friction::kSpecs, term.first)->native; });
  if (const auto term = terms.find(drag.key); own && term != terms.end()) {
    Set(of_joint + drag.native, {Sum(Take(of_joint + drag.native, element->damping[1]), term->second)});
    terms.erase(term);
    if (terms.empty()) return Ok();
  }
  Stiffen(element);
  const std::string base_level = Take(base, element->frictionloss);
  if (element->frictionloss <= 0) element->frictionloss = kTinyFriction;
  if (own) {
    Set(base, {ExactText(kTinyFriction) + "+" + base_level + "+" + terms.at(level.key)});
    return Ok();
  }
  Set(base, {ExactText(kTinyFriction)});
  AddTerm(plugins::Friction::kSpecs, &terms, level.key, base_level);
  const std::string instance = joint + ".friction";
  mjsBody* body = mjs_getParent(element->element);
  if (body->plugin.active) {
    return Error{.what = "the body of joint '" + joint + "' already has a plugin",
                 .where = rig_.experiment().model_path,
                 .actual = mjs_getString(body->plugin.plugin_name),
                 .allowed = "one plugin per body",
                 .cure = "move it to a body of its own"};
  }
  AddInstance(spec.get(), plugins::Friction::kName, instance, {{"joint", joint}, {"row_softness", "0.01"}});
  Attach(&body->plugin, plugins::Friction::kName, instance);
  AddLive(instance, terms);
  const bool turn = std::any_of(terms.begin(), terms.end(), [](const auto& term) {
    return plugins::FindSpec(plugins::Friction::kSpecs, term.first)->needs == plugins::Needs::kTurn;
  });
  if (turn) {
    // A force-less actuator gives the plugin its turn after the drive, so that it sees this step's torque.
    mjsActuator* after = mjs_addActuator(spec.get(), nullptr);
    mjs_setName(after->element, instance.c_str());
    after->trntype = mjTRN_JOINT;
    mjs_setString(after->target, joint.c_str());
    Attach(&after->plugin, plugins::Friction::kName, instance);
  }
  return Ok();
}

// Where no other spring has another rest angle. A spring that does would need a rest angle between the two, which is a
// quotient, and none exists once one of them hardens.
bool Structure::TakesSpring(const mjsJoint& joint, const Terms& terms) const {
  const auto is_set = [&](const char* field) {
    return std::ranges::find(settings, "joint/" + NameOf(joint.element) + "/" + field, &FieldSetting::field) !=
           settings.end();
  };
  if (is_set("springref")) return false;
  const bool rests = terms.contains(plugins::Spring::kSpecs[plugins::Spring::kRest].key);
  const bool free = !is_set("stiffness") && !is_set("stiffness_cubic") &&
                    std::ranges::all_of(joint.stiffness, [](double coefficient) { return coefficient == 0; });
  return rests ? free : joint.springref == 0;
}

void Structure::FinishSpring(const std::string& joint, Terms terms) {
  mjsJoint* element = FindJoint(joint);
  const std::string of_joint = "joint/" + joint + "/", rest = "springref";
  const bool takes = TakesSpring(*element, terms);
  const double stiffness = element->stiffness[0], cubic = element->stiffness[2];
  std::erase_if(terms, [&](const auto& term) {
    const std::string native = plugins::FindSpec(plugins::Spring::kSpecs, term.first)->native;
    if (!takes || native.empty()) return false;
    if (stiffness == 0) element->stiffness[0] = kTinyFriction;
    const std::string field = of_joint + native;
    const std::string base = native == rest ? "0" : Take(field, native == "stiffness" ? stiffness : cubic);
    Set(field, {Sum(base, term.second)});
    return true;
  });
  if (form == Form::kPlugins) AddStop(joint, &terms);
  if (terms.empty()) return;
  const std::string instance = joint + ".spring";
  AddInstance(spec.get(), plugins::Spring::kName, instance, {{"joint", joint}});
  HoldPlugin(element, plugins::Spring::kName, instance);
  AddLive(instance, terms);
}

// A tendon whose spring is slack before the stop. While a fit moves a stop, the plugin has it: the tendon stands on one
// side of the joint.
void Structure::AddStop(const std::string& joint, Terms* terms) {
  const plugins::ParameterSpec &stiffness = plugins::Spring::kSpecs[plugins::Spring::kStop],
                               &angle = plugins::Spring::kSpecs[plugins::Spring::kStopAngle];
  if (!terms->contains(stiffness.key)) return;
  const std::string far = "1e6";  // the other end of the free way
  const std::string stop = terms->contains(angle.key) ? terms->at(angle.key) : ExactText(angle.neutral);
  const mjsJoint* element = FindJoint(joint);
  const std::string name = joint + ".stop", of_tendon = "tendon/" + name + "/";
  mjsTendon* tendon = mjs_addTendon(spec.get(), nullptr);
  mjs_setName(tendon->element, name.c_str());
  mjs_wrapJoint(tendon, joint.c_str(), 1);
  tendon->stiffness[0] = 1;
  const bool above = value_of(stop) >= 0.5 * (element->range[0] + element->range[1]);
  Set(of_tendon + "stiffness", {terms->at(stiffness.key)});
  Set(of_tendon + "springlength", {above ? "-" + far : stop, above ? stop : far});
  terms->erase(stiffness.key);
  terms->erase(angle.key);
}

void Structure::HoldPlugin(const mjsJoint* joint, const std::string& plugin, const std::string& instance) {
  mjsBody* holder = mjs_addBody(mjs_getParent(joint->element), nullptr);
  mjs_setName(holder->element, instance.c_str());
  holder->mass = kTinyInertia;
  std::fill_n(holder->ipos, 3, 0.0);
  std::fill_n(holder->inertia, 3, kTinyInertia * 1e-6);
  holder->explicitinertial = 1;
  Attach(&holder->plugin, plugin, instance);
}

void Structure::FinishOwnTorque(const OwnTorque& torque) {
  const std::string instance = OwnInstance(torque.joint, torque.name);
  std::map<std::string, std::string> attributes = torque.config;
  attributes["joint"] = torque.joint;
  Terms live = torque.parameters;
  if (torque.of_command) {
    attributes["actuator"] = rig_.ActuatorOf(torque.joint);
    // During a replay the host delays what it sends; an exported model's formula must see it late by itself.
    const char* delay = plugins::kFormulaDelay;
    const auto drive = motor_.find(MotorSide(torque.joint));
    if (drive != motor_.end() && drive->second.contains(delay)) live[delay] = drive->second.at(delay);
  }
  AddInstance(spec.get(), torque.plugin, instance, attributes);
  HoldPlugin(FindJoint(torque.joint), torque.plugin, instance);
  AddLive(instance, live);
}

}  // namespace gapscope
