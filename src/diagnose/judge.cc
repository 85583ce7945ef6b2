#include "src/diagnose/judge.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <tuple>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/discrepancy.h"
#include "src/diagnose/policy.h"
#include "src/fit/policy.h"

namespace gapscope {
namespace {

double Log(double before, double after) {
  const double most = kDiagnosePolicy.evidence.most_gain;
  if (std::isinf(after)) return std::isinf(before) ? kNaN : -most;
  return std::isinf(before) ? most : std::log(before / std::max(after, 1e-300));
}

// Errors of free runs as a gain; both beyond their signal: the motion was lost either way.
double FreeGain(double before, double after) {
  constexpr double kLost = 1;
  return std::min(before, after) > kLost ? kNaN : 2 * Log(before, after);
}

// What the held-out logs gain, over its standard error: half seconds are independent.
double ClearBy(const Workbench& bench, const Candidate& without, const Candidate& with) {
  std::map<std::pair<std::size_t, long>, double> gains;
  for (std::size_t l = 0; l < std::min(without.held_out.size(), with.held_out.size()); ++l) {
    const LogReplay &a = without.held_out[l], &b = with.held_out[l];
    for (std::size_t s = 0; s < std::min(a.signals.size(), b.signals.size()); ++s) {
      const double weight = bench.weights[bench.data.held_out[l].measured[s].index];
      for (std::size_t r = 0; r < a.time_s.size(); ++r) {
        const double before = weight * (a.signals[s].predicted[r] - a.signals[s].measured[r]),
                     after = weight * (b.signals[s].predicted[r] - b.signals[s].measured[r]);
        if (std::isfinite(before) && std::isfinite(after))
          gains[{l, std::lround(std::floor(a.time_s[r] / kFitPolicy.block_s))}] += before * before - after * after;
      }
    }
  }
  const auto values = Collect(gains, [](const auto& entry) { return entry.second; });
  const Moments moments = MomentsOf(values);
  return moments.deviation > 0 ? std::sqrt(static_cast<double>(values.size())) * moments.mean / moments.deviation : 0;
}

class Judging {
 public:
  Judging(const Workbench& bench, SearchResult& found, const Say& say)
      : bench_(bench),
        found_(found),
        say_(say),
        torques_(MakeTorques(bench)),
        free_left_(FreeRunError(bench, *found.chosen)) {
    ScoreCandidate(bench_, found_.chosen);
  }

  // Of members taken out as a whole.
  StatementNumbers Numbers(const std::vector<EffectUse>& uses) {
    say_("judging " + NameOfSet(uses));
    EffectSet rest = found_.chosen->effects;
    for (const EffectUse& use : uses) rest = Without(rest, use);
    Candidate* without = found_.ledger.Find(rest);
    if (!without || uses.size() > 1) without = found_.ledger.Refit(rest, *found_.chosen, {}, {}, Effort::kTry);
    if (!without) without = found_.base;
    ScoreCandidate(bench_, without);
    StatementNumbers numbers;
    numbers.gain = Log(without->TrainAboveNoise(), found_.chosen->TrainAboveNoise());
    numbers.gain_held_out = Log(without->HeldOutAboveNoise(), found_.chosen->HeldOutAboveNoise());
    numbers.gain_free = FreeGain(FreeRunError(bench_, *without), free_left_);
    numbers.clear = ClearBy(bench_, *without, *found_.chosen);
    const auto all_are = [&](EffectCharacter character) {
      return std::all_of(uses.begin(), uses.end(),
                         [&](const EffectUse& use) { return EffectOf(use, *bench_.rig).character == character; });
    };
    numbers.dry = all_are(EffectCharacter::kDryFriction);
    numbers.second_mass = all_are(EffectCharacter::kSecondMass);
    numbers.smooth = std::all_of(uses.begin(), uses.end(),
                                 [&](const EffectUse& use) { return EffectOf(use, *bench_.rig).of_motion; });
    if (torques_.empty()) return numbers;
    const ColumnTable table = MakeColumnsOfFit(bench_, *without, *found_.chosen, uses, torques_);
    if (!table.valid || table.trials.empty() || !Left().valid) return numbers;
    const std::size_t residuals = without->problem->residuals();
    numbers.discrepancy =
        TorquesBeside(Left(), {}, residuals).likelihood - TorquesBeside(table, {}, residuals).likelihood;
    const double floor = 0.5 * static_cast<double>(residuals);
    const double held =
        (without->train_cost - found_.chosen->train_cost) / std::max(without->train_cost - floor, 1e-9 * floor);
    numbers.mimicry = Mimicry(table, torques_, std::min(held, 1.0));
    return numbers;
  }

  Judgement Make() {
    Judgement result;
    for (const Member& member : found_.members) result.statements.push_back(Of(member.use));
    const std::vector<Statement> dropped = DropSpare(&result);
    Couple(&result);
    AddRivals(&result);
    result.statements.insert(result.statements.end(), dropped.begin(), dropped.end());
    for (Statement& s : result.statements)
      s.answer = s.probability >= kDiagnosePolicy.probability.present ? Answer::kPresent : Answer::kAbsent;
    AddOthers(&result);
    std::stable_sort(result.statements.begin(), result.statements.end(),
                     [](const Statement& a, const Statement& b) { return a.probability > b.probability; });
    Conclude(&result);
    return result;
  }

 private:
  // What the chosen set leaves, with the torques' columns.
  const ColumnTable& Left() {
    if (left_of_ != found_.chosen) left_ = MakeColumns(bench_, *found_.chosen, {}, torques_);
    left_of_ = found_.chosen;
    return left_;
  }

  Statement Of(const EffectUse& use) {
    Statement statement{.use = use, .numbers = Numbers({use}), .rule = "its own evidence"};
    Weigh({use}, &statement);
    return statement;
  }

  // A member that is not sure and hardly gains takes evidence from those that it stands in for: it goes, the weakest
  // first, and they are judged without it.
  std::vector<Statement> DropSpare(Judgement* result) {
    std::vector<Statement> dropped;
    for (;;) {
      auto& all = result->statements;
      const auto least = std::min_element(all.begin(), all.end(), [](const Statement& a, const Statement& b) {
        return a.numbers.gain < b.numbers.gain;
      });
      if (all.size() < 2 || least->probability >= kDiagnosePolicy.probability.present ||
          least->numbers.gain >= kDiagnosePolicy.search.tie)
        return dropped;
      const EffectSet rest = Without(found_.chosen->effects, least->use);
      Candidate* without = found_.ledger.Find(rest);
      if (!without) return dropped;
      found_.ledger.Continue(without, Effort::kTry);
      ScoreCandidate(bench_, without);
      found_.chosen = without;
      free_left_ = FreeRunError(bench_, *without);
      dropped.push_back(*least);
      dropped.back().rule = "hardly gains beside the others";
      const EffectUse gone = least->use;
      all.erase(least);
      std::erase_if(found_.members, [&](const Member& m) { return m.use == gone; });
      for (Statement& s : all) {
        if (ImitatedBy(s.use, gone) >= kDiagnosePolicy.search.imitates) s = Of(s.use);
      }
    }
  }

  double PriorOf(const EffectUse& use) const {
    for (const std::string& name : {use.Text(), use.effect}) {
      if (const auto given = bench_.priors.find(name); given != bench_.priors.end()) return given->second;
    }
    return Statement{}.prior;
  }

  // Evidence and probability from the numbers. Of several uses the likeliest one's prior counts.
  void Weigh(const std::vector<EffectUse>& uses, Statement* statement) const {
    statement->prior = 0;
    for (const EffectUse& use : uses) statement->prior = std::max(statement->prior, PriorOf(use));
    statement->evidence = ProbabilityOf(statement->numbers);
    statement->probability = AtPrior(statement->evidence, statement->prior);
  }

  // Members that stand in for each other, neither of them sure alone, are judged by taking both out, the nearest pairs
  // first. Most of what they gain must show only then: else the stronger one would lend the weaker one its evidence.
  void Couple(Judgement* result) {
    constexpr double kImitates = 0.5;
    std::vector<std::tuple<double, Statement*, Statement*>> pairs;
    for (Statement& x : result->statements) {
      for (Statement& y : result->statements) {
        const double imitated = &x < &y ? ImitatedBy(x.use, y.use) : 0;
        if (imitated >= kImitates) pairs.emplace_back(imitated, &x, &y);
      }
    }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const auto& a, const auto& b) { return std::get<0>(a) > std::get<0>(b); });
    const double present = kDiagnosePolicy.probability.present;
    for (const auto& [imitated, x, y] : pairs) {
      if (std::max(x->probability, y->probability) >= present || x->group >= 0 || y->group >= 0) continue;
      Statement together{.numbers = Numbers({x->use, y->use}), .rule = "taken out together"};
      Weigh({x->use, y->use}, &together);
      const double alone = std::max(x->numbers.gain, 0.0) + std::max(y->numbers.gain, 0.0);
      if (together.probability < present || alone > kDiagnosePolicy.evidence.alone * together.numbers.gain) continue;
      together.group = static_cast<int>(result->groups.size());
      result->groups.push_back({x->use, y->use});
      for (Statement* s : {x, y}) {
        together.use = s->use;
        *s = together;
      }
    }
  }

  double ImitatedBy(const EffectUse& a, const EffectUse& b) const {
    double most = 0;
    for (const Trial& x : found_.columns.trials) {
      for (const Trial& y : found_.columns.trials) {
        if (x.use == a && y.use == b) most = std::max(most, Imitated(found_.columns, x, y));
      }
    }
    return most;
  }

  // What costs as little in a member's place is told with it.
  void AddRivals(Judgement* result) {
    const SearchPolicy& policy = kDiagnosePolicy.search;
    for (std::size_t m = 0; m < found_.members.size(); ++m) {
      const Member& member = found_.members[m];
      std::vector<Rival> rivals = member.rivals;
      for (const EffectUse& use : found_.uses) {  // one motion on these logs, whether it was tried or not
        const bool tried = std::any_of(rivals.begin(), rivals.end(), [&](const Rival& r) { return r.use == use; });
        const bool chosen = std::count(found_.chosen->effects.begin(), found_.chosen->effects.end(), use) > 0;
        if (!tried && !chosen && AreOneMotion(use, member.use, *found_.base->model, found_.logged))
          rivals.push_back({.use = use});
      }
      for (const Rival& rival : rivals) {
        const Model& base = *found_.base->model;
        const bool one = AreOneMotion(rival.use, member.use, base, found_.logged);
        if (!one && rival.behind > std::max(policy.tie, policy.tie_share * member.gain)) continue;
        if (IsLessLikely(rival.use, member.use, base)) continue;
        Statement& own = result->statements[m];
        if (own.group < 0) {
          own.group = static_cast<int>(result->groups.size());
          result->groups.push_back({own.use});
        }
        result->groups[static_cast<std::size_t>(own.group)].push_back(rival.use);
        Statement other{.use = rival.use,
                        .probability = AtPrior(own.evidence, PriorOf(rival.use)),
                        .prior = PriorOf(rival.use),
                        .evidence = own.evidence,
                        .group = own.group,
                        .numbers = own.numbers,
                        .rule = "costs as little in its place"};
        result->statements.push_back(std::move(other));
      }
    }
  }

  // Effects that were looked at and did not enter the set.
  void AddOthers(Judgement* result) {
    const ColumnTable& table = found_.columns;
    for (const EffectUse& use : found_.uses) {
      if (std::any_of(result->statements.begin(), result->statements.end(),
                      [&](const Statement& s) { return s.use == use; }))
        continue;
      double seen = 0;
      for (std::size_t t = 0; t < table.trials.size(); ++t) {
        if (table.trials[t].use != use) continue;
        const Eigen::Index c = table.trials[t].columns.front();
        if (table.sum(c, c) > 0)
          seen = std::max(seen, table.reduced(table.Reduced(c), table.Reduced(c)) / table.sum(c, c));
      }
      constexpr double kNothing = 1e-3;  // of a column is left beside the base model's parameters
      Statement statement{
          .use = use, .answer = seen > kNothing ? Answer::kAbsent : Answer::kUnseen, .prior = PriorOf(use)};
      statement.rule = seen > kNothing ? "gains too little beside the effects of the final set"
                                       : "the base model's parameters imitate it fully";
      result->statements.push_back(std::move(statement));
    }
  }

  void Conclude(Judgement* result) {
    const Candidate &base = *found_.base, &chosen = *found_.chosen;
    VerdictEvidence& e = result->evidence;
    e.floors_before = base.held_out_floors;
    e.free_run_before = &base == &chosen ? free_left_ : FreeRunError(bench_, base);
    VerdictFacts facts{.floors_left = e.floors_before};
    double right = 1;
    for (const Statement& s : result->statements) {
      const bool present = s.answer == Answer::kPresent;
      if (present && s.group >= 0) facts.told = false;
      facts.present = facts.present || present;
      if (std::any_of(chosen.effects.begin(), chosen.effects.end(), [&](const EffectUse& use) { return use == s.use; }))
        right *= present ? s.probability : 1 - s.probability;
    }
    facts.retuned = found_.nominal->held_out_cost > 0
                        ? (found_.nominal->held_out_cost - base.held_out_cost) / found_.nominal->held_out_cost
                        : 0;
    result->verdict = VerdictOf(facts);
    result->probability = right;
  }

  const Workbench& bench_;
  SearchResult& found_;
  const Say& say_;
  std::vector<RandomTorque> torques_;
  double free_left_;
  ColumnTable left_;
  const Candidate* left_of_ = nullptr;  // whose table that is
};

}  // namespace

double ProbabilityOf(const StatementNumbers& n) {
  const ProbabilityPolicy& w = kDiagnosePolicy.probability;
  // The middle one: a single kind of log that happens not to show the effect, or to show it alone, does not decide.
  std::vector<double> gains;
  for (const double gain : {n.gain, n.gain_held_out, n.gain_free}) {
    if (std::isfinite(gain)) gains.push_back(gain);
  }
  const double gain = gains.empty() ? 0 : Median(gains);
  const double evidence = std::clamp(std::copysign(std::log1p(std::abs(n.discrepancy)), n.discrepancy), -1.0, 5.0);
  const double x = w.constant + w.gain * std::clamp(gain, -1.0, kDiagnosePolicy.evidence.most_gain) +
                   w.mimicry * std::log10(n.mimicry + 0.01) + w.discrepancy * evidence + (n.smooth ? w.smooth : 0);
  return 1 / (1 + std::exp(-x));
}

double AtPrior(double evidence, double prior) {
  const double yes = evidence * prior, no = (1 - evidence) * (1 - prior);
  return yes + no > 0 ? yes / (yes + no) : prior;
}

Verdict VerdictOf(const VerdictFacts& facts) {
  if (facts.present) return facts.told ? Verdict::kEffects : Verdict::kAmbiguous;
  if (facts.floors_left > kDiagnosePolicy.verdict.much_missing) return Verdict::kUnknown;
  return facts.retuned > kDiagnosePolicy.verdict.retuned ? Verdict::kParameters : Verdict::kNone;
}

Judgement Judge(const Workbench& bench, SearchResult& found, const Say& say) {
  return Judging(bench, found, say).Make();
}

}  // namespace gapscope
