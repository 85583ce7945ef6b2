#include "src/experiment/added_actuators.h"

#include <algorithm>
#include <cmath>

namespace gapscope {
namespace {

constexpr double kRoom = 5;  // a gain's bounds: this many times smaller and larger

// A number of an actuator that is a parameter too, and the fields of the model that it makes.
struct Number {
  const char *key, *unit;
  double value;
  bool positive;                                                         // zero means nothing there
  double least_high;                                                     // of the upper bound, where zero does
  std::vector<std::pair<std::string, std::vector<std::string>>> fields;  // '%' stands for the parameter
};

std::vector<Number> NumbersOf(const AddedActuator& a) {
  const std::string field = "actuator/" + a.name + "/";
  std::vector<Number> numbers;
  if (a.kind == AddedActuator::Kind::kPosition)
    numbers.push_back({"kp", "N m/rad", a.kp, true, 0, {{field + "kp", {"%"}}}});
  if (a.kind == AddedActuator::Kind::kPosition)
    numbers.push_back({"kd", "N m s/rad", a.kd, false, 0.1 * a.kp, {{field + "kv", {"%"}}}});
  if (a.kind == AddedActuator::Kind::kVelocity)
    numbers.push_back({"kd", "N m s/rad", a.kd, true, 0, {{field + "gain", {"%"}}, {field + "kv", {"%"}}}});
  if (a.force_limit)
    numbers.push_back({"force_limit_n_m", "N m", *a.force_limit, true, 0, {{field + "forcerange", {"-%", "%"}}}});
  if (a.armature)
    numbers.push_back(
        {"armature_kg_m2", "kg m2", *a.armature, false, 0.01, {{"joint/" + a.joint + "/armature", {"%"}}}});
  return numbers;
}

std::vector<std::string> WithName(std::vector<std::string> expressions, const std::string& name) {
  for (std::string& text : expressions) text.replace(text.find('%'), 1, name);
  return expressions;
}

void AddParameters(const AddedActuator& actuator, Experiment* experiment) {
  for (const Number& number : NumbersOf(actuator)) {
    const std::string name = NameForExpressions(actuator.name + "." + number.key);
    bool used = false;
    for (const auto& [field, expressions] : number.fields) {
      const bool theirs = std::ranges::any_of(experiment->settings, [&](const auto& s) { return s.field == field; });
      if (theirs) continue;
      experiment->settings.push_back(
          {.field = field, .expressions = WithName(expressions, name), .where = actuator.where});
      used = true;
    }
    const bool listed = std::ranges::any_of(experiment->parameters, [&](const auto& p) { return p.name == name; });
    if (!used || listed) continue;
    const double value = number.value;
    experiment->parameters.push_back(
        {.name = name,
         .unit = number.unit,
         .doc = "of the actuator that the experiment adds",
         .nominal = value,
         .low = number.positive ? value / kRoom : 0,
         .high = number.positive ? kRoom * value : std::max(kRoom * value, number.least_high),
         .frozen = true});
  }
}

std::optional<double> OptionalNumber(YamlMap& map, const char* key) {
  return map.Has(key) ? std::optional(map.Number(key)) : std::nullopt;
}

void CheckNumbers(YamlMap& map, const YAML::Node& item, const AddedActuator& a) {
  using enum AddedActuator::Kind;
  const auto wrong = [&](const char* key, double value, const char* allowed) {
    map.Fail(item, {.what = std::string("'") + key + "' of the actuator '" + a.name + "' is out of range",
                    .actual = std::to_string(value),
                    .allowed = allowed});
  };
  if (a.kind == kPosition && !(a.kp > 0)) wrong("kp", a.kp, "> 0, N m/rad");
  if (a.kind == kVelocity ? !(a.kd > 0) : !(a.kd >= 0))
    wrong("kd", a.kd, a.kind == kVelocity ? "> 0, N m s/rad" : ">= 0, N m s/rad");
  if (a.force_limit && !(*a.force_limit > 0)) wrong("force_limit_n_m", *a.force_limit, "> 0");
  if (a.armature && !(*a.armature >= 0)) wrong("armature_kg_m2", *a.armature, ">= 0");
  if ((a.kind != kPosition && map.Has("kp")) || (a.kind == kTorque && map.Has("kd"))) {
    map.Fail(item, {.what = "the actuator '" + a.name + "' has a gain that its kind does not have",
                    .allowed = "kp and kd of a position servo, kd of a velocity servo, none of a torque"});
  }
}

}  // namespace

std::string NameForExpressions(std::string name) {
  const auto good = [](char c) {
    return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || (c >= '0' && c <= '9') || c == '_' || c == '.';
  };
  for (char& c : name) c = good(c) ? c : '_';
  if (name.empty() || name[0] == '.' || (name[0] >= '0' && name[0] <= '9')) name.insert(0, "_");
  return name;
}

Status ReadAddedActuators(const std::vector<YAML::Node>& items, const std::string& path, Experiment* experiment) {
  for (const YAML::Node& item : items) {
    YamlMap map(item, path, "an actuator");
    AddedActuator actuator{.name = map.Text("name"), .where = YamlPlace(path, item)};
    actuator.joint = map.Text("joint");
    constexpr AddedActuator::Kind kKinds[] = {AddedActuator::Kind::kPosition, AddedActuator::Kind::kVelocity,
                                              AddedActuator::Kind::kTorque};
    actuator.kind = kKinds[map.Choice("kind", {"position", "velocity", "torque"}, 0)];
    actuator.kp = map.Number("kp", actuator.kind == AddedActuator::Kind::kPosition ? std::nullopt : std::optional(0.0));
    actuator.kd = map.Number("kd", actuator.kind == AddedActuator::Kind::kVelocity ? std::nullopt : std::optional(0.0));
    actuator.force_limit = OptionalNumber(map, "force_limit_n_m");
    actuator.armature = OptionalNumber(map, "armature_kg_m2");
    CheckNumbers(map, item, actuator);
    for (const AddedActuator& other : experiment->actuators) {
      if (NameForExpressions(other.name) == NameForExpressions(actuator.name))
        map.Fail(item, {.what = "the actuator '" + actuator.name + "' stands twice", .cure = "rename one"});
    }
    GS_RETURN_IF_ERROR(map.Finish());
    AddParameters(actuator, experiment);
    experiment->actuators.push_back(std::move(actuator));
  }
  return Ok();
}

Status ReadBodies(const YAML::Node& node, const std::string& path, const char* key, std::vector<NamedBody>* bodies) {
  if (!node.IsDefined()) return Ok();
  const auto fail = [&](const YAML::Node& at, const std::string& what) {
    return Error{
        .what = std::string("'") + key + "' " + what, .where = YamlPlace(path, at), .allowed = "a list of bodies"};
  };
  if (!node.IsSequence()) return fail(node, "is not a list of bodies");
  for (const YAML::Node& item : node) {
    if (!item.IsScalar() || item.Scalar().empty()) return fail(item, "names bodies");
    for (const NamedBody& other : *bodies) {
      if (other.name == item.Scalar()) return fail(item, "names the body '" + other.name + "' twice");
    }
    bodies->push_back({.name = item.Scalar(), .where = YamlPlace(path, item)});
  }
  return Ok();
}

}  // namespace gapscope
