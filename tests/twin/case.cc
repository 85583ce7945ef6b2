#include "tests/twin/case.h"

#include <algorithm>
#include <cmath>

namespace gapscope::twin {
namespace {

constexpr std::pair<Kind, const char*> kKinds[] = {
    {Kind::kAuto, "auto"},     {Kind::kNone, "none"},       {Kind::kSingle, "single"},       {Kind::kPair, "pair"},
    {Kind::kTriple, "triple"}, {Kind::kUnknown, "unknown"}, {Kind::kAmbiguous, "ambiguous"}, {Kind::kRough, "rough"}};

Kind DrawKind(Random* random) {
  const double u = random->Unit();
  return u < 0.25   ? Kind::kNone
         : u < 0.65 ? Kind::kSingle
         : u < 0.80 ? Kind::kPair
         : u < 0.90 ? Kind::kUnknown
                    : Kind::kAmbiguous;
}

// "name" or "name@place" among the rig's effects.
bool FindEffect(Rig rig, const std::string& wanted, Random* random, EffectRange* found) {
  const std::size_t at = wanted.find('@');
  const std::string name = wanted.substr(0, at), on = at == std::string::npos ? "" : wanted.substr(at + 1);
  std::vector<EffectRange> fitting;
  for (const EffectRange& range : EffectsOf(rig)) {
    if ((name.empty() || range.choice.name == name) && (on.empty() || PlaceName(rig, range.choice.place) == on)) {
      fitting.push_back(range);
    }
  }
  if (fitting.empty()) return false;
  // By name first, then by place: an effect on two places is not twice as frequent.
  const std::string drawn =
      fitting[static_cast<std::size_t>(random->Integer(0, static_cast<int>(fitting.size()) - 1))].choice.name;
  std::erase_if(fitting, [&](const EffectRange& r) { return r.choice.name != drawn; });
  *found = fitting[static_cast<std::size_t>(random->Integer(0, static_cast<int>(fitting.size()) - 1))];
  found->choice.shape_seed = static_cast<std::uint64_t>(random->Unit() * 0x1.0p53);
  return true;
}

// Effects that push an integrating rig away from its start.
bool Drifts(const EffectChoice& c) {
  return c.name == "torque_bias" || c.name == "direction_asymmetry" || c.name == "cogging" ||
         c.name == "gravity_offset";
}

// Draws effects and their severities until all show.
bool MakeListed(const CaseRequest& request, int count, Random* random, Case* c, std::string* problem) {
  for (int attempt = 0; attempt < kTries; ++attempt) {
    Listed drawn;
    if (!DrawListed(request, count, random, c, &drawn, problem)) return false;
    if (!drawn.visible && !(count == 1 && !request.effect.empty() && attempt + 1 == kTries)) continue;
    RequireColumns(drawn.choices, &c->logs);
    c->truth = drawn.On(c->base);
    if (!TameAll(c->truth, &c->logs, random)) continue;
    const GapOptions options;
    const auto records = CoarseRecords(c->truth, c->logs, c->sensors, options);
    const auto directions = BaseDirections(c->rig);
    c->gap = MeasureGap(records, c->base, c->Floor(), directions, true, options);
    c->effects.clear();
    bool shown = true;
    for (std::size_t i = 0; i < drawn.choices.size(); ++i) {
      EffectLabel label{drawn.choices[i], {}, {}, c->gap};
      Plant scratch = c->base;
      label.parameters = AddEffect(drawn.choices[i], drawn.motion, &scratch, &label.extra);
      if (drawn.choices.size() > 1) {
        label.gap = MeasureGap(records, drawn.On(c->base, i), c->Floor(), directions, true, options);
      }
      shown = shown && label.gap.Finite() && label.gap.refit >= 0.8 * kLowestRatio;
      c->effects.push_back(label);
    }
    if (shown || request.severity > 0 || attempt + 1 == kTries) return true;
  }
  *problem = "no effect could be made visible";
  return false;
}

bool MakeUnknown(const CaseRequest& request, Random* random, Case* c, std::string* problem) {
  for (int attempt = 0; attempt < kTries; ++attempt) {
    c->truth = c->base;
    if (!DrawOutside(request, random, c, problem)) {
      if (!problem->empty()) return false;
      if (attempt + 1 < kTries) continue;
    }
    if (!TameAll(c->truth, &c->logs, random)) continue;
    const GapOptions options;
    c->gap = MeasureGap(CoarseRecords(c->truth, c->logs, c->sensors, options), c->base, c->Floor(),
                        BaseDirections(c->rig), true, options);
    return true;
  }
  *problem = "no effect outside the list could be made visible";
  return false;
}

}  // namespace

const char* KindName(Kind kind) {
  for (const auto& [value, name] : kKinds) {
    if (value == kind) return name;
  }
  return "";
}

void RequireColumns(const std::vector<EffectChoice>& choices, std::vector<LogSpec>* logs) {
  const bool needed = std::any_of(choices.begin(), choices.end(), [](const EffectChoice& c) {
    return c.name == "sensor_delay" || c.name == "command_delay";
  });
  for (LogSpec& log : *logs) {
    log.torque_column = log.torque_column || needed;
    log.speed_column = log.speed_column || needed;
  }
}

bool TameAll(const Plant& plant, std::vector<LogSpec>* logs, Random* random) {
  return std::all_of(logs->begin(), logs->end(), [&](LogSpec& log) { return Tame(plant, &log, random); });
}

Plant Listed::On(const Plant& base, std::size_t without) const {
  Plant plant = base;
  for (std::size_t i = 0; i < choices.size(); ++i) {
    if (i != without) AddEffect(choices[i], motion, &plant, nullptr);
  }
  return plant;
}

bool DrawListed(const CaseRequest& request, int count, Random* random, Case* c, Listed* drawn, std::string* problem) {
  std::vector<EffectRange> ranges;
  while (static_cast<int>(ranges.size()) < count) {
    EffectRange range;
    const std::string& wanted = ranges.empty() ? request.effect : std::string();
    if (!FindEffect(c->rig, wanted, random, &range)) {
      *problem = "effect '" + wanted + "' does not exist on rig " + RigName(c->rig);
      return false;
    }
    const auto clashes = [&](const EffectRange& r) { return Clash(c->rig, r.choice, range.choice); };
    if (std::none_of(ranges.begin(), ranges.end(), clashes)) ranges.push_back(range);
  }
  const bool loop = std::any_of(ranges.begin(), ranges.end(), [](const EffectRange& r) { return Drifts(r.choice); });
  c->logs = DrawCampaign(c->base, loop && c->rig != Rig::kJoint, random);
  drawn->motion = MotionOf(c->base, c->logs);
  drawn->visible = true;
  for (EffectRange& range : ranges) {
    EffectChoice choice = range.choice;
    const auto plant_at = [&](double severity) {
      choice.severity = severity;
      Plant plant = c->base;
      AddEffect(choice, drawn->motion, &plant, nullptr);
      return plant;
    };
    if (request.severity > 0) {
      choice.severity = request.severity;
    } else {
      const double target = random->LogUniform(kLowestRatio, kHighestRatio);
      const Search found = FindSeverity(plant_at, c->base, c->logs, c->sensors, target, range.lowest, range.highest);
      choice.severity = found.severity;
      drawn->visible = drawn->visible && found.severity > 0 && found.gap.refit >= kLowestRatio * 0.8;
    }
    drawn->choices.push_back(choice);
  }
  return true;
}

bool ParseKind(std::string_view name, Kind* kind) {
  for (const auto& [value, text] : kKinds) {
    if (name == text) {
      *kind = value;
      return true;
    }
  }
  return false;
}

std::vector<Record> CoarseRecords(const Plant& plant, const std::vector<LogSpec>& logs, const Sensors& sensors,
                                  const GapOptions& options) {
  RecordOptions record;
  record.step_s = options.step_s;
  record.snapshot_every_s = options.window_s;
  std::vector<Record> records;
  for (const LogSpec& log : logs) records.push_back(MakeRecord(plant, log, sensors, record));
  return records;
}

std::vector<Record> MakeRecords(const Case& c, bool noise, double step_s) {
  RecordOptions options;
  options.step_s = step_s;
  options.noise = noise;
  std::vector<Record> records;
  for (const LogSpec& log : c.logs) records.push_back(MakeRecord(c.truth, log, c.sensors, options));
  return records;
}

Search FindSeverity(const std::function<Plant(double)>& plant_at, const Plant& reference,
                    const std::vector<LogSpec>& logs, const Sensors& sensors, double target, double lowest,
                    double highest) {
  const GapOptions options;
  const std::array<double, 2> floor = {sensors.angle[0].Floor(), sensors.angle[1].Floor()};
  const auto directions = BaseDirections(reference.rig);
  const Envelope tolerable = Tolerable(reference.rig);
  const auto gap_at = [&](double severity) -> std::optional<Gap> {
    const Plant plant = plant_at(severity);
    const bool calm =
        std::all_of(logs.begin(), logs.end(), [&](const LogSpec& l) { return PeaksOf(plant, l).Within(tolerable); });
    if (!calm) return std::nullopt;
    return MeasureGap(CoarseRecords(plant, logs, sensors, options), reference, floor, directions, true, options);
  };
  return SearchSeverity(gap_at, target, lowest, highest);
}

Search SearchSeverity(const std::function<std::optional<Gap>(double)>& gap_at, double target, double lowest,
                      double highest) {
  Search best;
  double closest = kNever;
  double low = std::log(lowest), high = std::log(highest);
  double at = std::log(std::min(1.0, highest));
  double low_ratio = 0, high_ratio = 0;  // logarithms, once known
  bool low_known = false, high_known = false;
  for (int i = 0; i < 8; ++i) {
    const std::optional<Gap> measured = gap_at(std::exp(at));
    const Gap gap = measured.value_or(Gap());
    const double distance = measured && gap.Finite() ? std::abs(std::log(std::max(gap.refit, 1e-9) / target)) : kNever;
    if (distance < closest) {
      closest = distance;
      best = {std::exp(at), gap, distance < std::log(1.25)};
    }
    if (best.reached) return best;
    const bool too_much = distance == kNever || gap.refit > target;
    const double ratio = distance == kNever ? std::log(10 * target) : std::log(std::max(gap.refit, 1e-9));
    if (too_much) {
      high = at;
      high_ratio = ratio;
      high_known = true;
    } else {
      low = at;
      low_ratio = ratio;
      low_known = true;
    }
    if (high - low < 0.02) return best;
    // The ratio grows about as a power of the severity.
    if (low_known && high_known && high_ratio > low_ratio + 0.1) {
      const double part = (std::log(target) - low_ratio) / (high_ratio - low_ratio);
      at = low + std::clamp(part, 0.15, 0.85) * (high - low);
    } else {
      at = std::clamp(at + (std::log(target) - ratio), low, high);
      if (std::abs(at - (too_much ? high : low)) < 0.05) at = (low + high) / 2;
    }
  }
  return best;
}

bool MakeCase(const CaseRequest& request, Case* made, std::string* problem) {
  Random random(request.seed, request.index, "case");
  *made = Case();
  made->seed = request.seed;
  made->index = request.index;
  const Kind drawn = DrawKind(&random);
  made->kind = request.kind == Kind::kAuto ? (request.effect.empty() ? drawn : Kind::kSingle) : request.kind;
  made->rig = kRigs[static_cast<std::size_t>(random.Integer(0, 3))];
  if (!request.rig.empty() && !ParseRig(request.rig, &made->rig)) {
    *problem = "no rig is called '" + request.rig + "'; joint, qube, flexjoint or flexlink";
    return false;
  }
  Random base(request.seed, request.index, "base"), sensors(request.seed, request.index, "sensors");
  made->base.rig = made->rig;
  made->base.base = DrawBase(made->rig, &base);
  // Some plants are as the data sheet says: there nothing at all is to be found.
  if (made->kind == Kind::kNone && random.Chance(0.3)) {
    made->base.base = NominalBase(made->rig);
    made->nominal_base = true;
  }
  made->sensors = DrawSensors(made->rig, &sensors);
  made->truth = made->base;
  switch (made->kind) {
    case Kind::kSingle:
      return MakeListed(request, 1, &random, made, problem);
    case Kind::kPair:
      return MakeListed(request, 2, &random, made, problem);
    case Kind::kTriple:
      return MakeListed(request, 3, &random, made, problem);
    case Kind::kRough:
      return MakeRough(request, &random, made, problem);
    case Kind::kUnknown:
      return MakeUnknown(request, &random, made, problem);
    case Kind::kAmbiguous:
      return MakeAmbiguous(&random, made, problem);
    default:
      break;
  }
  made->logs = DrawCampaign(made->base, false, &random);
  TameAll(made->truth, &made->logs, &random);
  return true;
}

}  // namespace gapscope::twin
