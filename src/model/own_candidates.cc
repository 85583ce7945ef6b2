#include "src/model/own_candidates.h"

#include <algorithm>
#include <cmath>
#include <numbers>

#include "src/core/apart.h"
#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/experiment/expression.h"
#include "src/experiment/formula_units.h"
#include "src/model/fields.h"
#include "src/model/own_probe.h"
#include "src/model/rig.h"
#include "src/model/structure.h"
#include "src/plugins/common/parser.h"

namespace gapscope {
namespace {

using Values = OwnProbe::Values;

bool IsSame(const Values& a, const Values& b) {
  constexpr double kRounding = 1e-9;
  double size = 0, apart = 0;
  for (std::size_t i = 0; i < a.size(); ++i) {
    if (!std::isfinite(a[i]) || !std::isfinite(b[i])) return false;
    size = std::max({size, std::abs(a[i]), std::abs(b[i])});
    apart = std::max(apart, std::abs(a[i] - b[i]));
  }
  return apart <= kRounding * size;
}

// a + factor * b.
Values Sum(const Values& a, double factor, const Values& b) {
  Values sum = a;
  for (std::size_t i = 0; i < sum.size(); ++i) sum[i] += factor * b[i];
  return sum;
}

bool IsLinear(OwnProbe& probe, std::size_t i, double value) {
  const Values none = probe.Beside(i, 0), once = probe.Beside(i, value), twice = probe.Beside(i, 2 * value);
  return IsSame(Sum(twice, -1, none), Sum(Sum(once, -1, none), 1, Sum(once, -1, none)));
}

// How the torque's parameter acts with its first one, the only size: an angle, a rest, or otherwise.
Parameter::With ActsWith(OwnProbe& probe, std::size_t i, const OwnParameter& p) {
  const Values at_zero = probe.Beside(i, 0), at_one = probe.Beside(i, 1),
               at_quarter = probe.Beside(i, std::numbers::pi / 2);
  bool angle = p.low <= -std::numbers::pi && p.high >= std::numbers::pi;
  bool rest = !p.trials.empty() && *std::max_element(p.trials.begin(), p.trials.end()) > 0;
  for (const double value : {0.7, 2.1, -1.3}) {
    const Values at = probe.Beside(i, value), none(at.size(), 0);
    angle = angle && IsSame(at, Sum(Sum(none, std::cos(value), at_zero), std::sin(value), at_quarter));
    rest = rest && IsSame(at, Sum(at_zero, value, Sum(at_one, -1, at_zero)));
  }
  return angle ? Parameter::With::kAngle : rest ? Parameter::With::kRest : Parameter::With::kNone;
}

// The sizes first, those that act linearly before the others: results show the first one.
std::vector<EffectParameter> ParametersOf(const OwnEffect& own, OwnProbe& probe) {
  const Values neutral = probe.AtNeutral();
  std::vector<std::pair<int, EffectParameter>> ranked;
  for (std::size_t i = 0; i < own.parameters.size(); ++i) {
    const OwnParameter& p = own.parameters[i];
    const auto role = p.role.value_or(IsSame(probe.Alone(i), neutral) ? ParameterRole::kPlace : ParameterRole::kSize);
    const bool size = role == ParameterRole::kSize,
               linear = size && p.neutral == 0 && IsLinear(probe, i, OwnProbe::Moved(p));
    const int rank = linear ? 0 : size ? 1 : 2;
    ranked.push_back({rank,
                      {.key = p.key,
                       .unit = p.unit,
                       .role = role,
                       .neutral = p.neutral,
                       .low = p.low,
                       .high = p.high,
                       .trials = p.trials,
                       .start = p.start,
                       .of_torque = linear && !own.joint.empty()}});
  }
  std::stable_sort(ranked.begin(), ranked.end(), [](const auto& a, const auto& b) { return a.first < b.first; });
  return Collect(ranked, [](const auto& entry) { return entry.second; });
}

// Which parameters the catalogue would call an angle or a rest of the first one.
void Couple(const OwnEffect& own, OwnProbe& probe, std::vector<EffectParameter>* parameters) {
  const auto index = [&](const std::string& key) {
    const auto found =
        std::find_if(own.parameters.begin(), own.parameters.end(), [&](const OwnParameter& p) { return p.key == key; });
    return static_cast<std::size_t>(found - own.parameters.begin());
  };
  const EffectParameter& size = parameters->front();
  const Values without = probe.Beside(index(size.key), 0);
  if (!size.of_torque || !IsSame(without, Values(without.size(), 0))) return;
  for (EffectParameter& p : *parameters) {
    if (p.role == ParameterRole::kPlace) p.with = ActsWith(probe, index(p.key), own.parameters[index(p.key)]);
  }
}

Status CheckJoint(const OwnEffect& own, const Rig& rig) {
  const std::vector<std::string> joints = rig.Joints();
  if (std::find(joints.begin(), joints.end(), own.joint) == joints.end())
    return NoSuch("a candidate acts on a joint that the MJCF lacks", own.joint, joints, own.where);
  if (Mentions(own.torque, plugins::kFormulaInputs[plugins::kCommand]) && rig.ActuatorOf(own.joint).empty()) {
    return Error{.what = "the joint '" + own.joint + "' has no drive whose command a torque could follow",
                 .where = own.torque_where,
                 .allowed = "angle, speed, time and parameters"};
  }
  return Ok();
}

// Of the torque's formula. The command is in the unit of its column.
Status CheckUnits(const OwnEffect& own, const Rig& rig) {
  const mjModel& m = rig.compiled();
  const bool slides = m.jnt_type[mj_name2id(&m, mjOBJ_JOINT, own.joint.c_str())] == mjJNT_SLIDE;
  std::map<std::string, std::string> units;
  for (const OwnParameter& p : own.parameters) units[p.key] = p.unit;
  units[plugins::kFormulaInputs[plugins::kAngle]] = slides ? "m" : "rad";
  units[plugins::kFormulaInputs[plugins::kSpeed]] = slides ? "m/s" : "rad/s";
  units[plugins::kFormulaInputs[plugins::kTime]] = "s";
  for (const CommandSpec& command : rig.experiment().commands) {
    if (command.actuator == rig.ActuatorOf(own.joint)) units[plugins::kFormulaInputs[plugins::kCommand]] = command.unit;
  }
  return CheckFormulaUnits(own.torque, units, slides ? "N" : "N m", own.torque_where);
}

Status CheckTorque(const OwnEffect& own, OwnProbe& probe) {
  for (const double torque : probe.AtNeutral()) {
    if (torque == 0) continue;
    return Error{.what = "the torque of '" + own.name + "' is not zero at the neutral values of its parameters",
                 .where = own.torque_where,
                 .actual = std::to_string(torque),
                 .allowed = "0, whatever the motion",
                 .cure = "give a parameter the 'neutral' value at which the effect does nothing"};
  }
  return Ok();
}

// What the base model says of a field at its nominal parameters; empty: a log decides.
Result<Values> BaseValues(const FieldSetting& own, const Rig& rig) {
  const Experiment& experiment = rig.experiment();
  GS_ASSIGN(const Field field, ResolveField(rig.compiled(), own.field, own.where));
  const auto set = std::find_if(experiment.settings.begin(), experiment.settings.end(),
                                [&](const FieldSetting& s) { return s.field == own.field; });
  if (set == experiment.settings.end()) {
    return Collect(field.components, [&](const auto& c) { return ReadComponent(rig.compiled(), c); });
  }
  std::map<std::string, double> nominal;
  for (const Parameter& p : experiment.parameters) nominal[p.name] = p.nominal;
  Values values;
  for (const std::string& text : set->expressions) {
    for (const LogValue& value : experiment.values) {
      if (Mentions(text, value.name)) return Values{};
    }
    GS_ASSIGN(const double value, EvaluateOnce(text, nominal, set->where));
    values.push_back(value);
  }
  return values;
}

Status CheckFields(const OwnEffect& own, OwnProbe& probe, const Rig& rig) {
  const Values neutral = probe.AtNeutral();
  auto at = neutral.begin();
  for (const FieldSetting& setting : own.settings) {
    GS_ASSIGN(const Field field, ResolveField(rig.compiled(), setting.field, setting.where));
    GS_RETURN_IF_ERROR(CheckCount(field, setting));
    GS_ASSIGN(const Values base, BaseValues(setting, rig));
    for (std::size_t i = 0; i < setting.expressions.size(); ++i, ++at) {
      constexpr double kPrinted = 1e-4;  // of an MJCF with rounded numbers
      if (base.empty() || std::abs(*at - base[i]) <= kPrinted * std::abs(base[i])) continue;
      return Error{
          .what = "the field '" + setting.field + "' is another one at the neutral values of '" + own.name + "'",
          .where = setting.where,
          .actual = std::to_string(*at),
          .allowed = std::to_string(base[i]) + ", as the model has it",
          .cure = "give a parameter the 'neutral' value at which the effect does nothing"};
    }
  }
  return Ok();
}

Status CheckTrials(const OwnEffect& own, const Effect& effect) {
  const bool tried = std::any_of(effect.parameters.begin(), effect.parameters.end(), [](const EffectParameter& p) {
    return p.role != ParameterRole::kPlace &&
           std::any_of(p.trials.begin(), p.trials.end(), [&](double trial) { return trial != p.neutral; });
  });
  if (tried) return Ok();
  return Error{.what = "the candidate '" + own.name + "' has no values to be tried at",
               .where = own.where,
               .allowed = "'trials' of a parameter that does something alone, other than its neutral value",
               .cure = "add 'trials: [VALUE, ...]'; where no parameter does anything alone, say 'role: size' of one"};
}

Status Apply(const OwnEffect& own, Structure& structure, const std::map<std::string, std::string>& names) {
  if (!own.joint.empty()) {
    structure.AddOwnTorque(TorqueOf(own, names));
    return Ok();
  }
  for (const FieldSetting& setting : own.settings) {
    GS_RETURN_IF_ERROR(structure.Replace(
        setting.field, Collect(setting.expressions, [&](const auto& text) { return WithNames(text, names); })));
  }
  return Ok();
}

Status CheckEnters(const OwnEffect& own, OwnProbe& probe) {
  for (std::size_t i = 0; i < own.parameters.size(); ++i) {
    const OwnParameter& p = own.parameters[i];
    if (p.role || probe.Beside(i, OwnProbe::Moved(p)) != probe.Beside(i, p.neutral)) continue;
    return Error{.what = "the parameter '" + p.key + "' does nothing in the plugin '" + own.plugin + "'",
                 .where = p.where,
                 .allowed = "numerics that it reads on each compute: " + OwnInstance(own.joint, own.name) + "." + p.key,
                 .cure = "delete it; where it acts only over time, say its 'role'"};
  }
  return Ok();
}

Result<std::unique_ptr<OwnProbe>> MakeProbe(const OwnEffect& own, const Rig& rig) {
  if (!own.plugin.empty()) return MakePluginProbe(own, rig);
  return MakeFormulaProbe(own, rig.experiment());
}

std::string SignatureOf(const OwnEffect& own) {
  if (!own.plugin.empty()) return "torque of the plugin " + own.plugin;
  if (!own.torque.empty()) return "torque " + own.torque;
  return own.settings.front().field + " = " + Join(own.settings.front().expressions);
}

Result<Effect> MakeEffect(const OwnEffect& own, const Rig& rig) {
  const bool torque = !own.joint.empty();
  GS_ASSIGN(const std::unique_ptr<OwnProbe> made, MakeProbe(own, rig));
  OwnProbe& probe = *made;
  if (torque) {
    GS_RETURN_IF_ERROR(CheckTorque(own, probe));
  } else {
    GS_RETURN_IF_ERROR(CheckFields(own, probe, rig));
  }
  if (!own.plugin.empty()) GS_RETURN_IF_ERROR(CheckEnters(own, probe));
  Effect effect{.name = own.name,
                .place = EffectPlace::kNamed,
                .parameters = ParametersOf(own, probe),
                .meaning = own.meaning.empty() ? "a candidate of the experiment file" : own.meaning,
                .signature = SignatureOf(own),
                .of_motion = probe.IsOfMotion(),
                .on = torque ? own.joint : ElementOfField(own.settings.front().field)};
  Couple(own, probe, &effect.parameters);
  GS_RETURN_IF_ERROR(CheckTrials(own, effect));
  effect.apply = [own, keys = Collect(effect.parameters, &EffectParameter::key)](
                     Structure& structure, const std::string&, const std::vector<std::string>& names) {
    std::map<std::string, std::string> by_key;
    for (std::size_t i = 0; i < keys.size(); ++i) by_key[keys[i]] = names[i];
    return Apply(own, structure, by_key);
  };
  return effect;
}

// Empty: the plugin runs. Else why it cannot be asked about: it is not there, refuses the model, or crashes.
std::string FaultOfPlugin(const OwnEffect& own, const Rig& rig) {
  return TryApart([&]() -> std::string {
    const auto probe = MakePluginProbe(own, rig);
    if (!probe.ok()) return probe.error().what;
    for (std::size_t i = 0; i < own.parameters.size(); ++i) {
      const OwnParameter& p = own.parameters[i];
      Values values = p.trials;
      values.insert(values.end(), {p.low, p.high});
      for (const double value : values) probe.value()->Beside(i, value);
    }
    return "";
  });
}

}  // namespace

Result<CandidateEffects> OwnCandidates(const Rig& rig) {
  CandidateEffects own_effects;
  const std::vector<std::string> known = EffectNames();
  for (const OwnEffect& own : rig.experiment().candidates) {
    if (std::find(known.begin(), known.end(), own.name) != known.end()) {
      return Error{.what = "the catalogue has an effect of the candidate's name",
                   .where = own.where,
                   .actual = "'" + own.name + "'",
                   .cure = "rename the candidate"};
    }
    if (!own.joint.empty()) GS_RETURN_IF_ERROR(CheckJoint(own, rig));
    if (!own.torque.empty()) GS_RETURN_IF_ERROR(CheckUnits(own, rig));
    if (!own.plugin.empty()) {
      if (const std::string fault = own.fault.empty() ? FaultOfPlugin(own, rig) : own.fault; !fault.empty()) {
        own_effects.left_out.push_back({own.name, fault});
        continue;
      }
    }
    GS_ASSIGN(Effect effect, MakeEffect(own, rig));
    own_effects.effects.push_back(std::move(effect));
  }
  return own_effects;
}

}  // namespace gapscope
