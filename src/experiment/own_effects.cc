#include "src/experiment/own_effects.h"

#include <algorithm>
#include <cmath>
#include <optional>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/core/units.h"
#include "src/experiment/expression.h"
#include "src/plugins/common/parser.h"

namespace gapscope {
namespace {

constexpr const char* kNameRule = "letters, digits and '_', a letter first: EFFECT@PLACE.PARAMETER is made of it";

bool IsPlainName(const std::string& name) {
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  return !name.empty() && is_letter(name[0]) &&
         std::all_of(name.begin(), name.end(), [&](char c) { return is_letter(c) || (c >= '0' && c <= '9'); });
}

// What the expressions of a candidate may name beside its own parameters.
std::vector<std::string> OtherNames(const OwnEffect& effect, const Experiment& experiment) {
  if (!effect.plugin.empty()) return Collect(effect.config, [](const auto& pair) { return pair.first; });
  if (!effect.torque.empty()) {
    return {plugins::kFormulaInputs.begin(), plugins::kFormulaInputs.end()};
  }
  std::vector<std::string> names = Collect(experiment.parameters, &Parameter::name);
  for (const LogValue& value : experiment.values) names.push_back(value.name);
  return names;
}

std::vector<double> ReadTrials(YamlMap& map, const YAML::Node& node) {
  return node.IsSequence() ? map.NumberList("trials", node.size()) : map.NumberList("trials", 1);
}

// A number that must lie in the bounds.
void CheckInside(YamlMap& map, const YAML::Node& at, const OwnParameter& p, const char* what, double value) {
  if (p.low <= value && value <= p.high) return;
  map.Fail(at, {.what = std::string("'") + what + "' of the parameter '" + p.key + "' is outside its bounds",
                .actual = std::to_string(value),
                .allowed = std::to_string(p.low) + " to " + std::to_string(p.high)});
}

Status ReadParameter(const YAML::Node& key, const YAML::Node& node, const std::string& path, OwnParameter* p) {
  YamlMap map(node, path, "the parameter '" + p->key + "'");
  p->where = YamlPlace(path, key);
  p->unit = map.Text("unit");
  if (const auto unit = ParseSiUnit(p->unit); !unit.ok()) map.Fail(node, unit.error());
  const std::vector<double> bounds = map.NumberList("bounds", 2);
  if (bounds.size() == 2) {
    p->low = bounds[0], p->high = bounds[1];
  } else {
    map.Fail(node, {.what = "the parameter '" + p->key + "' has no bounds", .cure = "add 'bounds: [low, high]'"});
  }
  if (!(p->low < p->high)) {
    map.Fail(node, {.what = "the bounds of '" + p->key + "' hold no range",
                    .actual = std::to_string(p->low) + " to " + std::to_string(p->high),
                    .allowed = "low below high"});
  }
  p->neutral = map.Number("neutral", 0);
  if (const YAML::Node trials = map.Child("trials"); trials.IsDefined()) p->trials = ReadTrials(map, trials);
  p->start = map.Number("start", p->trials.empty() ? p->neutral : p->trials.front());
  if (map.Has("role")) {
    constexpr ParameterRole kRoles[] = {ParameterRole::kSize, ParameterRole::kPlace, ParameterRole::kShape,
                                        ParameterRole::kTime};
    p->role = kRoles[map.Choice("role", {"size", "place", "shape", "time"}, 0)];
  }
  CheckInside(map, node, *p, "neutral", p->neutral);
  for (const double trial : p->trials) CheckInside(map, node, *p, "trials", trial);
  CheckInside(map, node, *p, "start", p->start);
  return map.Finish();
}

Status ReadOwnParameters(const YAML::Node& node, const std::string& path, const std::vector<std::string>& others,
                         OwnEffect* effect) {
  YamlMap map(node, path, "'parameters' of the candidate '" + effect->name + "'");
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) break;
    OwnParameter parameter{.key = pair.first.Scalar()};
    const YAML::Node child = map.Child(parameter.key.c_str());
    const bool taken = parameter.key == "pi" || parameter.key == plugins::kFormulaDelay ||
                       std::find(others.begin(), others.end(), parameter.key) != others.end();
    if (taken || !IsPlainName(parameter.key)) {
      map.Fail(pair.first, {.what = taken ? "the name of a parameter means something else in its expression"
                                          : "not a name of a parameter",
                            .actual = "'" + parameter.key + "'",
                            .allowed = kNameRule,
                            .cure = "rename it"});
      break;
    }
    GS_RETURN_IF_ERROR(ReadParameter(pair.first, child, path, &parameter));
    effect->parameters.push_back(std::move(parameter));
  }
  return map.Finish();
}

// What a plugin reads shows only where it runs.
Status CheckExpressions(const OwnEffect& effect, std::vector<std::string> names) {
  if (!effect.plugin.empty()) return Ok();
  std::vector<FieldSetting> all = effect.settings;
  if (!effect.torque.empty())
    all.push_back({.field = "", .expressions = {effect.torque}, .where = effect.torque_where});
  for (const OwnParameter& p : effect.parameters) names.push_back(p.key);
  std::vector<double> ones(names.size(), 1.0);
  for (const FieldSetting& setting : all) {
    for (const std::string& text : setting.expressions) {
      if (const auto parsed = Expression::Parse(text, names, ones.data(), setting.where); !parsed.ok())
        return parsed.error();
    }
  }
  for (const OwnParameter& p : effect.parameters) {
    const bool enters = std::any_of(all.begin(), all.end(), [&](const FieldSetting& setting) {
      return std::any_of(setting.expressions.begin(), setting.expressions.end(),
                         [&](const std::string& text) { return Mentions(text, p.key); });
    });
    if (!enters) {
      return Error{.what = "the parameter '" + p.key + "' does not enter the candidate '" + effect.name + "'",
                   .where = p.where,
                   .cure = "delete it, or write it into the expression"};
    }
  }
  return Ok();
}

Status ReadConfig(const YAML::Node& node, const std::string& path, OwnEffect* effect) {
  YamlMap map(node, path, "'config' of the candidate '" + effect->name + "'");
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) break;
    const std::string key = pair.first.Scalar();
    if (key == "joint" || !IsPlainName(key)) {
      map.Fail(pair.first, {.what = "not an attribute of a plugin",
                            .actual = "'" + key + "'",
                            .allowed = "letters, digits and '_', a letter first; 'joint' is the candidate's"});
    }
    effect->config[key] = map.Text(key.c_str());
  }
  return map.Finish();
}

// A torque by a formula, a torque by a plugin, or a change of fields.
bool IsOneOfThem(const OwnEffect& effect, bool sets) {
  const int of_joint = (effect.torque.empty() ? 0 : 1) + (effect.plugin.empty() ? 0 : 1);
  return of_joint + (sets ? 1 : 0) == 1 && effect.joint.empty() == sets;
}

Status ReadOwnEffect(const YAML::Node& item, const std::string& path, Experiment* experiment) {
  YamlMap map(item, path, "a candidate");
  OwnEffect effect{.name = map.Text("name"), .where = YamlPlace(path, item)};
  effect.meaning = map.Text("doc", "");
  effect.joint = map.Text("joint", "");
  effect.torque = map.Text("torque", "");
  effect.plugin = map.Text("plugin", "");
  const YAML::Node set = map.Child("set"), parameters = map.Child("parameters"), config = map.Child("config");
  if (config.IsDefined() && effect.plugin.empty())
    map.Fail(config, {.what = "'config' is of a plugin, and the candidate has none"});
  if (!IsPlainName(effect.name)) {
    map.Fail(item, {.what = "not a name of a candidate", .actual = "'" + effect.name + "'", .allowed = kNameRule});
  }
  for (const OwnEffect& other : experiment->candidates) {
    if (other.name == effect.name)
      map.Fail(item, {.what = "the candidate '" + effect.name + "' stands twice", .cure = "rename one"});
  }
  if (!IsOneOfThem(effect, set.IsDefined())) {
    map.Fail(item, {.what = "the candidate '" + effect.name + "' is neither a torque nor a change of fields",
                    .allowed = "'joint' and 'torque', 'joint' and 'plugin', or 'set'"});
  }
  if (!parameters.IsDefined()) {
    map.Fail(item, {.what = "the candidate '" + effect.name + "' has no 'parameters'",
                    .cure = "add 'parameters: {NAME: {unit: ..., bounds: [low, high], trials: [...]}}'"});
  }
  GS_RETURN_IF_ERROR(map.Finish());
  if (config.IsDefined()) GS_RETURN_IF_ERROR(ReadConfig(config, path, &effect));
  if (set.IsDefined()) GS_RETURN_IF_ERROR(ReadFieldSettings(set, path, &effect.settings));
  for (const char* key : {"torque", "plugin"}) {
    if (const YAML::Node torque = item[key]; torque) effect.torque_where = YamlPlace(path, torque);
  }
  const std::vector<std::string> others = OtherNames(effect, *experiment);
  GS_RETURN_IF_ERROR(ReadOwnParameters(parameters, path, others, &effect));
  GS_RETURN_IF_ERROR(CheckExpressions(effect, others));
  experiment->candidates.push_back(std::move(effect));
  return Ok();
}

}  // namespace

Status ReadOwnEffects(const std::vector<YAML::Node>& items, const std::string& path, Experiment* experiment) {
  for (const YAML::Node& item : items) GS_RETURN_IF_ERROR(ReadOwnEffect(item, path, experiment));
  return Ok();
}

Status ReadSwitchedOff(const YAML::Node& node, const std::string& path, Experiment* experiment) {
  if (!node.IsDefined()) return Ok();
  const auto fail = [&](const YAML::Node& at) {
    return Error{.what = "'without' is not a list of effects",
                 .where = YamlPlace(path, at),
                 .allowed = "EFFECT or EFFECT@PLACE, as in [cogging, backlash@arm]"};
  };
  if (!node.IsSequence()) return fail(node);
  for (const YAML::Node& item : node) {
    if (!item.IsScalar()) return fail(item);
    const std::string text = item.Scalar();
    const std::size_t at = text.find('@');
    experiment->without.push_back({.effect = text.substr(0, at),
                                   .on = at == std::string::npos ? "" : text.substr(at + 1),
                                   .where = YamlPlace(path, item)});
  }
  return Ok();
}

Status ReadFieldSettings(const YAML::Node& node, const std::string& path, std::vector<FieldSetting>* settings) {
  YamlMap fields(node, path, "'set'");
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) break;
    FieldSetting setting{.field = pair.first.Scalar(),
                         .expressions = fields.TextList(pair.first.Scalar().c_str()),
                         .where = YamlPlace(path, pair.first)};
    if (setting.expressions.empty())
      fields.Fail(pair.first, {.what = "the field '" + setting.field + "' has no expression"});
    settings->push_back(std::move(setting));
  }
  return fields.Finish();
}

}  // namespace gapscope
