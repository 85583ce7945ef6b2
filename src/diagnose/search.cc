#include "src/diagnose/search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/diagnose/rules.h"

namespace gapscope {

bool AreRivals(const Candidate& a, const Candidate& b) { return !Convincing(Compare(b, a), kTold); }

namespace {

constexpr int kFirstIterations = 14, kFinalIterations = 20;
constexpr double kFirstTolerance = 2e-3, kFinalTolerance = 2e-4;
constexpr std::size_t kRefits = 5, kRefitsAtFloor = 2, kSecondRefits = 4;  // leaders of the screen that are refitted, beside the partners of the first two
constexpr double kFirstShare = 0.5, kSecondShare = 0.8;  // of the time left, for the refits of a first and of a second effect
constexpr double kNearly = 0.6;                        // of the best one's gain
constexpr double kWorthImitating = 0.8;                // a leader that leaves less than this share of its parent's cost

bool Late(const Workbench& bench) { return bench.deadline && std::chrono::steady_clock::now() >= *bench.deadline; }

// The best first. An effect with a parameter on its bound is stretched into something it is not: it comes after one that gains nearly as much.
void SortByMisfit(const Candidate& parent, Candidates* children) {
  std::stable_sort(children->begin(), children->end(), [](const auto& a, const auto& b) { return LogMisfit(*a) < LogMisfit(*b); });
  if (children->empty() || !children->front()->at_bound) return;
  const double most = Compare(parent, *children->front()).gain;
  const auto sound = std::find_if(children->begin(), children->end(), [&](const auto& c) { return !c->at_bound && Compare(parent, *c).gain > kNearly * most; });
  if (sound != children->end()) std::rotate(children->begin(), sound, sound + 1);
}

// A fit from a start of its own, kept if it ends below the candidate's.
void TryStart(const Workbench& bench, Candidate* candidate, const FitPoint& start, int iterations, double tolerance) {
  if (!std::isfinite(candidate->problem->Cost(start))) return;
  const FitPoint before = candidate->point;
  const double cost = candidate->train_cost;
  const bool converged = candidate->converged;
  FitCandidate(bench, candidate, start, iterations, tolerance);
  if (candidate->train_cost < cost) return;
  candidate->point = before;
  candidate->train_cost = cost;
  candidate->converged = converged;
  candidate->values = candidate->problem->Values(before);
  candidate->shift_s = candidate->problem->Shift(before);
}

// Indices into the screen: the leaders by the score test, then the partners of the first two wherever they act.
std::vector<std::size_t> Leaders(const Layer& layer, const Model& model, std::size_t refits) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < layer.screen.size() && order.size() < refits; ++i) {
    if (layer.screen[i].trial.visible) order.push_back(i);
  }
  for (std::size_t leader = 0, leaders = std::min<std::size_t>(2, order.size()); leader < leaders; ++leader) {
    for (std::size_t i = 0; i < layer.screen.size(); ++i) {
      const bool known = std::find(order.begin(), order.end(), i) != order.end();
      if (!known && layer.screen[i].trial.visible && ArePartners(layer.screen[order[leader]].use, layer.screen[i].use, model)) order.push_back(i);
    }
  }
  return order;
}

// From the screen's own step, and where that ends above the parent from hardly any effect.
void FitChild(const Workbench& bench, const Candidate& parent, const EffectUse& use, const Trial& trial, double rival_cost, Candidate* child) {
  FitPoint start = child->problem->FromParent(*parent.problem, parent.point, trial.values, trial.dy);
  if (!std::isfinite(child->problem->Cost(start))) start = child->problem->FromParent(*parent.problem, parent.point, trial.values, {});
  FitCandidate(bench, child, start, kFirstIterations, kFirstTolerance, rival_cost);
  if (child->train_cost <= parent.train_cost * 1.0005 || Late(bench)) return;
  const auto placed = child->model->EffectParameters(use, bench.scales);
  if (!placed.ok()) return;
  std::vector<double> neutral = trial.values;
  for (const auto& p : placed.value()) neutral[child->model->IndexOf(p.name)] = p.neutral + 0.02 * ((p.neutral == p.high ? p.low : p.high) - p.neutral);
  TryStart(bench, child, child->problem->FromParent(*parent.problem, parent.point, neutral, {}), kFirstIterations, kFirstTolerance);
}

// The bench with less time: what is left of the budget is for what comes later.
Workbench Hurried(const Workbench& bench, double share) {
  Workbench hurried = bench;
  if (bench.deadline) {
    const auto now = std::chrono::steady_clock::now();
    hurried.deadline = now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(share * (*bench.deadline - now));
  }
  return hurried;
}

// Rivals start anew where they best imitate the leader: an unconverged rival looks exactly like a rejected one.
void ImitateLeader(const Workbench& bench, Candidate& parent, Layer* layer) {
  constexpr std::size_t kMost = 3;
  Candidate& leader = *layer->children.front();
  if (!(leader.train_cost < kWorthImitating * parent.train_cost) || Late(bench)) return;
  const FitPoint at = parent.problem->FromParent(*leader.problem, leader.point, leader.model->Nominal(), {});
  const Snapshot snapshot = parent.problem->Capture(at, 0.01);
  if (!snapshot.valid) return;
  std::size_t tried = 0;
  for (std::size_t i = 1; i < layer->children.size() && tried < kMost && !Late(bench); ++i) {
    Candidate& rival = *layer->children[i];
    if (!ArePartners(leader.effects.back(), rival.effects.back(), *parent.model) || (rival.train_cost < 1.02 * leader.train_cost && !Contains(rival, leader))) continue;
    const Trial trial = TryEffect(bench, rival, rival.effects.back(), *parent.problem, at, snapshot);
    if (!trial.valid) continue;
    ++tried;
    FitPoint start = rival.problem->FromParent(*parent.problem, at, trial.values, trial.dy);
    if (!std::isfinite(rival.problem->Cost(start))) start = rival.problem->FromParent(*parent.problem, at, trial.values, {});
    TryStart(bench, &rival, start, kFirstIterations, kFirstTolerance);
    ScoreCandidate(bench, &rival);
  }
}

// What contains Coulomb friction starts from where that ended: both directions alike, or a hump a little above the sliding level, below which a hump has no
// gradient and its fit would stay Coulomb's.
void StartFromCoulomb(const Workbench& bench, Layer* layer) {
  constexpr double kSliding = 0.9, kHump = 1.5, kClearlyBetter = 0.9;
  for (const auto& simple : layer->children) {
    if (simple->effects.back().effect != "coulomb_friction" || simple->held_out_floors < kRemains) continue;
    const std::string on = simple->effects.back().on;
    const double level = simple->values[simple->model->IndexOf("coulomb_friction@" + on + ".friction_n_m")];
    for (const auto& rich : layer->children) {
      if (rich->effects.back().on != on || !Contains(*rich, *simple) || rich->train_cost < kClearlyBetter * simple->train_cost || Late(bench)) continue;
      const auto placed = rich->model->EffectParameters(rich->effects.back(), bench.scales);
      if (!placed.ok()) continue;
      const bool hump = rich->effects.back().effect == "stribeck_friction";
      std::vector<double> values = rich->model->Nominal();
      for (const auto& p : placed.value()) {
        values[rich->model->IndexOf(p.name)] = p.unit != "N m" ? p.start : !hump ? level : p.key == "breakaway_n_m" ? kHump * level : kSliding * level;
      }
      TryStart(bench, rich.get(), rich->problem->FromParent(*simple->problem, simple->point, values, {}), kFirstIterations, kFirstTolerance);
      ScoreCandidate(bench, rich.get());
    }
  }
}

// Refits the leaders that have not been, in their order, as far as the time goes.
void Refit(const Workbench& bench, const Candidate& parent, const Say& say, Layer* layer) {
  for (; layer->refitted < layer->leaders.size() && !Late(bench); ++layer->refitted) {
    Screened& entry = layer->screen[layer->leaders[layer->refitted]];
    say("fitting " + entry.use.Text());
    auto child = std::make_unique<Candidate>(std::move(entry.child));
    double best_cost = parent.train_cost;
    for (const auto& other : layer->children) best_cost = std::min(best_cost, other->train_cost);
    FitChild(bench, parent, entry.use, entry.trial, best_cost, child.get());
    ScoreCandidate(bench, child.get());
    layer->children.push_back(std::move(child));
  }
}

// `share` of the time that is left goes to finding the leader; its own last fit may take more.
void Explore(const Workbench& bench, const Model& base, Candidate& parent, std::size_t refits, double share, const Say& say, Layer* layer) {
  const Workbench hurried = Hurried(bench, share);
  const auto possible = parent.model->PossibleEffects();
  if (!possible.ok()) return;
  std::vector<EffectUse> uses;
  for (const auto& use : possible.value()) {
    if (IsFinding(use, base)) uses.push_back(use);
  }
  layer->screen = Screen(bench, parent, uses);
  layer->leaders = Leaders(*layer, *parent.model, refits);
  Refit(hurried, parent, say, layer);
  if (layer->children.empty()) return;
  SortByMisfit(parent, &layer->children);
  ImitateLeader(hurried, parent, layer);
  StartFromCoulomb(hurried, layer);
  SortByMisfit(parent, &layer->children);
  // The leaders once more to the end.
  for (std::size_t i = 0; i < std::min<std::size_t>(3, layer->children.size()) && !Late(bench); ++i) {
    Candidate& leader = *layer->children[i];
    if (i > 0 && (leader.train_cost > 1.5 * layer->children.front()->train_cost || Late(hurried))) break;
    FitCandidate(bench, &leader, leader.point, kFinalIterations, kFinalTolerance);
    ScoreCandidate(bench, &leader);
  }
  SortByMisfit(parent, &layer->children);
}

// Share of what stood above the noise that is gone; nothing where hardly anything stood.
double RemovedExcess(double floors_before, double floors_after) {
  constexpr double kLeastExcess = 0.1;
  return floors_before > 1 + kLeastExcess ? (floors_before - std::max(floors_after, 1.0)) / (floors_before - 1) : 0;
}

// The best child, or a simpler one when the richer is not convincingly better: one that it contains, or one with fewer parameters.
Candidate* Simplest(const Layer& layer, const Candidate& parent) {
  if (layer.children.empty()) return nullptr;
  Candidate* best = layer.children.front().get();
  for (const auto& child : layer.children) {
    if (child.get() == best || child->held_out_blocks.empty()) continue;
    const Evidence more = Compare(*child, *best);
    if (Contains(*best, *child)) {
      const bool much = more.gain > kNestedShare * Compare(parent, *best).gain;
      if (!much || !Convincing(more, kNested)) best = child.get();
    } else if (child->parameters < best->parameters && !child->at_bound && more.z < kNested.z && Compare(parent, *child).gain > kNearly * Compare(parent, *best).gain) {
      best = child.get();
    } else if (IsLessLikely(*best, *child) && AreRivals(*best, *child)) {
      best = child.get();
    }
  }
  return best;
}

}  // namespace

Result<SearchResult> Search(const Workbench& bench, bool stop_if_uneven, const Say& say) {
  SearchResult result;
  say("refitting the baseline");
  GS_ASSIGN(Candidate nominal, MakeCandidate(bench, {}));
  result.base = std::make_unique<Candidate>();
  GS_ASSIGN(*result.base, MakeCandidate(bench, {}));
  Candidate& base = *result.base;
  const FitPoint start = base.problem->Start();
  if (!std::isfinite(base.problem->Cost(start))) {
    return Error{.what = "the base model cannot be simulated along these logs, even in windows", .where = bench.experiment.path,
                 .cure = "check units, signs and nominal parameters with `gapscope replay --mode windows`"};
  }
  nominal.point = start;
  nominal.values = nominal.model->Nominal();
  ScoreCandidate(bench, &nominal);
  result.nominal = std::make_unique<Candidate>(std::move(nominal));
  FitCandidate(bench, &base, start, kFinalIterations, kFinalTolerance);
  ScoreCandidate(bench, &base);
  result.single = result.chosen = &base;

  const double train_floors = std::sqrt(2 * base.train_cost / static_cast<double>(std::max<std::size_t>(1, base.problem->residuals())));
  constexpr double kUneven = 1.5;
  result.uneven = std::max(train_floors / base.held_out_floors, base.held_out_floors / train_floors) > kUneven;
  if (result.uneven && stop_if_uneven) return result;

  say("screening");
  // Where the base model is at the noise already, fewer refits show that nothing is missing.
  Explore(bench, *base.model, base, base.held_out_floors > kRemains ? kRefits : kRefitsAtFloor, kFirstShare, say, &result.first);
  Candidate* single = Simplest(result.first, base);
  if (!single || single->held_out_floors <= kRemains) {
    // No second effect will be sought: the time is for rivals.
    Refit(bench, base, say, &result.first);
    SortByMisfit(base, &result.first.children);
    single = Simplest(result.first, base);
  }
  if (single && Convincing(Compare(base, *single), kFirst)) result.single = result.chosen = single;

  if (single && result.single == single && single->held_out_floors > kRemains && !Late(bench)) {
    say("looking for a second effect");
    result.second_parent = single;
    Explore(bench, *base.model, *single, kSecondRefits, kSecondShare, say, &result.second);
    if (const Candidate* pair = Simplest(result.second, *single)) {
      const Evidence more = Compare(*single, *pair);
      const double removed = RemovedExcess(single->held_out_floors, pair->held_out_floors), typically = RemovedExcess(TypicalFloors(*single), TypicalFloors(*pair));
      if (Convincing(more, kSecond) && std::max(removed, typically) > kSecondExcess) result.chosen = pair;
    }
    // Backward: does the first one still matter?
    if (result.chosen != single && !Late(bench)) {
      GS_ASSIGN(Candidate other, MakeCandidate(bench, {result.chosen->effects[1]}));
      std::vector<double> values = other.model->Nominal();
      for (std::size_t i = 0; i < values.size(); ++i) {
        if (const int index = result.chosen->model->IndexOf(other.model->parameters()[i].name); index >= 0) values[i] = result.chosen->values[index];
      }
      FitCandidate(bench, &other, other.problem->FromParent(*result.chosen->problem, result.chosen->point, values, {}), kFinalIterations, kFinalTolerance);
      ScoreCandidate(bench, &other);
      // In the place of an earlier fit of the same effect, if there is one.
      auto& singles = result.first.children;
      auto place = std::find_if(singles.begin(), singles.end(), [&](const auto& c) { return c->effects == other.effects; });
      if (place == singles.end()) place = singles.insert(singles.end(), nullptr);
      *place = std::make_unique<Candidate>(std::move(other));
      const Candidate* alone = place->get();
      if (!Convincing(Compare(*alone, *result.chosen), kSecond)) result.single = result.chosen = alone;
    }
  }
  // What the logs leave open goes to where the base model's nominal values pull it: undamped steps, as damping holds it where the search left it.
  if (!Late(bench) && result.chosen != &base) {
    auto* chosen = const_cast<Candidate*>(result.chosen);
    PolishCandidate(bench, chosen);
    ScoreCandidate(bench, chosen);
  }
  result.budget_spent = Late(bench);
  result.free_run_before = FreeRunError(bench, base);
  result.free_run_left = result.chosen == &base ? result.free_run_before : FreeRunError(bench, *result.chosen);
  return result;
}

}  // namespace gapscope
