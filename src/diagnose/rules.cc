#include "src/diagnose/rules.h"

#include <fmt/core.h>

#include <algorithm>
#include <map>

namespace gapscope {
namespace {

// The joint that an actuator, joint or signal belongs to.
std::string JointOf(const std::string& on, const Model& model) {
  const mjModel& m = model.compiled();
  if (const int actuator = mj_name2id(&m, mjOBJ_ACTUATOR, on.c_str()); actuator >= 0 && m.actuator_trntype[actuator] == mjTRN_JOINT) {
    const char* name = mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * actuator]);
    return name ? name : "";
  }
  for (const auto& measured : model.experiment().measured) {
    if (measured.signal == on) return measured.kind == SignalKind::kTorque ? JointOf(measured.on, model) : measured.on;
  }
  return on;
}

bool IsServoJoint(const std::string& joint, const Model& model) {
  const mjModel& m = model.compiled();
  for (int a = 0; a < m.nactuator; ++a) {
    const char* name = m.actuator_trntype[a] == mjTRN_JOINT ? mj_id2name(&m, mjOBJ_JOINT, m.actuator_trnid[2 * a]) : nullptr;
    if (name && joint == name && (m.actuator_biasprm[a * mjNBIAS + 1] != 0 || m.actuator_plugin[a] >= 0)) return true;
  }
  return false;
}

// richer -> simpler effects that it contains, on the same joint.
const std::multimap<std::string, std::string>& Containment() {
  static const std::multimap<std::string, std::string> table = {
      {"stribeck_friction", "coulomb_friction"}, {"direction_asymmetry", "coulomb_friction"}, {"supply_sag", "torque_limit"},
      {"cable_spring", "torque_bias"},           {"gravity_offset", "torque_bias"},           {"gravity_offset", "cable_spring"},
      {"cogging", "torque_bias"},                {"cogging", "gravity_offset"},               {"cogging", "cable_spring"},
      {"direction_asymmetry", "torque_bias"},
  };
  return table;
}

}  // namespace

bool IsFinding(const EffectUse& use, const Model& model) {
  if (use.effect == "torque_bias" && IsServoJoint(JointOf(use.on, model), model)) return false;
  // A column that is the only one measured of a system is late with everything else: tried all the same, the verdict then says ambiguous.
  return true;
}

bool ArePartners(const EffectUse& a, const EffectUse& b, const Model& model) {
  if (JointOf(a.on, model) != JointOf(b.on, model) && a.effect != "sensor_delay" && b.effect != "sensor_delay") return false;
  for (const auto& [x, y] : {std::pair{&a, &b}, std::pair{&b, &a}}) {
    for (const Effect& effect : Catalogue()) {
      if (effect.name == x->effect && std::find(effect.partners.begin(), effect.partners.end(), y->effect) != effect.partners.end()) return true;
    }
  }
  return false;
}

bool Contains(const Candidate& richer, const Candidate& simpler) {
  if (richer.effects.size() != simpler.effects.size() || richer.effects.empty()) return false;
  for (std::size_t i = 0; i + 1 < richer.effects.size(); ++i) {
    if (richer.effects[i] != simpler.effects[i]) return false;
  }
  const EffectUse &a = richer.effects.back(), &b = simpler.effects.back();
  if (JointOf(a.on, *richer.model) != JointOf(b.on, *richer.model)) return false;
  const auto range = Containment().equal_range(a.effect);
  return std::any_of(range.first, range.second, [&](const auto& entry) { return entry.second == b.effect; });
}

std::string Reason(const Candidate& candidate, const Candidate& base, const Candidate& chosen, const PairedGain& gain, const PairedGain& behind) {
  if (&candidate == &base) {
    return &chosen == &base ? "no effect explains the held-out logs better by more than chance" : fmt::format("leaves {:.1f} % of its held-out error to {}", -100 * CompareCandidates(chosen, base).relative, chosen.Name());
  }
  if (candidate.held_out_blocks.empty()) return "its fit cannot be simulated along the held-out logs";
  const std::string converged = candidate.converged ? "" : " (fit not converged)";
  if (std::find(chosen.effects.begin(), chosen.effects.end(), candidate.effects.front()) != chosen.effects.end()) {
    return fmt::format("accepted: removes {:.1f} % of the held-out cost, {:.1f} standard errors above zero{}", 100 * gain.relative, gain.z, converged);
  }
  if (gain.relative <= kFirstGain || gain.z <= kFirstZ) {
    return fmt::format("removes {:.2f} % of the held-out cost ({:.1f} standard errors): not more than chance{}", 100 * gain.relative, gain.z, converged);
  }
  return fmt::format("removes {:.1f} % of the held-out cost, but {} removes {:.1f} % of what it leaves ({:.1f} standard errors){}", 100 * gain.relative, chosen.Name(), 100 * behind.relative,
                     behind.z, converged);
}

std::string Explain(const Diagnosis& d, double floors_before) {
  std::string text = fmt::format("Held out, the nominal model misses by {:.3g} of the signals' standard deviation; retuning its parameters brings that to {:.3g} ({:.1f} times the sensors' noise). ",
                                 d.nominal, d.refit, floors_before);
  switch (d.verdict) {
    case Verdict::kNone: text += "The model explains the logs down to their noise: there is no gap to explain."; break;
    case Verdict::kParameters: text += "Retuned parameters close the gap; no further effect improves the prediction of logs that the fit did not see."; break;
    case Verdict::kEffects:
    case Verdict::kAmbiguous: {
      for (const auto& found : d.effects) {
        text += fmt::format("{} explains {:.0f} % of the gap that closes", found.use.Text(), 100 * found.share_of_gap);
        for (const auto& effect : Catalogue()) {
          if (effect.name == found.use.effect) {
            text += " (" + effect.meaning + "; signature: " + effect.signature + ")";
            break;
          }
        }
        text += ". ";
      }
      text += fmt::format("With it the held-out error is {:.3g}, {:.1f} times the noise.", d.final, d.floors_left);
      if (d.verdict == Verdict::kAmbiguous) {
        text += " But these logs cannot tell it from";
        for (std::size_t i = 1; i < d.ambiguous.front().size(); ++i) text += (i > 1 ? ", " : " ") + d.ambiguous.front()[i];
        text += ": what each leaves unexplained is the same.";
      }
      break;
    }
    case Verdict::kUnknown:
      text += fmt::format("No known effect explains what remains: the best leaves {:.1f} times the sensors' noise. ", d.floors_left);
      if (!d.where.empty()) text += "It lies mostly at: " + d.where.front().signal + ", " + d.where.front().condition + ".";
      break;
  }
  if (d.budget_spent) text += " The time budget ended the search early.";
  return text;
}

std::string NextExperiment(const EffectUse& a, const EffectUse& b, const Model& model, const ScaleTable& scales) {
  const auto scale = [&](const EffectUse& use) {
    for (const std::string& name : {use.on, JointOf(use.on, model)}) {
      if (const auto found = scales.find(name); found != scales.end()) return found->second;
    }
    return Scales{};
  };
  const Scales s = scale(a);
  const auto one_of = [](const EffectUse& use, std::initializer_list<const char*> names) { return std::any_of(names.begin(), names.end(), [&](const char* n) { return use.effect == n; }); };
  // What tells the first from the second, in the table of docs/effects.md: its own distinguishing experiment at the amplitude that was safe before.
  if (one_of(a, {"command_delay", "torque_delay", "actuator_lag", "sensor_delay", "joint_compliance"}) || one_of(b, {"command_delay", "torque_delay", "actuator_lag", "joint_compliance"})) {
    return fmt::format("gapscope design steps --amplitude {:.4g} --period-s 0.5 --duration-s 10", 0.8 * s.command);
  }
  if (one_of(a, {"torque_limit", "torque_speed_curve", "torque_constant_droop", "supply_sag"})) {
    return fmt::format("gapscope design steps --amplitude {:.4g} --levels 4 --period-s 1 --duration-s 10", s.command);
  }
  if (one_of(a, {"backlash", "spring_hardening"})) {
    return fmt::format("gapscope design multisine --amplitude {:.4g},{:.4g} --duration-s 20", 0.15 * s.command, 0.8 * s.command);
  }
  return fmt::format("gapscope design triangle --amplitude {:.4g} --period-s 5 --duration-s 20", 0.6 * s.command);
}

}  // namespace gapscope
