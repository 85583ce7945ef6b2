#include "src/model/effect.h"

#include <algorithm>

#include "src/core/units.h"
#include "src/model/effects/catalogue.h"

namespace gapscope {

// One line per file in effects/, made by CMake.
#include "effects_table.inc"

const std::vector<Effect>& Catalogue() {
  static const std::vector<Effect> catalogue = [] {
    std::vector<Effect> all = MakeCatalogue();
    std::stable_sort(all.begin(), all.end(), [](const Effect& a, const Effect& b) { return a.name < b.name; });
    return all;
  }();
  return catalogue;
}

double ScaleOf(ScaleKind kind, const Scales& s) {
  switch (kind) {
    case ScaleKind::kOne:
      return 1;
    case ScaleKind::kTorque:
      return s.torque_n_m;
    case ScaleKind::kAngle:
      return s.angle_rad;
    case ScaleKind::kSpeed:
      return s.speed_rad_per_s;
    case ScaleKind::kStiffness:
      return s.torque_n_m / s.angle_rad;
    case ScaleKind::kDrag:
      return s.torque_n_m / (s.speed_rad_per_s * s.speed_rad_per_s);
    case ScaleKind::kPower:
      return s.torque_n_m * s.speed_rad_per_s;
    case ScaleKind::kCommand:
      return s.command;
    case ScaleKind::kCubic:
      return s.torque_n_m / (s.angle_rad * s.angle_rad * s.angle_rad);
  }
  return 1;
}

std::string ScaleName(const std::string& on, RigSize size) {
  return "scale@" + on + (size == RigSize::kTorque ? ".torque_n_m" : ".inertia_kg_m2");
}

namespace {

// Where an effect makes sense in this structure.
std::vector<std::string> Places(const Effect& effect, const Structure& structure) {
  std::vector<std::string> places;
  switch (effect.place) {
    case EffectPlace::kMotor:
    case EffectPlace::kServo:
      for (const auto& name : structure.Actuators()) {
        if (structure.JointOf(name).empty()) continue;
        if (effect.place == EffectPlace::kMotor || structure.IsServo(name)) places.push_back(name);
      }
      break;
    case EffectPlace::kJoint:
    case EffectPlace::kDrivenJoint:
    case EffectPlace::kSpringJoint:
      for (const auto& name : structure.Joints()) {
        if (effect.place == EffectPlace::kDrivenJoint && structure.ActuatorOf(name).empty()) continue;
        if (effect.place == EffectPlace::kSpringJoint && !structure.HasSpring(name)) continue;
        // What the base model already has is a parameter, not an effect.
        if (effect.name == "coulomb_friction" && structure.HasFriction(name)) continue;
        if (effect.name == "cable_spring" && structure.HasSpring(name)) continue;
        places.push_back(name);
      }
      break;
    case EffectPlace::kSignal:
      for (const auto& signal : structure.Signals()) places.push_back(signal);
      break;
  }
  return places;
}

std::string Join(const std::vector<std::string>& items) {
  std::string text;
  for (const auto& item : items) text += (text.empty() ? "" : ", ") + item;
  return text;
}

// The scales at a place; a motor's and its joint's are one.
Scales ScalesAt(const std::string& on, const Structure& structure, const ScaleTable& table) {
  for (const std::string& name : {on, structure.JointOf(on), structure.JointOfSignal(on)}) {
    if (const auto found = table.find(name); !name.empty() && found != table.end()) return found->second;
  }
  return {};
}

}  // namespace

Result<EffectUse> ParseEffectUse(const std::string& text, const Structure& structure) {
  const std::size_t at = text.find('@');
  const std::string name = text.substr(0, at), on = at == std::string::npos ? "" : text.substr(at + 1);
  std::vector<std::string> names, places;
  for (const Effect& effect : Catalogue()) {
    if (names.empty() || names.back() != effect.name) names.push_back(effect.name);
    if (effect.name != name) continue;
    for (const auto& place : Places(effect, structure)) places.push_back(place);
  }
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    const std::string nearest = Nearest(name, names);
    return Error{.what = "unknown effect",
                 .where = "--with " + text,
                 .actual = "'" + name + "'",
                 .allowed = Join(names),
                 .cure = nearest.empty() ? "" : "did you mean '" + nearest + "'?"};
  }
  if (places.empty()) {
    return Error{.what = "the effect '" + name + "' makes no sense in this model", .where = "--with " + text};
  }
  if (at == std::string::npos) return EffectUse{name, places.front()};
  if (std::find(places.begin(), places.end(), on) == places.end()) {
    return Error{.what = "the effect '" + name + "' cannot act there",
                 .where = "--with " + text,
                 .actual = "'" + on + "'",
                 .allowed = Join(places)};
  }
  return EffectUse{name, on};
}

std::vector<EffectUse> AllUses(const Structure& structure) {
  std::vector<EffectUse> uses;
  for (const Effect& effect : Catalogue()) {
    for (const auto& place : Places(effect, structure)) uses.push_back({effect.name, place});
  }
  return uses;
}

const Effect& EffectOf(const EffectUse& use, const Structure& structure) {
  for (const Effect& effect : Catalogue()) {
    if (effect.name != use.effect) continue;
    const auto places = Places(effect, structure);
    if (std::find(places.begin(), places.end(), use.on) != places.end()) return effect;
  }
  GS_CHECK(!"a valid effect use");
  return Catalogue().front();
}

std::vector<PlacedParameter> PlacedParameters(const EffectUse& use, const Structure& structure,
                                              const ScaleTable& table) {
  const Effect& effect = EffectOf(use, structure);
  const Scales scales = ScalesAt(use.on, structure, table);
  std::vector<PlacedParameter> placed;
  for (const EffectParameter& p : effect.parameters) {
    double scale = ScaleOf(p.scale, scales);
    std::string key = p.key, unit = p.unit;
    if (p.scale == ScaleKind::kCommand) {
      const std::string command = structure.CommandUnit(use.on);
      const bool electric = command == "V" || command == "A";
      key += command == "V" ? "_v" : command == "A" ? "_a" : "_n_m";
      unit = electric ? command : "N m";
      if (!electric) scale = scales.torque_n_m;
    }
    PlacedParameter out{.name = use.Text() + "." + key,
                        .key = key,
                        .unit = unit,
                        .neutral = p.neutral * scale,
                        .low = p.low * scale,
                        .high = p.high * scale,
                        .start = p.start * scale,
                        .shape = p.shape};
    if (p.voltage_only && structure.CommandUnit(use.on) != "V") out.low = out.high = out.start = out.neutral;
    for (const double trial : p.trials) out.trials.push_back(trial * scale);
    placed.push_back(std::move(out));
  }
  return placed;
}

Status ApplyEffect(Structure& structure, const EffectUse& use, const ScaleTable& table) {
  const Effect& effect = EffectOf(use, structure);
  const Scales scales = ScalesAt(use.on, structure, table);
  std::vector<std::string> names;
  for (const auto& p : PlacedParameters(use, structure, table)) {
    names.push_back(p.name);
    const Parameter::With with = effect.parameters[names.size() - 1].with;
    structure.AddParameter({.name = p.name,
                            .unit = p.unit,
                            .doc = effect.meaning,
                            .nominal = p.neutral,
                            .low = p.low,
                            .high = p.high,
                            .frozen = false,
                            .with = with,
                            .size = with == Parameter::With::kNone ? "" : names.front(),
                            .owner = Parameter::Owner::kEffect});
  }
  for (const auto& [size, value, unit] : {std::tuple{RigSize::kTorque, scales.torque_n_m, "N m"},
                                          std::tuple{RigSize::kInertia, scales.inertia_kg_m2, "kg m^2"}}) {
    const std::string name = ScaleName(use.on, size);
    const auto known = std::find_if(structure.parameters.begin(), structure.parameters.end(),
                                    [&](const Parameter& q) { return q.name == name; });
    if (known == structure.parameters.end())
      structure.AddParameter({.name = name,
                              .unit = unit,
                              .doc = "the rig's own size",
                              .nominal = value,
                              .low = value,
                              .high = value,
                              .frozen = true,
                              .owner = Parameter::Owner::kScale});
  }
  return effect.apply(structure, use.on, names);
}

}  // namespace gapscope
