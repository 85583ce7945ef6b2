#include "tests/twin/arm/case.h"

#include <algorithm>
#include <cmath>

namespace gapscope::twin {
namespace {

constexpr double kWeakest = 0.8;  // of the lowest ratio that was drawn for: weaker cases are drawn again

// An attempt at a case: effects with severities, roughness beside them.
class Attempt {
 public:
  Attempt(const CaseRequest& request, Random* random, ArmCase* c) : request_(request), random_(random), c_(c) {}

  // False: draw again, with a text in `problem` when that is of no use.
  bool Draw(int effects, bool rough, std::string* problem) {
    if (!DrawChoices(effects, problem)) return false;
    c_->logs = DrawArmLogs(c_->base, random_);
    RequireTorques();
    motions_ = ArmMotions(c_->base, c_->logs);
    const ArmGapOptions options;
    if (effects > 0 || rough) {
      const auto records = CoarseArmRecords(c_->base, Given(), c_->sensors, options);
      const ArmRetuning about_base(records, c_->base, c_->sensors, {}, options);
      if (!DrawSeverities(about_base) || (rough && !DrawRoughness(about_base))) return false;
    }
    c_->truth = With();
    PutRoughness(&c_->truth);
    if (!TameArm(c_->truth, &c_->logs)) return false;
    if (rough) {
      Settle(&c_->truth);
      Settle(&c_->truth);
      if (!TameArm(c_->truth, &c_->logs)) return false;
    }
    if (effects > 0 || rough) Describe(rough);
    return std::all_of(c_->effects.begin(), c_->effects.end(), [&](const ArmEffect& e) {
      return e.gap.Finite() && (e.gap.refit >= kWeakest * kLowestRatio || request_.severity > 0);
    });
  }

 private:
  static constexpr std::size_t kNone = static_cast<std::size_t>(-1);

  // The logs that a diagnosis is given: score.py keeps the last from it.
  std::vector<ArmLog> Given() const { return {c_->logs.begin(), c_->logs.end() - (c_->logs.size() > 3 ? 1 : 0)}; }

  bool DrawChoices(int count, std::string* problem) {
    while (static_cast<int>(ranges_.size()) < count) {
      ArmRange range;
      const std::string& wanted = ranges_.empty() ? request_.effect : std::string();
      if (!DrawArmEffect(c_->base.rig, wanted, random_, &range)) {
        *problem = "effect '" + wanted + "' does not exist on rig " + ArmRigName(c_->base.rig);
        return false;
      }
      const auto clashes = [&](const ArmRange& r) { return ArmClash(r.choice, range.choice); };
      if (std::none_of(ranges_.begin(), ranges_.end(), clashes)) ranges_.push_back(range);
    }
    return true;
  }

  // With the angles alone logged, late sensors equal late commands.
  void RequireTorques() {
    const bool needed = std::any_of(ranges_.begin(), ranges_.end(), [](const ArmRange& r) {
      return r.choice.name == "sensor_delay" || r.choice.name == "command_delay";
    });
    for (ArmLog& log : c_->logs) log.torque_columns = log.torque_columns || needed;
  }

  bool CalmAll(const ArmPlant& plant) const {
    return std::all_of(c_->logs.begin(), c_->logs.end(), [&](const ArmLog& log) { return Calm(plant, log); });
  }

  Search Find(const ArmRetuning& about_base, const std::function<ArmPlant(double)>& plant_at, double target,
              const ArmRange& within) const {
    const auto gap_at = [&](double severity) -> std::optional<Gap> {
      const ArmPlant plant = plant_at(severity);
      if (!CalmAll(plant)) return std::nullopt;
      return about_base.Measure({{&plant, &c_->base}})[0].gap;
    };
    return SearchSeverity(gap_at, target, within.lowest, within.highest);
  }

  bool DrawSeverities(const ArmRetuning& about_base) {
    for (ArmRange& range : ranges_) {
      const auto plant_at = [&](double severity) {
        range.choice.severity = severity;
        ArmPlant plant = c_->base;
        AddArmEffect(range.choice, motions_, &plant, nullptr);
        return plant;
      };
      double severity = request_.severity;
      if (severity <= 0) {
        // An effect of one joint shows in one of the angles, all of which share a figure.
        const double target = random_->LogUniform(kLowestRatio, kHighestRatio / std::sqrt(c_->base.count()));
        const Search found = Find(about_base, plant_at, target, range);
        if (found.severity <= 0 || found.gap.refit < kWeakest * kLowestRatio) return false;
        severity = found.severity;
      }
      range.choice.severity = severity;
    }
    return true;
  }

  // Laws out over the plant's own motion.
  void Settle(ArmPlant* plant) const {
    const auto motions = ArmJointMotions(*plant, c_->logs);
    for (int j = 0; j < plant->count(); ++j) {
      if (plant->joints[j].rough.Any()) TakeOutLaws(motions[j], &plant->joints[j].rough);
    }
  }

  bool DrawRoughness(const ArmRetuning& about_base) {
    const auto motions = ArmJointMotions(c_->base, c_->logs);
    // All joints together as rough as the two of the other rigs.
    const double share = std::sqrt(2.0 / c_->base.count());
    c_->roughness.clear();
    for (int j = 0; j < c_->base.count(); ++j) {
      const Rough unit = DrawRough(motions[j], kUnitRough * motions_[j].torque_rms_n_m, random_);
      if (!unit.Any()) return false;
      const auto plant_at = [&](double severity) {
        ArmPlant plant = c_->base;
        plant.joints[j].rough = unit;
        plant.joints[j].rough.scale_n_m *= severity;
        return plant;
      };
      const double target = share * random_->LogUniform(kLowestRough, kHighestRough);
      const Search found = Find(about_base, plant_at, target, ArmRange{});
      if (found.severity <= 0 || found.gap.refit < kWeakest * share * kLowestRough) return false;
      if (found.gap.refit > 1.5 * share * kHighestRough) return false;
      Label::Roughness rough;
      rough.on = ArmLinks(c_->base.rig)[static_cast<std::size_t>(j)].joint;
      rough.rough = plant_at(found.severity).joints[j].rough;
      rough.alone = found.gap.refit;
      c_->roughness.push_back(rough);
    }
    return true;
  }

  // The base with the effects, one left out.
  ArmPlant With(std::size_t without = kNone) const {
    ArmPlant plant = c_->base;
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      if (i != without) AddArmEffect(ranges_[i].choice, motions_, &plant, nullptr);
    }
    return plant;
  }

  void PutRoughness(ArmPlant* plant) const {
    for (std::size_t j = 0; j < c_->roughness.size(); ++j) plant->joints[j].rough = c_->roughness[j].rough;
  }

  // Random torques on every joint, together as strong as the plant's own; they enter where there is a torque of no
  // waves.
  std::vector<ArmDirection> TorqueDirections() const {
    Random random(c_->seed, c_->index, "torques");
    std::vector<ArmDirection> list;
    for (std::size_t j = 0; j < c_->roughness.size(); ++j) {
      const double deviation = c_->roughness[j].rms_n_m * std::sqrt(2.0 / kTorques);
      for (int i = 0; i < kTorques; ++i) {
        const RoughTerm term = DrawTerm(static_cast<RoughKind>(i % 3), &random);
        const auto put = [term, j, deviation](ArmPlant* plant, double x) {
          Rough& rough = plant->joints[j].rough;
          rough.terms.push_back(term);
          rough.terms.back().amplitude = x * deviation / rough.scale_n_m;
        };
        list.push_back({put, 0.2, 1.0});
      }
    }
    return list;
  }

  void DescribeRoughness() {
    const auto motions = ArmJointMotions(c_->truth, c_->logs);
    for (std::size_t j = 0; j < c_->roughness.size(); ++j) {
      Label::Roughness& label = c_->roughness[j];
      label.rough = c_->truth.joints[j].rough;
      label.rms_n_m = label.rough.scale_n_m * RootMeanSquare(Along(label.rough, motions[j]));
      label.held = LargestHold(label.rough, motions[j]);
    }
  }

  // What the logs that a diagnosis is given show of everything; of roughness also the oracle of case_rough.cc. Linear
  // about the plant without its roughness: that is what a model can know.
  void Describe(bool rough) {
    if (rough) DescribeRoughness();
    ArmPlant smooth = With();
    std::vector<ArmPlant> without, alone(c_->roughness.size(), smooth);
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      without.push_back(With(i));
      for (int j = 0; j < c_->base.count(); ++j) without.back().joints[j].rough = c_->truth.joints[j].rough;
    }
    for (std::size_t j = 0; j < c_->roughness.size(); ++j) {
      alone[j].joints[j].rough = smooth.joints[j].rough = c_->truth.joints[j].rough;
      smooth.joints[j].rough.terms.clear();
      smooth.joints[j].rough.laws = {};
    }
    std::vector<ArmRetuning::Pair> pairs = {{nullptr, &c_->base}, {nullptr, &smooth}};
    for (const ArmPlant& plant : without) pairs.push_back({nullptr, &plant});
    for (const ArmPlant& plant : alone) pairs.push_back({&plant, &smooth});
    const ArmGapOptions options;
    const auto records = CoarseArmRecords(c_->truth, Given(), c_->sensors, options);
    const auto torques = rough && !ranges_.empty() ? TorqueDirections() : std::vector<ArmDirection>();
    const auto traces = ArmRetuning(records, smooth, c_->sensors, torques, options).Measure(pairs);
    c_->gap = traces[0].gap;
    c_->rough_refit = traces[1].gap.refit;
    c_->effects.clear();
    for (std::size_t i = 0; i < ranges_.size(); ++i) {
      const ArmTrace& trace = traces[2 + i];
      ArmEffect effect{ranges_[i].choice, {}, {}, trace.gap};
      ArmPlant scratch = c_->base;
      effect.parameters = AddArmEffect(effect.choice, motions_, &scratch, &effect.extra);
      effect.beside_torques = BesideTorques(trace.gap.refit, {trace.gap.refit, trace.beside});
      effect.clear = !rough || StandsClear(trace.gap.refit, effect.beside_torques, c_->rough_refit);
      c_->effects.push_back(effect);
    }
    for (std::size_t j = 0; j < c_->roughness.size(); ++j) {
      c_->roughness[j].refit = traces[2 + ranges_.size() + j].gap.refit;
    }
  }

  const CaseRequest& request_;
  Random* random_;
  ArmCase* c_;
  std::vector<ArmRange> ranges_;
  std::vector<Motion> motions_;
};

Kind DrawArmKind(Random* random) {
  const double u = random->Unit();
  return u < 0.3 ? Kind::kNone : u < 0.75 ? Kind::kSingle : Kind::kPair;
}

}  // namespace

bool MakeArmCase(const CaseRequest& request, ArmRig rig, ArmCase* made, std::string* problem) {
  Random random(request.seed, request.index, "case");
  Random base(request.seed, request.index, "base"), sensors(request.seed, request.index, "sensors");
  *made = ArmCase();
  made->seed = request.seed;
  made->index = request.index;
  const Kind drawn = DrawArmKind(&random);
  made->kind = request.kind == Kind::kAuto ? (request.effect.empty() ? drawn : Kind::kSingle) : request.kind;
  made->base = DrawArm(rig, &base);
  if (made->kind == Kind::kNone && random.Chance(0.3)) {
    made->base = NominalArm(rig);
    made->nominal_base = true;
  }
  made->sensors = DrawArmSensors(rig, &sensors);
  int effects = 0;
  switch (made->kind) {
    case Kind::kNone:
      break;
    case Kind::kSingle:
    case Kind::kPair:
    case Kind::kTriple:
      effects = made->kind == Kind::kSingle ? 1 : made->kind == Kind::kPair ? 2 : 3;
      break;
    case Kind::kRough:
      effects = DrawMix(request, &random).effects;  // no causes outside the list: there roughness alone
      break;
    default:
      *problem =
          std::string("no case of kind ") + KindName(made->kind) + " on an arm; none, single, pair, triple, rough";
      return false;
  }
  for (int attempt = 0; attempt < kTries; ++attempt) {
    made->effects.clear();
    made->roughness.clear();
    if (Attempt(request, &random, made).Draw(effects, made->kind == Kind::kRough, problem)) return true;
    if (!problem->empty()) return false;
  }
  *problem = "no effect or roughness could be made visible";
  return false;
}

std::vector<ArmRecord> MakeArmRecords(const ArmCase& c, bool noise, double step_s) {
  RecordOptions options;
  options.step_s = step_s;
  options.noise = noise;
  std::vector<ArmRecord> records;
  for (const ArmLog& log : c.logs) records.push_back(MakeArmRecord(c.truth, log, c.sensors, options));
  return records;
}

Label LabelOf(const ArmCase& c) {
  const ArmRig rig = c.base.rig;
  Label label{.rig = ArmRigName(rig),
              .kind = c.kind,
              .seed = c.seed,
              .index = c.index,
              .nominal_base = c.nominal_base,
              .gap = c.gap,
              .roughness = c.roughness,
              .rough_refit = c.rough_refit};
  for (const ArmEffect& e : c.effects) {
    label.effects.push_back({e.choice.name, ArmPlaceName(rig, e.choice), e.parameters, e.extra, e.choice.severity,
                             e.gap, e.clear, e.beside_torques});
  }
  const ArmPlant nominal = NominalArm(rig);
  for (const ArmParameter& p : ArmParameters(rig)) {
    label.base.push_back(
        {p.name, p.unit, c.truth.joints[p.joint].base.*p.field, nominal.joints[p.joint].base.*p.field});
  }
  for (std::size_t j = 0; j < c.sensors.angle.size(); ++j) {
    label.sensors.emplace_back(ArmLinks(rig)[j].Signal(), c.sensors.angle[j]);
  }
  for (const ArmLog& log : c.logs) {
    const Excitation& first = log.excitation.front();
    label.logs.push_back({ShapeName(first.shape), log.scale, false, false, log.rate_hz, log.duration_s});
  }
  return label;
}

}  // namespace gapscope::twin
