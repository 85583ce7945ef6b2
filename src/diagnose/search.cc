#include "src/diagnose/search.h"

#include <algorithm>
#include <cmath>
#include <set>
#include <utility>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/base_fit.h"
#include "src/diagnose/diagnosis.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

constexpr const SearchPolicy& kPolicy = kDiagnosePolicy.search;

// A set's cost with what each of its effects must gain; of sets that are at the noise alike, the cost itself decides.
std::pair<double, double> Charged(const Candidate& candidate) {
  return {LogCostAboveNoise(candidate.train_limbs) + kPolicy.member * static_cast<double>(candidate.effects.size()),
          candidate.train_cost};
}

class Searcher {
 public:
  Searcher(const Workbench& bench, const Say& say, SearchResult* result) : bench_(bench), say_(say), result_(*result) {}

  void Find(const std::vector<Hint>& hints) {
    for (const Hint& hint : hints) {
      if (hint.effects.empty()) result_.ledger.Refit({}, *result_.base, hint.values, {}, Effort::kFinish);
    }
    ScoreCandidate(bench_, result_.base);
    say_("columns of all effects");
    MeasureCoupling(bench_, *result_.base);
    SplitTrainCost(bench_, result_.base);
    result_.columns = MakeColumns(bench_, *result_.base, result_.uses, {});
    if (!result_.columns.valid) return;
    const std::vector<std::size_t> counts{kPolicy.singles, kPolicy.pairs, kPolicy.triples};
    RefitSets(*result_.base, result_.columns, counts);
    for (const Hint& hint : hints) {
      if (hint.effects.empty()) continue;
      say_("refitting " + NameOfSet(hint.effects));
      result_.ledger.Refit(hint.effects, *result_.base, hint.values, {}, Effort::kTry);
    }
    // However little may be done, the first sets are looked at.
    until_ = kPolicy.until_grown;
    Grow(Leaders());
    until_ = kPolicy.until_exchanged;
    bool begun_anew = false;
    // What leads after an exchange has other gaps than what growth ended on.
    do {
      Lead();
      Settle();
    } while (GrowFurther() || (!std::exchange(begun_anew, true) && RefitFromNominal(counts)));
    while (MergeOne()) Settle();
    // A name is told alone only where what could stand in its place was tried. That is judging, for which no work is
    // too much.
    Exchange(kInfinity);
  }

 private:
  // A base model that was refitted without an effect may have gone to where it imitates that, and no small step leads
  // on from there. So with the work that is left sets are begun from the model as it is given, too. Whether another set
  // leads then.
  bool RefitFromNominal(const std::vector<std::size_t>& counts) {
    if (AtNoise(*result_.chosen) || Late(until_, "sets from the given model")) return false;
    const Candidate* leader = Leaders().front();
    SplitTrainCost(bench_, result_.nominal.get());
    const ColumnTable table = MakeColumns(bench_, *result_.nominal, result_.uses, {});
    if (!table.valid) return false;
    RefitSets(*result_.nominal, table, counts);
    return Leaders().front() != leader;
  }

  // Members are taken out and others tried in their places, until neither changes the set. What is known of members
  // at the end is of the set that was chosen.
  void Settle() {
    TakeOut();
    Exchange(kPolicy.until_exchanged);
  }

  // Of the work, `share` may be spent when `what` begins.
  bool Late(double share, const char* what) {
    if (!bench_.Late(share)) return false;
    if (result_.cut.empty() || result_.cut.back() != what) result_.cut.emplace_back(what);
    return true;
  }

  // By limb, whether it can move by the effects.
  std::vector<char> LimbsOf(const std::vector<EffectUse>& uses) const {
    std::vector<char> limbs(bench_.coupling->limb_count(), static_cast<char>(false));
    for (const EffectUse& use : uses) {
      const auto of_use = bench_.LimbsOf(use);
      for (std::size_t l = 0; l < limbs.size(); ++l) limbs[l] = static_cast<char>(limbs[l] || of_use[l]);
    }
    return limbs;
  }

  // What effects gain that bring a cost down to another one, in the limbs that they move: the others stay as they are.
  double GainInLimbs(const Candidate& parent, const std::vector<EffectUse>& uses, double from, double to) const {
    const std::vector<char> limbs = LimbsOf(uses);
    double moved = 0, all = 0;
    for (std::size_t l = 0; l < limbs.size(); ++l) {
      all += parent.train_limbs[l].cost;
      if (limbs[l]) moved += parent.train_limbs[l].cost;
    }
    const double own = all > 0 ? from * moved / all : from;
    return from - to < own ? std::log(own / (own - (from - to))) : kDiagnosePolicy.evidence.most_gain;
  }

  std::vector<EffectUse> UsesOf(const ColumnTable& table, const TrialSet& set) const {
    return Collect(set.trials, [&](std::size_t trial) { return table.trials[trial].use; });
  }

  // Takes out the sets that cost as much with a simpler effect in a richer one's place: they come in by exchange.
  void GiveWay(const Candidate& parent, const ColumnTable& table, std::vector<TrialSet>* level) const {
    const auto is_simpler = [&](const TrialSet& a, const TrialSet& b) {
      const std::vector<EffectUse> of_a = UsesOf(table, a), of_b = UsesOf(table, b);
      const std::vector<EffectUse> only_a = Without(of_a, of_b), only_b = Without(of_b, of_a);
      return only_a.size() == 1 && only_b.size() == 1 && Contains(only_b.front(), only_a.front(), *bench_.rig) &&
             GainInLimbs(parent, only_b, a.cost, b.cost) < kPolicy.simpler;
    };
    const std::vector<TrialSet> all = *level;
    std::erase_if(*level, [&](const TrialSet& rich) {
      return std::any_of(all.begin(), all.end(), [&](const TrialSet& simple) { return is_simpler(simple, rich); });
    });
  }

  // Refits the best sets of each size on top of the parent, where arithmetic promises enough.
  void RefitSets(const Candidate& parent, const ColumnTable& table, const std::vector<std::size_t>& counts) {
    auto levels = BeamSearch(table, counts.size(), kPolicy.beam);
    for (auto& level : levels) GiveWay(parent, table, &level);
    double best = table.cost;
    std::vector<Candidate*> tasted;
    if (const TrialSet set = OneInEachLimb(parent, table, levels.front());
        !parent.effects.empty() && set.trials.size() > 1) {
      if (Candidate* candidate = RefitTrials(parent, table, set)) tasted.push_back(candidate);
    }
    for (std::size_t size = 0; size < levels.size(); ++size) {
      for (std::size_t i = 0; i < std::min(counts[size], levels[size].size()); ++i) {
        const TrialSet& set = levels[size][i];
        // More effects than the best smaller set must promise something. A single one need not: where an effect sets in
        // suddenly (a limit, a gap) its columns say little between their trial values.
        if ((size > 0 || !parent.effects.empty()) &&
            GainInLimbs(parent, UsesOf(table, set), best, set.cost) < kPolicy.promise)
          continue;
        if (Late(until_, "sets of effects")) return;
        if (Candidate* candidate = RefitTrials(parent, table, set)) tasted.push_back(candidate);
      }
      if (!levels[size].empty()) best = std::min(best, levels[size].front().cost);
    }
    GoOn(std::move(tasted), counts.size() > 2 ? kPolicy.go_on : 1);
  }

  // Of each limb the best single effect that moves it alone and promises enough: they do not touch, so that one fit
  // serves them all. `singles`: the cheapest first.
  TrialSet OneInEachLimb(const Candidate& parent, const ColumnTable& table,
                         const std::vector<TrialSet>& singles) const {
    TrialSet together{.trials = {}, .cost = table.cost};
    std::vector<char> taken(bench_.coupling->limb_count(), static_cast<char>(false));
    for (const TrialSet& set : singles) {
      const std::vector<char> limbs = LimbsOf(UsesOf(table, set));
      const auto limb = static_cast<std::size_t>(std::ranges::find(limbs, static_cast<char>(true)) - limbs.begin());
      if (std::ranges::count(limbs, static_cast<char>(true)) != 1 || taken[limb]) continue;
      taken[limb] = static_cast<char>(true);
      if (GainInLimbs(parent, UsesOf(table, set), table.cost, set.cost) < kPolicy.promise) continue;
      together.trials.push_back(set.trials.front());
      together.cost -= table.cost - set.cost;
    }
    return together;
  }

  // The cheapest of those that were begun.
  void GoOn(std::vector<Candidate*> tasted, std::size_t most) {
    std::stable_sort(tasted.begin(), tasted.end(),
                     [](const auto* a, const auto* b) { return Charged(*a) < Charged(*b); });
    if (tasted.size() > most) tasted.resize(most);
    for (Candidate* candidate : tasted) {
      if (Late(until_, "fits of sets")) return;
      if (!candidate->converged) result_.ledger.Continue(candidate, Effort::kTry);
    }
  }

  Candidate* RefitTrials(const Candidate& parent, const ColumnTable& table, const TrialSet& set) {
    const BoundedSolution solution = SolveSet(table, set.trials);
    EffectSet effects = parent.effects;
    std::map<std::string, double> values;
    for (const std::size_t t : set.trials) {
      const Trial& trial = table.trials[t];
      effects = With(effects, trial.use);
      SetValues(bench_, trial, solution, &values);
    }
    say_("refitting " + NameOfSet(effects));
    return result_.ledger.Refit(effects, parent, values, solution.values.head(table.gram.parameters), Effort::kTaste);
  }

  std::vector<Candidate*> Leaders() const {
    std::vector<Candidate*> all = result_.ledger.All();
    std::stable_sort(all.begin(), all.end(), [](const auto* a, const auto* b) { return Charged(*a) < Charged(*b); });
    if (all.size() > kPolicy.leaders) all.resize(kPolicy.leaders);
    return all;
  }

  bool AtNoise(const Candidate& candidate) const {
    return 2 * candidate.train_cost < static_cast<double>(candidate.problem->residuals());
  }

  // What gains much alone is tried beside the leader too, as large as it was alone: the leader's columns do not see
  // what begins to show only where both are large.
  void AddFromAlone(const Candidate& leader) {
    std::vector<Candidate*> alone = result_.ledger.All();
    std::erase_if(alone, [&](const Candidate* one) {
      if (one->effects.size() != 1 || Gain(*result_.base, *one) < kPolicy.promise) return true;
      const EffectUse& use = one->effects.front();
      const EffectSet both = With(leader.effects, use);
      return Has(leader.effects, use) || result_.ledger.Find(both) ||
             std::any_of(leader.effects.begin(), leader.effects.end(), [&](const EffectUse& member) {
               return Contains(use, member, *bench_.rig) || Contains(member, use, *bench_.rig) ||
                      AreOneMotion(use, member, *result_.base->model, result_.logged);
             });
    });
    std::stable_sort(alone.begin(), alone.end(),
                     [](const auto* a, const auto* b) { return a->train_cost < b->train_cost; });
    if (alone.size() > kPolicy.alone) alone.resize(kPolicy.alone);
    std::vector<Candidate*> tasted;
    for (const Candidate* one : alone) {
      if (Late(until_, "sets of effects")) return;
      const EffectSet both = With(leader.effects, one->effects.front());
      std::map<std::string, double> values;
      for (const auto& p : PlacedParameters(one->effects.front(), *bench_.rig, bench_.scales))
        values[p.name] = one->values[static_cast<std::size_t>(one->model->IndexOf(p.name))];
      say_("refitting " + NameOfSet(both));
      if (Candidate* candidate = result_.ledger.Refit(both, leader, values, {}, Effort::kTaste))
        tasted.push_back(candidate);
    }
    GoOn(std::move(tasted), 1);
  }

  // Additions to these, then to what leads, as long as it is another one.
  void Grow(std::vector<Candidate*> leaders) {
    for (std::size_t round = 0; round < kPolicy.most_effects; ++round) {
      bool again = false;
      for (Candidate* leader : leaders) {
        const std::size_t most = kPolicy.most_effects * bench_.coupling->limb_count();
        if (leader->effects.size() >= most || AtNoise(*leader) || grown_.contains(leader->effects)) continue;
        if (Late(until_, "additions")) return;
        grown_.insert(leader->effects);
        say_("what could be added to " + NameOfSet(leader->effects));
        ColumnTable table = MakeColumns(bench_, *leader, result_.uses, {}, &result_.columns);
        if (!table.valid) continue;
        RefitSets(*leader, table, {kPolicy.additions, 1});
        AddFromAlone(*leader);
        if (bench_.Late(until_)) grown_.erase(leader->effects);
        again = true;
      }
      if (!again) return;
      leaders = {Leaders().front()};
    }
  }

  // What is behind in a member's place may lead with what it lacks: the nearest one is fitted to its end and added to,
  // as the leader was.
  void GrowRivals() {
    if (AtNoise(*result_.chosen)) return;
    Candidate* nearest = nullptr;
    for (const Member& member : result_.members) {
      for (const Rival& rival : member.rivals) {
        const EffectSet set = With(Without(result_.chosen->effects, member.use), rival.use);
        Candidate* other = grown_.contains(set) ? nullptr : result_.ledger.Find(set);
        if (other && (!nearest || other->train_cost < nearest->train_cost)) nearest = other;
      }
    }
    if (!nearest || Late(until_, "additions")) return;
    say_("following " + NameOfSet(nearest->effects));
    result_.ledger.Continue(nearest, Effort::kFinish);
    Grow({nearest});
  }

  // Whether another set leads then.
  bool GrowFurther() {
    const Candidate* leader = Leaders().front();
    Grow({result_.chosen});
    if (Leaders().front() == leader) GrowRivals();
    return Leaders().front() != leader;
  }

  // The cheapest set, its members charged.
  void Lead() {
    Candidate* before = std::exchange(result_.chosen, Leaders().front());
    result_.ledger.Continue(result_.chosen, Effort::kFinish);
    if (result_.chosen != before) result_.ledger.LookAside(result_.chosen);
  }

  // The chosen set without a member, refitted from the leader's optimum, or an earlier fit that is better.
  Candidate* TakenOut(const EffectUse& use, Effort effort) {
    const EffectSet rest = Without(result_.chosen->effects, use);
    Candidate* without = result_.ledger.Find(rest);
    const bool known = without && without->converged;
    if (effort == Effort::kTaste) {
      say_("taking out " + use.Text());
      if (!known || looked_.insert({result_.chosen->effects, use}).second)
        without = result_.ledger.Refit(rest, *result_.chosen, {}, {}, effort);
    } else if (without && !known) {
      result_.ledger.Continue(without, effort, FarBehind(*result_.chosen));
    }
    return without ? without : result_.base;
  }

  // Each member's gain. Members that gain too little go: a fit that is not at its end has too high a cost, so what it
  // says of a small gain holds, and the others need not be finished before.
  void TakeOut() {
    for (bool again = true; again;) {
      again = false;
      for (const Effort effort : {Effort::kTaste, Effort::kTry}) {
        result_.members.clear();
        for (const EffectUse& use : result_.chosen->effects) {
          const Candidate* without = TakenOut(use, effort);
          result_.members.push_back(
              {.use = use, .without = without, .gain = GainAboveNoise(*without, *result_.chosen)});
        }
        const auto least =
            std::min_element(result_.members.begin(), result_.members.end(), [](const Member& a, const Member& b) {
              return std::pair(a.gain, a.without->train_cost) < std::pair(b.gain, b.without->train_cost);
            });
        if (least == result_.members.end() || least->gain >= kPolicy.member) continue;
        result_.chosen = result_.ledger.Find(Without(result_.chosen->effects, least->use));
        result_.ledger.Continue(result_.chosen, Effort::kFinish);
        again = true;
        break;
      }
    }
  }

  // What could stand in a member's place: its partners, and those whose columns hold most of it. Columns are of small
  // sizes at the base, which hides what partners are together with other parameters.
  std::vector<EffectUse> Shortlist(const Member& member) const {
    const Model& base = *result_.base->model;
    std::vector<EffectUse> shortlist;
    std::vector<std::pair<double, EffectUse>> ranked;
    for (const EffectUse& use : result_.uses) {
      if (Has(result_.chosen->effects, use)) continue;
      const bool one = AreOneMotion(use, member.use, base, result_.logged) || Contains(member.use, use, *bench_.rig) ||
                       Contains(use, member.use, *bench_.rig);
      const double held = one ? 1 : Imitated(result_.columns, member.use, use);
      if (held < kPolicy.imitates) continue;
      if (ArePartners(use, member.use, base)) {
        shortlist.push_back(use);
      } else {
        ranked.emplace_back(-held, use);
      }
    }
    std::ranges::stable_sort(ranked, {}, [](const auto& one) { return one.first; });
    if (ranked.size() > kPolicy.rivals) ranked.resize(kPolicy.rivals);
    for (const auto& [held, use] : ranked) shortlist.push_back(use);
    return shortlist;
  }

  Candidate* RefitRival(const Member& member, const EffectUse& use) {
    Candidate* other = RefitInPlace(bench_, result_, {member.use}, use, Effort::kTaste);
    if (other && !other->converged && Gain(*result_.chosen, *other) > -kPolicy.hopeless)
      result_.ledger.Continue(other, Effort::kTry, result_.chosen->train_cost * std::exp(kPolicy.tie));
    return other;
  }

  // An effect that another one holds exactly is no companion of it but what that one says itself. Such pairs are good
  // for a search's way, not for its end: the richer one takes the other's part over. Whether one did.
  bool MergeOne() {
    for (const EffectUse& simpler : result_.chosen->effects) {
      for (const EffectUse& richer : result_.chosen->effects) {
        if (richer == simpler || !Contains(richer, simpler, *bench_.rig, true)) continue;
        say_("taking " + simpler.Text() + " into " + richer.Text());
        Candidate* merged = RefitMerged(bench_, result_, simpler, richer);
        if (!merged || Gain(*merged, *result_.chosen) >= kPolicy.simpler) continue;
        result_.chosen = merged;
        return true;
      }
    }
    return false;
  }

  // `until`: share of the work.
  void Exchange(double until) {
    constexpr int kExchanges = 3;
    for (int round = 0; round < kExchanges && ExchangeOne(until); ++round) TakeOut();
  }

  // True: a rival took a member's place, and everything is asked again.
  bool ExchangeOne(double until) {
    for (Member& member : result_.members) {
      if (member.asked) continue;
      member.rivals.clear();
      // One that hardly gains is not told apart from nothing.
      if (member.gain < kPolicy.tie) continue;
      for (const EffectUse& use : Shortlist(member)) {
        // What is not asked for want of work is asked at last.
        if (std::isfinite(until) ? bench_.Late(until) : Late(until, "exchange")) return false;
        say_("trying " + use.Text() + " for " + member.use.Text());
        Candidate* other = RefitRival(member, use);
        if (!other) continue;
        const bool richer = Contains(use, member.use, *bench_.rig), simpler = Contains(member.use, use, *bench_.rig);
        double ahead = Gain(*result_.chosen, *other);
        if (ahead > 0.5 * kPolicy.exchange) {
          result_.ledger.Continue(other, Effort::kFinish);
          ahead = Gain(*result_.chosen, *other);
        }
        double needed = richer ? kPolicy.simpler : simpler ? -kPolicy.simpler : kPolicy.exchange;
        // Of two that cost as little the less likely one gives way.
        if (IsLessLikely(member.use, use, *result_.base->model)) needed = -kPolicy.tie;
        if (IsLessLikely(use, member.use, *result_.base->model)) needed = kPolicy.tie;
        if (ahead > needed) {
          result_.chosen = other;
          result_.ledger.Continue(other, Effort::kFinish);
          return true;
        }
        const bool same = Contains(use, member.use, *bench_.rig, true) || Contains(member.use, use, *bench_.rig, true);
        if (!same) member.rivals.push_back({.use = use, .behind = -ahead});
      }
      std::stable_sort(member.rivals.begin(), member.rivals.end(),
                       [](const Rival& a, const Rival& b) { return a.behind < b.behind; });
      member.asked = true;
    }
    return false;
  }

  const Workbench& bench_;
  const Say& say_;
  SearchResult& result_;
  double until_ = kInfinity;                          // of the work, until which sets are begun
  std::set<EffectSet> grown_ = {{}};                  // what was added to
  std::set<std::pair<EffectSet, EffectUse>> looked_;  // members taken out from a leader's optimum
};

}  // namespace

double Gain(const Candidate& without, const Candidate& with) {
  return LogCost(without.train_limbs) - LogCost(with.train_limbs);
}

double GainAboveNoise(const Candidate& without, const Candidate& with) {
  return LogCostAboveNoise(without.train_limbs) - LogCostAboveNoise(with.train_limbs);
}

double FarBehind(const Candidate& chosen) { return chosen.train_cost * std::exp(kPolicy.far_behind); }

void FindEffects(const Workbench& bench, const std::vector<Hint>& hints, const Say& say, SearchResult* result) {
  Searcher(bench, say, result).Find(hints);
}

}  // namespace gapscope
