// Cases on plants that keep a smooth torque which no catalogue holds (rough.h), on every joint, beside the effects that
// a diagnosis should name; and what an oracle that knows both says of each effect.
#include <algorithm>
#include <cmath>

#include "tests/twin/case.h"

namespace gapscope::twin {
namespace {

constexpr double kBeside = 1.5, kLeastShare = 0.5;

// The laws are taken out over the plant's own motion, which the torque itself changes a little.
void Settle(const std::vector<LogSpec>& logs, Plant* plant) {
  const auto motions = JointMotions(*plant, logs);
  for (std::size_t j = 0; j < 2; ++j) {
    if (plant->rough[j].Any()) TakeOutLaws(motions[j], &plant->rough[j]);
  }
}

// A torque for one joint, so strong that on the base model alone it leaves what is drawn.
bool DrawOnJoint(std::size_t joint, const Motion& motion, const std::array<JointMotion, 2>& motions, Random* random,
                 Case* c, std::array<Rough, 2>* drawn) {
  const double torque = joint == 0 ? motion.torque_rms_n_m : motion.torque2_rms_n_m;
  const Rough unit = DrawRough(motions[joint], kUnitRough * torque, random);
  if (!unit.Any()) return false;
  const double target = random->LogUniform(kLowestRough, kHighestRough);
  const auto plant_at = [&](double severity) {
    Plant plant = c->base;
    plant.rough[joint] = unit;
    plant.rough[joint].scale_n_m *= severity;
    Settle(c->logs, &plant);
    return plant;
  };
  const Search found = FindSeverity(plant_at, c->base, c->logs, c->sensors, target, 0.01, 10);
  if (found.severity <= 0 || found.gap.refit < 0.8 * kLowestRough || found.gap.refit > 1.5 * kHighestRough)
    return false;
  (*drawn)[joint] = plant_at(found.severity).rough[joint];
  RoughLabel label;
  label.place = joint == 0 ? Place::kFirst : Place::kSecond;
  label.alone = found.gap.refit;
  c->roughness.push_back(label);
  return true;
}

bool DrawRoughness(const Motion& motion, Random* random, Case* c, std::array<Rough, 2>* drawn) {
  double begin = 0;
  for (LogSpec& log : c->logs) {
    log.session_s = begin;
    begin += log.excitation.duration_s + kPause_s;
  }
  c->roughness.clear();
  const auto motions = JointMotions(c->base, c->logs);
  for (std::size_t j = 0; j < static_cast<std::size_t>(SignalCount(c->rig)); ++j) {
    if (!DrawOnJoint(j, motion, motions, random, c, drawn)) return false;
  }
  return true;
}

GapOptions Coarse(const Plant& plant) {
  GapOptions options;
  options.step_s = plant.load.Split() ? 2.5e-4 : 5e-4;
  options.sample_s = 0.012;
  return options;
}

// Random torques on every joint, together as strong as the plant's own; they enter where there is a torque of no waves.
std::vector<Direction> TorqueDirections(const Case& c) {
  Random random(c.seed, c.index, "torques");
  std::vector<Direction> list;
  for (const RoughLabel& label : c.roughness) {
    const std::size_t j = label.place == Place::kSecond ? 1 : 0;
    const double deviation = label.rms_n_m * std::sqrt(2.0 / kTorques);
    for (int i = 0; i < kTorques; ++i) {
      const RoughTerm term = DrawTerm(static_cast<RoughKind>(i % 3), &random);
      const auto put = [term, j, deviation](Plant* plant, double x) {
        plant->rough[j].terms.push_back(term);
        plant->rough[j].terms.back().amplitude = x * deviation / plant->rough[j].scale_n_m;
      };
      list.push_back({put, 0.2, 1.0});
    }
  }
  return list;
}

void DescribeRoughness(Case* c) {
  const auto motions = JointMotions(c->truth, c->logs);
  for (RoughLabel& label : c->roughness) {
    const std::size_t j = label.place == Place::kSecond ? 1 : 0;
    label.rms_n_m = c->truth.rough[j].scale_n_m * RootMeanSquare(Along(c->truth.rough[j], motions[j]));
    label.held = LargestHold(c->truth.rough[j], motions[j]);
  }
}

// The oracle: whether an effect shows more than the roughness does, and not as roughness-like torques would. One pass
// over the logs that a diagnosis is given, about the plant without its roughness: that is what a model can know.
void JudgeClear(const Listed& drawn, const std::vector<Record>& given, const GapOptions& options, Case* c) {
  Plant smooth = drawn.On(c->base);
  std::vector<Plant> others(c->effects.size(), smooth);
  for (std::size_t i = 0; i < others.size(); ++i) others[i] = drawn.On(c->base, i);
  for (std::size_t j = 0; j < c->roughness.size(); ++j) {
    others.push_back(smooth);
    others.back().rough[j] = c->truth.rough[j];
    smooth.rough[j] = c->truth.rough[j];
    smooth.rough[j].terms.clear();
    smooth.rough[j].laws = {};
  }
  const auto torques = c->effects.empty() ? std::vector<Direction>() : TorqueDirections(*c);
  const auto traces = MeasureTraces(given, smooth, others, c->Floor(), BaseDirections(c->rig), torques, options);
  c->rough_refit = traces.back().refit;
  for (std::size_t j = 0; j < c->roughness.size(); ++j) c->roughness[j].refit = traces[c->effects.size() + j].refit;
  for (std::size_t i = 0; i < c->effects.size(); ++i) {
    EffectLabel& e = c->effects[i];
    e.beside_torques = BesideTorques(e.gap.refit, traces[i]);
    e.clear = StandsClear(e.gap.refit, e.beside_torques, c->rough_refit);
  }
}

// One attempt; false: draw again, with a text in `problem` when that is of no use.
bool DrawCase(const CaseRequest& request, const Mix& mix, Random* random, Case* c, std::string* problem) {
  Listed drawn;
  c->truth = c->base;
  if (mix.outside) {
    if (!DrawOutside(request, random, c, problem)) return false;
    drawn.motion = MotionOf(c->base, c->logs);
  } else if (mix.effects > 0) {
    if (!DrawListed(request, mix.effects, random, c, &drawn, problem) || !drawn.visible) return false;
    c->truth = drawn.On(c->base);
  } else {
    c->logs = DrawCampaign(c->base, false, random);
    drawn.motion = MotionOf(c->base, c->logs);
  }
  std::array<Rough, 2> rough;
  if (!DrawRoughness(drawn.motion, random, c, &rough)) return false;
  RequireColumns(drawn.choices, &c->logs);
  c->truth.rough = rough;
  if (!TameAll(c->truth, &c->logs, random)) return false;
  Settle(c->logs, &c->truth);
  Settle(c->logs, &c->truth);
  if (!TameAll(c->truth, &c->logs, random)) return false;

  const GapOptions options = Coarse(c->truth);
  const auto directions = BaseDirections(c->rig);
  const auto records = CoarseRecords(c->truth, c->logs, c->sensors, options);
  c->effects.clear();
  for (std::size_t i = 0; i < drawn.choices.size(); ++i) {
    EffectLabel label{drawn.choices[i], {}, {}, {}};
    Plant scratch = c->base;
    label.parameters = AddEffect(drawn.choices[i], drawn.motion, &scratch, &label.extra);
    Plant without = drawn.On(c->base, i);
    without.rough = c->truth.rough;
    label.gap = MeasureGap(records, without, c->Floor(), directions, true, options);
    if (!label.gap.Finite() || label.gap.refit < 0.8 * kLowestRatio) return false;
    c->effects.push_back(label);
  }
  c->gap = MeasureGap(records, c->base, c->Floor(), directions, true, options);
  DescribeRoughness(c);
  const auto given = static_cast<std::ptrdiff_t>(records.size() - (records.size() > 3 ? 1 : 0));  // score.py keeps it
  JudgeClear(drawn, {records.begin(), records.begin() + given}, options, c);
  return c->gap.Finite() && std::isfinite(c->rough_refit);
}

}  // namespace

Mix DrawMix(const CaseRequest& request, Random* random) {
  const double u = random->Unit();
  if (!request.effect.empty()) return {1, false};
  return u < 0.20 ? Mix{0, false} : u < 0.30 ? Mix{0, true} : u < 0.65 ? Mix{1} : u < 0.90 ? Mix{2} : Mix{3};
}

double BesideTorques(double refit, const Trace& trace) {
  return trace.refit > 0 ? refit * std::min(1.0, trace.beside / trace.refit) : 0;
}

bool StandsClear(double refit, double beside_torques, double rough_refit) {
  return refit >= std::max(kLowestRatio, rough_refit) &&
         beside_torques >= std::max(kBeside, std::min(kLeastShare * refit, rough_refit));
}

bool MakeRough(const CaseRequest& request, Random* random, Case* c, std::string* problem) {
  const Mix mix = DrawMix(request, random);
  for (int attempt = 0; attempt < kTries; ++attempt) {
    if (DrawCase(request, mix, random, c, problem)) return true;
    if (!problem->empty()) return false;
  }
  *problem = "no roughness could be made visible, or no effect beside it";
  return false;
}

}  // namespace gapscope::twin
