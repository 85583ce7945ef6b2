#include "src/model/effect.h"

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/model/effects/catalogue.h"
#include "src/model/pseudo_inertia.h"

namespace gapscope {

// One line per file in effects/, made by CMake.
#include "effects_table.inc"

namespace {

std::vector<Effect>& OwnEffects() {
  static std::vector<Effect> effects;
  return effects;
}

}  // namespace

void AddToCatalogue(Effect effect) { OwnEffects().push_back(std::move(effect)); }

const std::vector<Effect>& Catalogue() {
  static const std::vector<Effect> catalogue = [] {
    std::vector<Effect> all = MakeCatalogue();
    for (Effect& own : OwnEffects()) all.push_back(std::move(own));
    std::stable_sort(all.begin(), all.end(), [](const Effect& a, const Effect& b) { return a.name < b.name; });
    return all;
  }();
  return catalogue;
}

namespace {

std::vector<std::string> NamesOf(const std::vector<Effect>& effects) {
  std::vector<std::string> names;
  for (const Effect& effect : effects) {
    if (names.empty() || names.back() != effect.name) names.push_back(effect.name);
  }
  return names;
}

}  // namespace

std::vector<std::string> EffectNames() { return NamesOf(Catalogue()); }

std::string EffectTitle(const std::string& name) {
  for (const Effect& effect : Catalogue()) {
    if (effect.name == name && !effect.title.empty()) return effect.title;
  }
  std::string title = name;
  std::replace(title.begin(), title.end(), '_', ' ');
  return title;
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
    case ScaleKind::kMass:
      return s.mass_kg;
    case ScaleKind::kLength:
      return s.length_m;
  }
  return 1;
}

bool IsOfTorque(ScaleKind kind) {
  using enum ScaleKind;
  return kind == kTorque || kind == kStiffness || kind == kDrag || kind == kCubic;
}

constexpr char kScaleHead[] = "scale@";

std::string ScaleName(const std::string& on, RigSize size) {
  const char* of = size == RigSize::kTorque ? ".torque_n_m" : size == RigSize::kPeak ? ".peak_n_m" : ".inertia_kg_m2";
  return kScaleHead + on + of;
}

bool IsScaleName(std::string_view name) { return name.starts_with(kScaleHead); }

namespace {

// Where an effect makes sense in this rig.
std::vector<std::string> PossiblePlaces(const Effect& effect, const Rig& rig) {
  std::vector<std::string> places;
  switch (effect.place) {
    case EffectPlace::kMotor:
    case EffectPlace::kServo:
      for (const auto& name : rig.Actuators()) {
        if (rig.JointOf(name).empty()) continue;
        if (effect.place == EffectPlace::kMotor || rig.FactsOf(name).feeds_back_position) places.push_back(name);
      }
      break;
    case EffectPlace::kJoint:
    case EffectPlace::kDrivenJoint:
    case EffectPlace::kSpringJoint:
      for (const auto& name : rig.Joints()) {
        if (effect.place == EffectPlace::kDrivenJoint && rig.ActuatorOf(name).empty()) continue;
        if (effect.place == EffectPlace::kSpringJoint && !rig.HasSpring(name)) continue;
        // What the base model already has is a parameter, not an effect.
        if (effect.base_term == BaseTerm::kDryFriction && rig.HasFriction(name)) continue;
        if (effect.base_term == BaseTerm::kSpring && rig.HasSpring(name)) continue;
        places.push_back(name);
      }
      break;
    case EffectPlace::kSignal:
      for (const auto& signal : rig.Signals()) places.push_back(signal);
      break;
    case EffectPlace::kBody:
      places = rig.Bodies();
      break;
    case EffectPlace::kModel:
      if (!rig.Sets("option/gravity")) places.emplace_back(kOnModel);
      break;
    case EffectPlace::kNamed:
      places.push_back(effect.on);
      break;
  }
  return places;
}

// Whether the experiment switches the effect off there.
bool IsOff(const std::string& effect, const std::string& on, const Rig& rig) {
  const auto& without = rig.experiment().without;
  return std::any_of(without.begin(), without.end(),
                     [&](const SwitchedOff& off) { return off.effect == effect && (off.on.empty() || off.on == on); });
}

// Where an effect may act in this rig.
std::vector<std::string> Places(const Effect& effect, const Rig& rig) {
  std::vector<std::string> places = PossiblePlaces(effect, rig);
  std::erase_if(places, [&](const std::string& on) { return IsOff(effect.name, on, rig); });
  return places;
}

bool IsOneOf(const std::string& text, const std::vector<std::string>& list) {
  return std::find(list.begin(), list.end(), text) != list.end();
}

// Where an effect acts that all drives, or all signals, share. None: the size's key would be another on each drive.
std::vector<std::string> SharedPlaces(const Effect& effect, const Rig& rig) {
  if (effect.place == EffectPlace::kBody || effect.place == EffectPlace::kModel) return {};
  std::vector<std::string> places = Places(effect, rig);
  if (IsOneOf(kOnAll, places)) return {};
  const bool on_joints = effect.place != EffectPlace::kMotor && effect.place != EffectPlace::kServo &&
                         effect.place != EffectPlace::kSignal;
  if (on_joints) std::erase_if(places, [&](const std::string& joint) { return rig.ActuatorOf(joint).empty(); });
  const bool of_command = std::any_of(effect.parameters.begin(), effect.parameters.end(),
                                      [](const auto& p) { return p.scale == ScaleKind::kCommand; });
  for (const std::string& place : places) {
    if (of_command && rig.KindOfCommand(place) != rig.KindOfCommand(places.front())) return {};
  }
  return places;
}

// Times and shares are no larger on a larger drive.
bool HasNoScale(const Effect& effect) {
  return std::all_of(effect.parameters.begin(), effect.parameters.end(),
                     [](const auto& p) { return p.scale == ScaleKind::kOne; });
}

// The entry of a use in the catalogue and where that acts; null: no such place. On all, of a name that stands twice,
// the first.
std::pair<const Effect*, std::vector<std::string>> Placed(const EffectUse& use, const Rig& rig) {
  for (const Effect& effect : rig.effects()) {
    if (effect.name == use.effect && IsOneOf(use.on, Places(effect, rig))) return {&effect, {use.on}};
  }
  for (const Effect& effect : rig.effects()) {
    if (effect.name != use.effect || use.on != kOnAll) continue;
    if (auto places = SharedPlaces(effect, rig); !places.empty()) return {&effect, std::move(places)};
  }
  return {};
}

// All uses, of one size for all places too whatever that says.
std::vector<EffectUse> EveryUse(const Rig& rig) {
  std::vector<EffectUse> uses;
  for (const Effect& effect : rig.effects()) {
    for (const auto& place : Places(effect, rig)) uses.push_back({effect.name, place});
    const auto [shared, all] = Placed({effect.name, kOnAll}, rig);
    if (shared == &effect && all.size() > 1) uses.push_back({effect.name, kOnAll});
  }
  return uses;
}

// What the model says of a body by its own frame.
Scales ScalesOfBody(const std::string& name, const Rig& rig) {
  const mjModel& m = rig.compiled();
  const int body = mj_name2id(&m, mjOBJ_BODY, name.c_str());
  const BodyInertia inertia = InertiaOf(m, body);
  Scales scales;
  if (inertia.mass_kg > 0) {
    scales.mass_kg = inertia.mass_kg;
    scales.length_m = LengthOf(inertia);
  }
  return scales;
}

// The scales at a place of the effect; a motor's and its joint's are one.
Scales ScalesAt(const Effect& effect, const std::string& on, const Rig& rig, const ScaleTable& table) {
  if (effect.place == EffectPlace::kBody) return ScalesOfBody(on, rig);
  for (const std::string& name : {on, rig.JointOf(on), rig.JointOfSignal(on)}) {
    if (const auto found = table.find(name); !name.empty() && found != table.end()) return found->second;
  }
  return {};
}

Result<EffectUse> ParseEffectUse(const std::string& text, const Rig& rig) {
  const std::size_t at = text.find('@');
  const std::string name = text.substr(0, at), on = at == std::string::npos ? "" : text.substr(at + 1);
  const std::vector<std::string> names = NamesOf(rig.effects());
  std::vector<std::string> places;
  for (const Effect& effect : rig.effects()) {
    if (effect.name != name) continue;
    for (const auto& place : Places(effect, rig)) places.push_back(place);
  }
  if (std::find(names.begin(), names.end(), name) == names.end()) {
    for (const LeftOutCandidate& candidate : rig.left_out()) {
      if (candidate.name == name) return Error{.what = candidate.Text(), .where = "--with " + text};
    }
    return NoSuch("unknown effect", name, names, "--with " + text);
  }
  if (IsOff(name, on, rig)) {
    return Error{.what = "the effect '" + name + "' is switched off for this experiment",
                 .where = "--with " + text,
                 .cure = "take it out of 'without' in " + rig.experiment().path};
  }
  if (places.empty()) {
    return Error{.what = "the effect '" + name + "' makes no sense in this model", .where = "--with " + text};
  }
  if (at == std::string::npos) return EffectUse{name, places.front()};
  const auto where = Placed({name, on}, rig).second;
  if (where.size() == 1) return EffectUse{name, where.front()};
  if (where.empty()) {
    if (Placed({name, kOnAll}, rig).second.size() > 1) places.emplace_back(kOnAll);
    return Error{.what = "the effect '" + name + "' cannot act there",
                 .where = "--with " + text,
                 .actual = "'" + on + "'",
                 .allowed = Join(places)};
  }
  return EffectUse{name, on};
}

}  // namespace

Result<std::vector<EffectUse>> ParseEffects(const std::vector<std::string>& texts, const Rig& rig) {
  std::vector<EffectUse> uses;
  for (const auto& text : texts) {
    GS_ASSIGN(EffectUse use, ParseEffectUse(text, rig));
    if (std::find(uses.begin(), uses.end(), use) != uses.end())
      return Error{.what = "the effect stands twice", .where = "--with " + text};
    uses.push_back(std::move(use));
  }
  GS_RETURN_IF_ERROR(CheckTogether(uses, rig));
  return uses;
}

Status CheckTogether(const std::vector<EffectUse>& uses, const Rig& rig) {
  for (const EffectUse& shared : uses) {
    const std::vector<std::string> places = PlacesOf(shared, rig);
    if (places.size() < 2) continue;
    for (const EffectUse& single : uses) {
      if (single.effect != shared.effect || !IsOneOf(single.on, places)) continue;
      const auto each = Collect(places, [&](const std::string& on) { return EffectUse{shared.effect, on}.Text(); });
      return Error{.what = "the effect stands on all places at one size and on one of them by itself",
                   .where = "--with " + shared.Text() + " --with " + single.Text(),
                   .allowed = "one of the two",
                   .cure = "give each place its own size: " + Join(each)};
    }
  }
  return Ok();
}

Status CheckSwitchedOff(const Rig& rig) {
  for (const SwitchedOff& off : rig.experiment().without) {
    bool known = false;
    std::vector<std::string> places;
    for (const Effect& effect : rig.effects()) {
      if (effect.name != off.effect) continue;
      known = true;
      for (const auto& place : PossiblePlaces(effect, rig)) places.push_back(place);
    }
    if (!known) return NoSuch("'without' names an unknown effect", off.effect, NamesOf(rig.effects()), off.where);
    if (!off.on.empty() && !IsOneOf(off.on, places))
      return NoSuch("'without' names the effect '" + off.effect + "' where it cannot act", off.on, places, off.where);
  }
  return Ok();
}

std::vector<EffectUse> AllUses(const Rig& rig) {
  // With one drive, what all signals share is what that drive does.
  const auto drives = rig.Actuators();
  const bool several =
      std::count_if(drives.begin(), drives.end(), [&](const auto& name) { return !rig.JointOf(name).empty(); }) > 1;
  std::vector<EffectUse> uses = EveryUse(rig);
  std::erase_if(uses, [&](const EffectUse& use) {
    const auto [effect, places] = Placed(use, rig);
    // What weighs on one driven joint alone is an unbalanced mass there.
    if (effect->place == EffectPlace::kBody && (!several || rig.JointsAbove(use.on) < 2)) return true;
    if (effect->place == EffectPlace::kModel && !several) return true;
    if (effect->of_range && !std::ranges::all_of(places, [&](const auto& on) { return rig.HasRange(on); })) return true;
    return places.size() > 1 && !(several && HasNoScale(*effect));
  });
  return uses;
}

std::vector<std::string> PlacesOf(const EffectUse& use, const Rig& rig) { return Placed(use, rig).second; }

std::vector<EffectUse> ActuatorModel(const Rig& rig) {
  std::map<int, EffectUse> stages;
  for (const EffectUse& use : AllUses(rig)) {
    if (const int stage = EffectOf(use, rig).actuator_stage; stage > 0) stages.emplace(stage, use);
  }
  return Collect(stages, [](const auto& entry) { return entry.second; });
}

const Effect& EffectOf(const EffectUse& use, const Rig& rig) {
  const Effect* effect = Placed(use, rig).first;
  GS_CHECK(effect && "a valid effect use");
  return *effect;
}

namespace {

bool AreHinges(const std::vector<std::string>& joints, const Rig& rig) {
  const mjModel& m = rig.compiled();
  return std::ranges::all_of(joints, [&](const std::string& joint) {
    const int j = mj_name2id(&m, mjOBJ_JOINT, joint.c_str());
    return j >= 0 && m.jnt_type[j] == mjJNT_HINGE;
  });
}

}  // namespace

std::vector<PlacedParameter> PlacedParameters(const EffectUse& use, const Rig& rig, const ScaleTable& table) {
  const auto [effect_of, places] = Placed(use, rig);
  GS_CHECK(effect_of && "a valid effect use");
  const Effect& effect = *effect_of;
  const bool volts = std::all_of(places.begin(), places.end(), [&](const std::string& place) {
    return rig.KindOfCommand(place) == CommandKind::kVoltage;
  });
  std::vector<PlacedParameter> placed;
  for (const EffectParameter& p : effect.parameters) {
    ScaleKind kind = p.scale;
    std::string key = p.key, unit = p.unit;
    if (kind == ScaleKind::kCommand) {
      const CommandKind command = rig.KindOfCommand(places.front());
      key += volts ? "_v" : IsElectric(command) ? "_a" : "_n_m";
      unit = volts ? "V" : IsElectric(command) ? "A" : "N m";
      if (!IsElectric(command)) kind = ScaleKind::kTorque;
    }
    double scale = 0, zero = 0;
    for (const std::string& place : places) scale = std::max(scale, ScaleOf(kind, ScalesAt(effect, place, rig, table)));
    if (p.from_centre >= 0) zero = rig.CentreOf(places.front())[static_cast<std::size_t>(p.from_centre)];
    PlacedParameter out{.name = use.Text() + "." + key,
                        .key = key,
                        .unit = unit,
                        .role = p.role,
                        .scale = kind,
                        .neutral = zero + p.neutral * scale,
                        .low = zero + p.low * scale,
                        .high = zero + p.high * scale,
                        .start = zero + p.start * scale};
    if (p.reach_rad > 0 && AreHinges(places, rig))
      out.low = std::min(out.low, zero - p.reach_rad), out.high = std::max(out.high, zero + p.reach_rad);
    if (p.voltage_only && !volts) out.low = out.high = out.start = out.neutral;
    for (const double trial : p.trials) out.trials.push_back(zero + trial * scale);
    placed.push_back(std::move(out));
  }
  return placed;
}

std::optional<EffectUse> UseWithParameter(const std::string& name, const Rig& rig) {
  for (const EffectUse& use : EveryUse(rig)) {
    for (const auto& p : PlacedParameters(use, rig, {})) {
      if (p.name == name) return use;
    }
  }
  return std::nullopt;
}

namespace {

// The peak torque that the experiment states of an actuator; nothing: none.
std::optional<double> StatedPeak(const Rig& rig, const std::string& actuator) {
  for (const Limit& limit : rig.experiment().limits) {
    if (limit.actuator == actuator && limit.torque > 0) return limit.torque;
  }
  return std::nullopt;
}

// The rig's own size at a place, once.
void AddScales(Structure& structure, const Effect& effect, const std::string& on, const ScaleTable& table) {
  const Scales scales = ScalesAt(effect, on, structure.rig(), table);
  const double peak = StatedPeak(structure.rig(), on).value_or(scales.torque_n_m);
  for (const auto& [size, value, unit] :
       {std::tuple{RigSize::kTorque, scales.torque_n_m, "N m"}, std::tuple{RigSize::kPeak, peak, "N m"},
        std::tuple{RigSize::kInertia, scales.inertia_kg_m2, "kg m^2"}}) {
    const std::string name = ScaleName(on, size);
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
}

}  // namespace

Status ApplyEffect(Structure& structure, const EffectUse& use, const ScaleTable& table) {
  const Effect& effect = EffectOf(use, structure.rig());
  std::vector<std::string> names;
  for (const auto& p : PlacedParameters(use, structure.rig(), table)) {
    names.push_back(p.name);
    const EffectParameter& entry = effect.parameters[names.size() - 1];
    const Parameter::With with = entry.with;
    structure.AddParameter({.name = p.name,
                            .unit = p.unit,
                            .doc = effect.meaning,
                            .nominal = p.neutral,
                            .low = p.low,
                            .high = p.high,
                            .frozen = false,
                            .with = with,
                            .size = with == Parameter::With::kNone ? "" : names.front(),
                            .owner = Parameter::Owner::kEffect,
                            .of_torque = entry.of_torque || IsOfTorque(p.scale)});
  }
  structure.entering = &use;
  for (const std::string& place : PlacesOf(use, structure.rig())) {
    AddScales(structure, effect, place, table);
    GS_RETURN_IF_ERROR(effect.apply(structure, place, names));
  }
  structure.entering = nullptr;
  return Ok();
}

}  // namespace gapscope
