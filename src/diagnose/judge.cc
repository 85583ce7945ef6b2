#include "src/diagnose/judge.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <set>
#include <tuple>

#include "src/core/statistics.h"
#include "src/diagnose/beside.h"
#include "src/diagnose/evidence.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/probability.h"

namespace gapscope {
namespace {

class Judging {
 public:
  Judging(const Workbench& bench, SearchResult& found, const Say& say)
      : bench_(bench), found_(found), say_(say), evidence_(bench, found) {}

  Judgement Make() {
    Judgement result;
    std::vector<Statement> dropped = Simplify();
    JudgeMembers(&result, &dropped);
    Couple(&result);
    JudgeComplements(&result);
    AddRivals(&result);
    AddRicher(&result);
    for (const Statement& s : dropped) {
      if (!FindTold(s.use, &result)) result.statements.push_back(s);
    }
    for (Statement& s : result.statements)
      s.answer = s.probability >= kDiagnosePolicy.probability.present ? Answer::kPresent : Answer::kAbsent;
    AddOthers(&result);
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
      if (use.on == kOnAll && !HasMember(use)) PutInPlace(OnEachPlace(use), use, &dropped);
    }
    for (const EffectUse& member : EffectSet(found_.chosen->effects)) {
      EffectUse simple;
      double least = kInfinity;
      for (const EffectUse& use : found_.uses) {
        if (!Contains(member, use, *bench_.rig, true) || HasMember(use)) continue;
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
    const bool have = std::all_of(each.begin(), each.end(), [&](const EffectUse& use) { return HasMember(use); });
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

  // The first statement about a use; null: there is none.
  static Statement* FindTold(const EffectUse& use, Judgement* result) {
    const auto found = std::ranges::find(result->statements, use, &Statement::use);
    return found == result->statements.end() ? nullptr : &*found;
  }

  bool HasMember(const EffectUse& use) const {
    return std::any_of(found_.members.begin(), found_.members.end(), [&](const Member& m) { return m.use == use; });
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
        if (hardly && ImitatedBy(s.use, gone) < kDiagnosePolicy.search.imitates) continue;
        s = Of(s.use);
        stale.erase(s.use);
      }
    }
  }

  // What is left is then chosen. The last one stays, unsure or not, unless it is unconfirmed.
  std::vector<Statement>::iterator TakeOutSpare(std::vector<Statement>& all) {
    const auto least = LeastLikelySpare(all);
    if (least == all.end() || (found_.members.size() < 2 && !IsUnconfirmed(least->numbers))) return all.end();
    Candidate* without = found_.ledger.FindOrTry(Without(found_.chosen->effects, least->use), *found_.chosen);
    if (!without) return all.end();
    evidence_.Choose(without);
    return least;
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

  // Members that stand in for each other, not both of them sure alone, are judged by taking both out, the nearest pairs
  // first.
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
        both.prior = std::min(PriorOf(x.use), PriorOf(y.use));
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

  double ImitatedBy(const EffectUse& a, const EffectUse& b) const {
    double most = 0;
    for (const Trial& x : found_.columns.trials) {
      for (const Trial& y : found_.columns.trials) {
        if (x.use == a && y.use == b) most = std::max(most, Imitated(found_.columns, x, y));
      }
    }
    return most;
  }

  // As these logs and the base model have them.
  bool AreOne(const EffectUse& a, const EffectUse& b) const {
    return AreOneMotion(a, b, *found_.base->model, found_.logged);
  }

  // Whether it could be in the place of a member that the set leaves out: it then gains what that one gained.
  bool StandsIn(const EffectUse& use, const EffectSet& set) const {
    return std::any_of(found_.members.begin(), found_.members.end(), [&](const Member& member) {
      return !Has(set, member.use) &&
             (AreOne(use, member.use) || ImitatedBy(member.use, use) >= kDiagnosePolicy.search.imitates);
    });
  }

  // By how much a set costs more with `use` in a member's place, where both are in the ledger. Infinite where the
  // member hardly gains: nothing at all would cost as little there.
  double BehindIn(const EffectSet& set, const EffectUse& member, const EffectUse& use) {
    const EffectSet rest = Without(set, member);
    const Candidate *own = found_.ledger.Find(set), *other = found_.ledger.Find(With(rest, use));
    if (!own || !other) return kInfinity;
    const Candidate* without = found_.ledger.FindOrTry(rest, *own);
    return without && Gain(*without, *own) >= kDiagnosePolicy.search.tie ? Gain(*other, *own) : kInfinity;
  }

  // What was tried in a member's place: by the search, or where the ledger has that set by another way. `present`: the
  // sure members, whose set is what remains in the end.
  std::vector<Rival> RivalsOf(const Member& member, const EffectSet& present) {
    std::vector<Rival> rivals;
    for (const EffectUse& use : found_.uses) {
      if (Has(found_.chosen->effects, use)) continue;
      double behind = AreOne(use, member.use) ? 0 : kInfinity;
      for (const Rival& tried : member.rivals) {
        if (tried.use == use) behind = std::min(behind, tried.behind);
      }
      const bool same = Contains(use, member.use, *bench_.rig, true) || Contains(member.use, use, *bench_.rig, true);
      if (!same) behind = std::min(behind, BehindIn(found_.chosen->effects, member.use, use));
      const bool is_sure = Has(present, member.use);
      if (!same && is_sure && !StandsIn(use, present)) behind = std::min(behind, BehindIn(present, member.use, use));
      if (std::isfinite(behind)) rivals.push_back({.use = use, .behind = behind});
    }
    std::stable_sort(rivals.begin(), rivals.end(), [](const Rival& a, const Rival& b) { return a.behind < b.behind; });
    return rivals;
  }

  // What costs as little in a member's place is told with it, and what the logs do not tell from that at all.
  void AddRivals(Judgement* result) {
    EffectSet present;
    for (const Statement& s : result->statements) {
      if (s.probability >= kDiagnosePolicy.probability.present) present = With(present, s.use);
    }
    // Sure ones first: what is there in one's place is not told as absent in another's.
    for (const bool sure : {true, false}) {
      for (std::size_t m = 0; m < found_.members.size(); ++m) {
        const Member& member = found_.members[m];
        if (Has(present, member.use) != sure) continue;
        const std::vector<Rival> rivals = RivalsOf(member, present);
        result->statements[m].rivals = rivals;
        TellRivals(member, rivals, result);
      }
    }
  }

  void TellRivals(const Member& member, const std::vector<Rival>& rivals, Judgement* result) {
    for (const Rival& rival : rivals) {
      if (!AreOne(rival.use, member.use) && rival.behind > TieOf(member.gain)) continue;
      if (IsLessLikely(rival.use, member.use, *found_.base->model)) continue;
      TellWith(member.use, rival.use, "costs as little in its place", result);
      for (const EffectUse& use : found_.uses) {
        if (!Has(found_.chosen->effects, use) && AreOne(use, rival.use))
          TellWith(member.use, use, "is one motion with " + rival.use.Text(), result);
      }
    }
  }

  // A simpler effect is told alone only where the logs would show what a richer one usually does beyond it.
  void AddRicher(Judgement* result) {
    std::vector<Beyond> asked;
    for (const Member& member : found_.members) {
      const Statement& own = *FindTold(member.use, result);
      if (own.probability < kDiagnosePolicy.probability.present) continue;
      for (const EffectUse& use : found_.uses) {
        const bool is_told = own.group >= 0 && Has(result->groups[static_cast<std::size_t>(own.group)], use);
        if (Contains(use, member.use, *bench_.rig, true) && !HasMember(use) && !is_told)
          asked.push_back({.simpler = member.use, .richer = use});
      }
    }
    for (const Beyond& one : NotExcluded(bench_, *found_.chosen, asked))
      TellWith(one.simpler, one.richer, "would not show in these logs beyond " + one.simpler.Text(), result);
  }

  // Told together with a member, as likely. Where that is not likely, not what is told already.
  void TellWith(const EffectUse& member, const EffectUse& use, const std::string& rule, Judgement* result) {
    Statement& own = *FindTold(member, result);
    if (own.probability < kDiagnosePolicy.probability.present && FindTold(use, result)) return;
    if (own.group < 0) {
      own.group = static_cast<int>(result->groups.size());
      result->groups.push_back({own.use});
    }
    auto& group = result->groups[static_cast<std::size_t>(own.group)];
    if (Has(group, use)) return;
    group.push_back(use);
    Statement other{.use = use,
                    .probability = AtPrior(own.evidence, PriorOf(use)),
                    .prior = PriorOf(use),
                    .evidence = own.evidence,
                    .group = own.group,
                    .beside = own.beside,
                    .numbers = own.numbers,
                    .sets = own.sets,
                    .rule = rule};
    result->statements.push_back(std::move(other));
  }

  // The trial of the use that explains most beside others; the end of the table's where it has none.
  std::size_t BestTrial(const EffectUse& use, std::vector<std::size_t> beside) const {
    const ColumnTable& table = found_.columns;
    std::size_t best = table.trials.size();
    double least = kInfinity;
    beside.push_back(best);
    for (std::size_t t = 0; t < table.trials.size(); ++t) {
      if (table.trials[t].use != use) continue;
      beside.back() = t;
      if (const double cost = SetCost(table, beside); cost < least) least = cost, best = t;
    }
    return best;
  }

  // Trials that stand for the final set.
  std::vector<std::size_t> TrialsOfSet() const {
    std::vector<std::size_t> trials;
    for (const EffectUse& member : found_.chosen->effects) {
      if (const std::size_t t = BestTrial(member, trials); t < found_.columns.trials.size()) trials.push_back(t);
    }
    return trials;
  }

  // Whether the search ended before a fit of the use that its columns promise something of, beside the set's trials.
  bool WasNotReached(const EffectUse& use, std::vector<std::size_t> set) const {
    const ColumnTable& table = found_.columns;
    const auto fitted = [&](const Candidate* candidate) { return Has(candidate->effects, use); };
    if (found_.cut.empty() || std::ranges::any_of(found_.ledger.All(), fitted)) return false;
    const std::size_t t = BestTrial(use, set);
    if (t == table.trials.size()) return false;
    const double without = SetCost(table, set);
    set.push_back(t);
    return std::log(without / SetCost(table, set)) >= kDiagnosePolicy.search.promise;
  }

  // Effects that were looked at and did not enter the set.
  void AddOthers(Judgement* result) {
    const ColumnTable& table = found_.columns;
    if (!table.valid) return;  // nothing was looked at
    const std::vector<std::size_t> set = TrialsOfSet();
    for (const EffectUse& use : found_.uses) {
      if (FindTold(use, result)) continue;
      if (WasNotReached(use, set)) {
        result->statements.push_back({.use = use, .answer = Answer::kUnseen, .prior = PriorOf(use), .rule = kNotTried});
        continue;
      }
      bool tried = false;
      double seen = 0, moved = 0;
      for (std::size_t t = 0; t < table.trials.size(); ++t) {
        if (table.trials[t].use != use) continue;
        tried = true;
        const Eigen::Index c = table.trials[t].columns.front();
        moved = std::max(moved, table.sum(c, c));
        if (table.sum(c, c) > 0)
          seen = std::max(seen, table.reduced(table.Reduced(c), table.Reduced(c)) / table.sum(c, c));
      }
      constexpr double kNothing = 1e-3;  // of a column is left beside the base model's parameters
      Statement statement{
          .use = use, .answer = seen > kNothing ? Answer::kAbsent : Answer::kUnseen, .prior = PriorOf(use)};
      statement.rule = seen > kNothing ? "gains too little beside the effects of the final set"
                       : moved > 0     ? "the base model's parameters imitate it fully"
                       : tried         ? "these logs do not move what it acts on"
                                       : kNotSimulated;
      result->statements.push_back(std::move(statement));
    }
    for (const EffectUse& use : found_.out_of_sight)
      result->statements.push_back({.use = use, .answer = Answer::kUnseen, .prior = PriorOf(use), .rule = kOutOfSight});
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
