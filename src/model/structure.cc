#include "src/model/structure.h"

#include <fmt/core.h>

#include <algorithm>

#include "src/core/names.h"
#include "src/model/fields.h"
#include "src/plugins/friction/friction.h"
#include "src/plugins/motor/motor_config.h"
#include "src/plugins/spring/spring.h"

namespace gapscope {

std::string ExactText(double value) { return fmt::format("{:.17g}", value); }

mjsBody* BodyOfInertia(mjSpec& spec, const std::string& field) {
  const bool moves = field.starts_with("body/") && (field.ends_with("/ipos") || field.ends_with("/pseudo_inertia"));
  return moves ? mjs_findBody(&spec, ElementOfField(field).c_str()) : nullptr;
}

void Structure::AddTerm(std::span<const plugins::ParameterSpec> specs, Terms* terms, const std::string& key,
                        const std::string& expression) {
  const plugins::ParameterSpec* spec = plugins::FindSpec(specs, key);
  GS_CHECK(spec && "a parameter of the plugin");
  auto [entry, added] = terms->emplace(key, expression);
  if (added) return;
  entry->second = spec->combine == plugins::Combine::kLower ? "min(" + entry->second + "," + expression + ")"
                                                            : entry->second + "+(" + expression + ")";
}

Structure::Structure(const Rig& rig)
    : spec(rig.CopySpec()), parameters(rig.experiment().parameters), settings(rig.experiment().settings), rig_(rig) {}

void Structure::Set(const std::string& field, std::vector<std::string> expressions) {
  settings.push_back({.field = field, .expressions = std::move(expressions), .where = "effect field " + field});
}

Status Structure::AddMotorTerm(const std::string& actuator, const std::string& key, const std::string& expression) {
  const std::string joint = rig_.JointOf(actuator);
  if (joint.empty()) return NoSuch("the model has no such actuator on a joint", actuator, rig_.Actuators(), "");
  AddTerm(plugins::kMotorSpecs, &motor_[joint], key, expression);
  Enter(kMotorTerms, joint, key);
  return Ok();
}

Status Structure::AddFrictionTerm(const std::string& joint, const std::string& key, const std::string& expression) {
  if (!FindJoint(joint)) return NoSuch("the model has no such joint", joint, rig_.Joints(), "");
  AddTerm(plugins::Friction::kSpecs, &friction_[joint], key, expression);
  Enter(kFrictionTerms, joint, key);
  return Ok();
}

Status Structure::AddSpringTerm(const std::string& joint, const std::string& key, const std::string& expression) {
  if (!FindJoint(joint)) return NoSuch("the model has no such joint", joint, rig_.Joints(), "");
  // Two springs on one joint keep their own rest angle: a sum of terms about zero does not exist, so two effects that
  // set the same number are refused.
  if (spring_[joint].contains(key)) {
    return Error{.what = "the joint '" + joint + "' has two effects that set '" + key + "'",
                 .allowed = "one",
                 .cure = "drop one of them"};
  }
  AddTerm(plugins::Spring::kSpecs, &spring_[joint], key, expression);
  Enter(kSpringTerms, joint, key);
  return Ok();
}

Status Structure::Replace(const std::string& field, std::vector<std::string> expressions) {
  if (std::find(replaced_.begin(), replaced_.end(), field) != replaced_.end()) {
    return Error{.what = "two effects change the field '" + field + "'", .allowed = "one", .cure = "drop one of them"};
  }
  replaced_.push_back(field);
  std::erase_if(settings, [&](const FieldSetting& setting) { return setting.field == field; });
  Set(field, std::move(expressions));
  return Ok();
}

Status Structure::AddPointMass(const std::string& body, const std::string& mass,
                               const std::vector<std::string>& position) {
  mjsBody* parent = mjs_findBody(spec.get(), body.c_str());
  if (!parent) return NoSuch("the model has no such body", body, rig_.Bodies(), "");
  mjsBody* point = mjs_addBody(parent, nullptr);
  const std::string name = body + ".payload";
  mjs_setName(point->element, name.c_str());
  point->explicitinertial = 1;
  point->mass = 0;
  Set("body/" + name + "/mass", {mass});
  Set("body/" + name + "/pos", position);
  return Ok();
}

Status Structure::AddSplit(Split split) {
  if (!FindJoint(split.joint)) return NoSuch("the model has no such joint", split.joint, rig_.Joints(), "");
  for (const auto& other : splits) {
    if (other.joint == split.joint) {
      return Error{.what = "the joint '" + split.joint + "' is split twice",
                   .allowed = "backlash or joint_compliance, not both"};
    }
  }
  Enter(kSplitTerms, split.joint, "");
  splits.push_back(std::move(split));
  return Ok();
}

}  // namespace gapscope
