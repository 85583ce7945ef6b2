#include "src/diagnose/judge.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "src/core/statistics.h"
#include "src/diagnose/evidence.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/others.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/probability.h"
#include "src/diagnose/rivals.h"

namespace gapscope {
namespace {

class Judging {
 public:
  Judging(const Workbench& bench, SearchResult& found, const Say& say)
      : bench_(bench), found_(found), say_(say), evidence_(bench, found) {}

  Judgement Make() {
    Judgement result;
    const std::size_t searched = found_.chosen->effects.size();
    std::vector<Statement> dropped = Simplify();
    JudgeMembers(&result, &dropped);
    JudgeTogether(&result);
    while (LeaveOutUnsure(&result, &dropped)) JudgeTogether(&result);
    TellRivals(bench_, found_, found_.chosen->effects.size() < searched, say_, &result);
    for (const Statement& s : dropped) {
      if (!result.Find(s.use)) result.statements.push_back(s);
    }
    for (Statement& s : result.statements)
      s.answer = s.probability >= kDiagnosePolicy.probability.present ? Answer::kPresent : Answer::kAbsent;
    TellOthers(bench_, found_, &result);
    for (Statement& s : result.statements) {
      if (EffectOf(s.use, *bench_.rig).of_time) s.caveat = CaveatOf(found_.logged.clocks);
    }
    std::stable_sort(result.statements.begin(), result.statements.end(),
                     [](const Statement& a, const Statement& b) { return a.probability > b.probability; });
    Conclude(&result);
    return result;
  }

 private:
  Statement Of(const EffectUse& use) {
    say_("judging " + use.Text());
    Statement statement{.use = use, .rule = "its own evidence"};
    evidence_.Of({use}, &statement);
    Weigh({use}, &statement);
    return statement;
  }

  // What a richer description does beyond a simpler one is a finding of its own: where that is not sure, the simpler
  // one takes its place, and where it is open, or the richer one is what there mostly is, they are told together. One
  // size for all places is simpler than one each, and so is an effect that another contains.
  std::vector<Statement> Simplify() {
    std::vector<Statement> dropped;
    for (const EffectUse& use : found_.uses) {
      if (use.on == kOnAll && !found_.HasMember(use)) PutInPlace(OnEachPlace(use), use, &dropped);
    }
    for (const EffectUse& member : EffectSet(found_.chosen->effects)) {
      EffectUse simple;
      double least = kInfinity;
      for (const EffectUse& use : found_.uses) {
        if (!Contains(member, use, *bench_.rig, true) || found_.HasMember(use)) continue;
        const Candidate* tried = RefitInPlace(bench_, found_, {member}, use, Effort::kTaste);
        if (tried && tried->train_cost < least) least = tried->train_cost, simple = use;
      }
      if (std::isfinite(least)) PutInPlace({member}, simple, &dropped);
    }
    return dropped;
  }

  // The members that are an effect on each of its places; empty: not on each.
  std::vector<EffectUse> OnEachPlace(const EffectUse& all) const {
    std::vector<EffectUse> each;
    for (const std::string& place : PlacesOf(all, *bench_.rig)) each.push_back({all.effect, place});
    const bool have =
        std::all_of(each.begin(), each.end(), [&](const EffectUse& use) { return found_.HasMember(use); });
    return have && each.size() > 1 ? each : std::vector<EffectUse>();
  }

  void PutInPlace(const std::vector<EffectUse>& members, const EffectUse& simple, std::vector<Statement>* dropped) {
    Candidate* simpler = members.empty() ? nullptr : RefitInPlace(bench_, found_, members, simple, Effort::kTry);
    if (!simpler) return;
    say_("judging " + NameOfSet(members) + " beyond " + simple.Text());
    Statement beyond{.rule = "what it does beyond " + simple.Text() + " is not sure"};
    evidence_.Of(members, simpler, &beyond);
    Weigh(members, &beyond);
    const Told told = ToldBeyond(beyond.probability);
    if (told == Told::kRicher) return;
    const bool open = members.size() == 1 && (told == Told::kTogether || IsUsual(members.front(), simple, *bench_.rig));
    const double rise = Gain(*simpler, *found_.chosen);
    Member joined{.use = simple};
    for (const EffectUse& use : members) {
      beyond.use = use;
      if (!open) dropped->push_back(beyond);
      const auto gone = std::find_if(found_.members.begin(), found_.members.end(),
                                     [&](const Member& member) { return member.use == use; });
      if (members.size() == 1) joined.rivals = gone->rivals;
      found_.members.erase(gone);
    }
    for (Rival& rival : joined.rivals) rival.behind -= rise;
    std::erase_if(joined.rivals, [&](const Rival& rival) { return rival.use == simple; });
    if (open) joined.rivals.push_back({.use = members.front(), .behind = -rise});
    found_.members.push_back(joined);
    evidence_.Choose(simpler);
  }

  // A member that is not sure and hardly gains, or only on the logs that were fitted, takes evidence from the others.
  // It goes, the least likely one first, and they are judged without it: at once what it stood in for, the rest at
  // last.
  void JudgeMembers(Judgement* result, std::vector<Statement>* dropped) {
    auto& all = result->statements;
    for (const Member& member : found_.members) all.push_back(Of(member.use));
    std::set<EffectUse> stale;  // judged beside members that are gone
    for (auto spare = TakeOutSpare(all); spare != all.end() || !stale.empty(); spare = TakeOutSpare(all)) {
      if (spare == all.end()) {
        for (Statement& s : all) {
          if (stale.contains(s.use)) s = Of(s.use);
        }
        stale.clear();
        continue;
      }
      const EffectUse gone = spare->use;
      const bool hardly = spare->numbers.gain < kDiagnosePolicy.search.tie;
      dropped->push_back(*spare);
      dropped->back().rule = hardly ? "hardly gains beside the others" : "gains on the logs that were fitted alone";
      all.erase(spare);
      std::erase_if(found_.members, [&](const Member& m) { return m.use == gone; });
      for (Statement& s : all) {
        stale.insert(s.use);
        if (hardly && Imitated(found_.columns, s.use, gone) < kDiagnosePolicy.search.imitates) continue;
        s = Of(s.use);
        stale.erase(s.use);
      }
    }
  }

  // What is left is then chosen. The last one stays, unsure or not, unless it is unconfirmed.
  std::vector<Statement>::iterator TakeOutSpare(std::vector<Statement>& all) {
    const auto least = LeastLikelySpare(all);
    if (least == all.end() || (found_.members.size() < 2 && !IsUnconfirmed(least->numbers))) return all.end();
    return ChooseWithout(least->use) ? least : all.end();
  }

  // False: the set without it cannot be built or simulated.
  bool ChooseWithout(const EffectUse& use) {
    Candidate* without = found_.ledger.FindOrTry(Without(found_.chosen->effects, use), *found_.chosen);
    if (without) evidence_.Choose(without);
    return without != nullptr;
  }

  void JudgeTogether(Judgement* result) {
    result->groups.clear();
    Couple(result);
    JudgeComplements(result);
  }

  // What is told is the set of the sure members, so that is what they are judged in: beside one that is not told, they
  // could rest on it. The least likely one goes first, and the others are judged anew. False: all are sure, or none.
  bool LeaveOutUnsure(Judgement* result, std::vector<Statement>* dropped) {
    auto& all = result->statements;
    const auto [least, most] = std::ranges::minmax_element(all, {}, &Statement::probability);
    const double present = kDiagnosePolicy.probability.present;
    if (all.empty() || least->probability >= present || most->probability < present) return false;
    if (!ChooseWithout(least->use)) return false;
    const auto member = std::ranges::find(found_.members, least->use, &Member::use);
    least->rivals = member->rivals;
    dropped->push_back(*least);
    found_.members.erase(member);
    all.erase(least);
    for (Statement& s : all) s = Of(s.use);
    return true;
  }

  // Evidence and probability from the numbers. Of several uses the likeliest one's prior counts.
  void Weigh(const std::vector<EffectUse>& uses, Statement* statement) const {
    statement->prior = 0;
    for (const EffectUse& use : uses) statement->prior = std::max(statement->prior, bench_.PriorOf(use));
    statement->evidence = ProbabilityOf(statement->numbers);
    statement->probability = AtPrior(statement->evidence, statement->prior);
  }

  // Members that stand in for each other, not both of them sure alone, are judged by taking both out, the nearest pairs
  // first.
  void Couple(Judgement* result) {
    constexpr double kImitates = 0.5;
    std::vector<std::tuple<double, Statement*, Statement*>> pairs;
    for (Statement& x : result->statements) {
      for (Statement& y : result->statements) {
        const double imitated = &x < &y ? Imitated(found_.columns, x.use, y.use) : 0;
        if (imitated >= kImitates) pairs.emplace_back(imitated, &x, &y);
      }
    }
    std::stable_sort(pairs.begin(), pairs.end(),
                     [](const auto& a, const auto& b) { return std::get<0>(a) > std::get<0>(b); });
    const double present = kDiagnosePolicy.probability.present;
    for (const auto& [imitated, x, y] : pairs) {
      if (std::min(x->probability, y->probability) >= present || x->group >= 0 || y->group >= 0) continue;
      say_("judging " + NameOfSet({x->use, y->use}));
      Statement together{.rule = "taken out together"};
      evidence_.Of({x->use, y->use}, &together);
      Weigh({x->use, y->use}, &together);
      if (together.probability < present || !AreOneFinding(x->numbers.gain, y->numbers.gain, together.numbers.gain))
        continue;
      together.group = static_cast<int>(result->groups.size());
      result->groups.push_back({x->use, y->use});
      for (Statement* s : {x, y}) {
        together.use = s->use;
        *s = together;
      }
    }
  }

  // Members that are seen only beside each other are there both or neither: what the one that seems sure gains rests
  // on the other one.
  void JudgeComplements(Judgement* result) {
    const double present = kDiagnosePolicy.probability.present;
    for (Statement& x : result->statements) {
      for (Statement& y : result->statements) {
        if (&x >= &y || x.group >= 0 || y.group >= 0 || std::min(x.probability, y.probability) >= present) continue;
        if (std::min(x.numbers.gain, y.numbers.gain) < kDiagnosePolicy.search.tie) continue;
        if (!CouldBeComplements(x, y)) continue;
        say_("judging " + NameOfSet({x.use, y.use}) + ": both or neither");
        Statement both{.rule = "both or neither"};
        evidence_.Of({x.use, y.use}, &both);
        both.numbers.dry = x.numbers.dry || y.numbers.dry;  // no smooth torque takes the place of both
        Weigh({x.use, y.use}, &both);
        both.prior = std::min(bench_.PriorOf(x.use), bench_.PriorOf(y.use));
        both.probability = AtPrior(both.evidence, both.prior);
        if (both.probability < present || !AreComplements(x.numbers, y.numbers, both.numbers)) continue;
        const EffectUse of_x = x.use, of_y = y.use;
        x = y = both;
        x.use = of_x, x.beside = of_y;
        y.use = of_y, y.beside = of_x;
      }
    }
  }

  // Whether what both gain could make them complements: on the fitted logs that is at least what one of them does.
  bool CouldBeComplements(const Statement& x, const Statement& y) const {
    const auto of_x = bench_.LimbsOf(x.use), of_y = bench_.LimbsOf(y.use);
    bool touch = false;
    for (std::size_t l = 0; l < of_x.size(); ++l) touch = touch || (of_x[l] && of_y[l]);
    return touch && (AreComplements(x.numbers.gain, y.numbers.gain, std::max(x.numbers.gain, y.numbers.gain)) ||
                     std::min(x.numbers.gain_held_out, y.numbers.gain_held_out) >= kDiagnosePolicy.search.tie);
  }

  void Conclude(Judgement* result) {
    const Candidate &base = *found_.base, &chosen = *found_.chosen;
    VerdictEvidence& e = result->evidence;
    e.floors_before = base.held_out_floors;
    const FreeRuns of_base = &base == &chosen ? evidence_.free_left() : RunFree(bench_, base);
    e.free_run_before = of_base.error;
    e.free_runs = of_base.runs;
    VerdictFacts facts{.floors_left = e.floors_before};
    double right = 1;
    for (const Statement& s : result->statements) {
      const bool present = s.answer == Answer::kPresent;
      if (present && s.group >= 0) facts.told = false;
      facts.present = facts.present || present;
      if (Has(chosen.effects, s.use)) right *= present ? s.probability : 1 - s.probability;
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
  Evidence evidence_;
};

}  // namespace

Statement* Judgement::Find(const EffectUse& use) {
  const auto found = std::ranges::find(statements, use, &Statement::use);
  return found == statements.end() ? nullptr : &*found;
}

std::vector<Statement>::iterator LeastLikelySpare(std::vector<Statement>& members) {
  auto least = members.end();
  for (auto s = members.begin(); s != members.end(); ++s) {
    const StatementNumbers& n = s->numbers;
    const bool is_spare = IsUnconfirmed(n) || (s->probability < kDiagnosePolicy.probability.present &&
                                               (n.gain < kDiagnosePolicy.search.tie || n.gain_held_out < 0));
    if (is_spare && (least == members.end() || s->probability < least->probability)) least = s;
  }
  return least;
}

bool AreOneFinding(double gain_a, double gain_b, double together) {
  const auto [less, more] = std::minmax({std::max(gain_a, 0.0), std::max(gain_b, 0.0)});
  return less >= kDiagnosePolicy.evidence.alike * more || less + more <= kDiagnosePolicy.evidence.alone * together;
}

bool AreComplements(double gain_a, double gain_b, double together) {
  // Of costs, not of their logarithms: what effects of different things gain adds up in costs.
  const double a = std::expm1(gain_a), b = std::expm1(gain_b), both = std::expm1(together);
  const double alone = kDiagnosePolicy.evidence.alone;
  return a > 0 && b > 0 && both - b <= alone * a && both - a <= alone * b;
}

bool AreComplements(const StatementNumbers& a, const StatementNumbers& b, const StatementNumbers& together) {
  return AreComplements(a.gain, b.gain, together.gain) ||
         AreComplements(a.gain_held_out, b.gain_held_out, together.gain_held_out);
}

Told ToldBeyond(double probability) {
  if (probability >= kDiagnosePolicy.probability.present) return Told::kRicher;
  return probability >= kDiagnosePolicy.next.absent ? Told::kTogether : Told::kSimpler;
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
