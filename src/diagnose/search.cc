#include "src/diagnose/search.h"

#include <algorithm>
#include <cmath>
#include <limits>

#include "src/diagnose/rules.h"

namespace gapscope {

namespace {

constexpr std::size_t kRefits = 5, kRefitsAtFloor = 2, kSecondRefits = 4,
                      kExchangeRefits =
                          2;  // leaders of the screen that are refitted, beside the partners of the first two
constexpr double kFirstShare = 0.5,
                 kSecondShare = 0.8;  // of the time left, for the refits of a first and of a second effect
constexpr double
    kFarOff = 20,
    kFound = 0.4;  // floors of the base model, and share of the excess removed, below which shorter windows are tried

// Far from the logs, 1 s is long enough for a prediction to lose the motion altogether, and no step leads back. What
// windows of a third of it find is where the fits over whole windows start from.
Status StartFromShortWindows(const Workbench& bench, const Say& say, SearchResult* result) {
  constexpr double kShorter = 0.3, kShare = 0.6;
  constexpr std::size_t kMost = 2;
  say("searching in shorter windows");
  Workbench near = Hurried(bench, kShare);
  near.window_s = kShorter * bench.window_s;
  GS_ASSIGN(Candidate base, MakeCandidate(near, {}));
  FitCandidate(near, &base, base.problem->Start(), kFinalIterations, kFinalTolerance);
  ScoreCandidate(near, &base);
  Layer found;
  Explore(near, base, base, kRefits, kShare, say, &found, nullptr);
  auto& children = result->first.children;
  for (std::size_t i = 0; i < std::min(kMost, found.children.size()) && !bench.Late(); ++i) {
    const Candidate& start = *found.children[i];
    auto child =
        std::find_if(children.begin(), children.end(), [&](const auto& c) { return c->effects == start.effects; });
    if (child == children.end()) {
      GS_ASSIGN(Candidate made, MakeCandidate(bench, start.effects));
      made.point = made.problem->Start();
      made.train_cost = made.problem->Evaluate(made.point, Keep::kCost).cost;
      child = children.insert(children.end(), std::make_unique<Candidate>(std::move(made)));
    }
    StartFromValues(bench, start.values, child->get());
    FitCandidate(bench, child->get(), (*child)->point, kFinalIterations, kFinalTolerance);
    ScoreCandidate(bench, child->get());
  }
  SortByMisfit(*result->base, &children);
  return Ok();
}

// A second effect worth naming: more than chance, more than a share of what the first left, and more than the first
// one's own shape, which is never quite the real one: what is small and unlike effects explain equally well is that.
bool IsSecond(const SearchResult& found, const Candidate& single, const Candidate& pair) {
  const Evidence more = Compare(single, pair);
  if (!Convincing(more, kSecond) || more.train < kSecondTrain) return false;
  const bool shape = IsShape(pair.effects.back(), single.effects.back(), *single.model);
  const double removed = RemovedExcess(single.held_out_floors, pair.held_out_floors),
               typically = RemovedExcess(TypicalFloors(single), TypicalFloors(pair));
  if (std::max(removed, typically) < kSecondExcess && (shape || !Convincing(more, kSureSecond))) return false;
  const double size =
      std::sqrt(std::max(0.0, std::pow(single.held_out_floors, 2) - std::pow(pair.held_out_floors, 2))) /
      found.base->held_out_floors;
  const bool told = std::none_of(found.second.children.begin(), found.second.children.end(), [&](const auto& rival) {
    return rival.get() != &pair && !rival->held_out_blocks.empty() && !Contains(*rival, pair) &&
           !Contains(pair, *rival) && !ArePartners(rival->effects.back(), pair.effects.back(), *single.model) &&
           AreRivals(pair, *rival);
  });
  return size > (shape ? kShapeOfGap : told ? kSecondOfGap : kUntoldOfGap);
}

// The other way round: what goes best with the pair's second effect? The first one was chosen while the second was
// missing, and may stand for another.
void Exchange(const Workbench& bench, const Candidate& base, Candidate* second, const Say& say, SearchResult* result) {
  say("looking for a better partner of " + second->Name());
  result->exchange = {};
  Layer& layer = result->exchange;
  Explore(bench, base, *second, kExchangeRefits, kSecondShare, say, &layer, nullptr);
  Candidate* other = Simplest(layer, *second, kSecond);
  if (!other || other->effects.back() == result->single->effects.front()) return;
  // A richer first effect did what the second one was missing for.
  if (Contains(*result->chosen, *other) ? Pays(*result->chosen, *other, *second)
                                        : LogMisfit(*other) > LogMisfit(*result->chosen))
    return;
  result->second_parent = result->single = second;
  result->chosen = other;
  result->second = std::move(layer);
  layer = {};
}

// A second effect on the single one, if there is one worth naming. True when that one alone does as well: it then is
// the single one, and a second is to be sought on it.
Result<bool> SeekSecond(const Workbench& bench, const Candidate& base, const Say& say, SearchResult* result) {
  say("looking for a second effect");
  const bool first_time = result->second_parent == nullptr;
  result->second = {};
  result->exchange = {};
  result->second_parent = result->single;
  Explore(bench, base, *result->single, kSecondRefits, kSecondShare, say, &result->second, &result->first.children);
  Candidate* pair = Simplest(result->second, *result->single, kSecond);
  if (!pair || !IsSecond(*result, *result->single, *pair)) return false;
  result->chosen = pair;
  if (bench.Late()) return false;
  // Backward: does the first one still matter?
  GS_ASSIGN(Candidate other, MakeCandidate(bench, {pair->effects[1]}));
  std::vector<double> values = other.model->Nominal();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (const int index = pair->model->IndexOf(other.model->parameters()[i].name); index >= 0)
      values[i] = pair->values[index];
  }
  FitCandidate(bench, &other, CarryOver(*pair->problem, pair->point, *other.problem, values), kFinalIterations,
               kFinalTolerance);
  ScoreCandidate(bench, &other);
  // In the place of an earlier fit of the same effect, if there is one.
  auto& singles = result->first.children;
  auto place = std::find_if(singles.begin(), singles.end(), [&](const auto& c) { return c->effects == other.effects; });
  if (place == singles.end()) place = singles.insert(singles.end(), nullptr);
  *place = std::make_unique<Candidate>(std::move(other));
  Candidate* alone = place->get();
  if (!Convincing(Compare(*alone, *pair), kSecond)) {
    result->single = result->chosen = alone;
    return first_time;
  }
  if (!bench.Late()) Exchange(bench, base, alone, say, result);
  return false;
}

// Second effects on the single one, and again where one of them took its place.
Status SeekSeconds(const Workbench& bench, const Candidate& base, const Say& say, SearchResult* result) {
  for (bool again = true; again && result->single->held_out_floors > kRemains && !bench.Late();) {
    GS_ASSIGN(again, SeekSecond(bench, base, say, result));
  }
  return Ok();
}

// The two effects that fit the training logs best, far better than the base model does; one of several that contain
// each other stands for all.
std::vector<EffectUse> BestFitted(const Layer& layer, const Candidate& base) {
  constexpr double kFarBetter = 0.7;
  constexpr std::size_t kMost = 2;
  std::vector<const Candidate*> order, best;
  for (const auto& child : layer.children) {
    if (child->train_cost < kFarBetter * base.train_cost && !child->held_out_blocks.empty())
      order.push_back(child.get());
  }
  std::stable_sort(order.begin(), order.end(),
                   [](const Candidate* a, const Candidate* b) { return a->train_cost < b->train_cost; });
  for (const Candidate* c : order) {
    if (best.size() < kMost && std::none_of(best.begin(), best.end(),
                                            [&](const Candidate* b) { return Contains(*c, *b) || Contains(*b, *c); }))
      best.push_back(c);
  }
  std::vector<EffectUse> uses;
  for (const Candidate* c : best) uses.push_back(c->effects.front());
  return uses;
}

// Where no effect is accepted alone two may be needed at once: each bends to do what the other one does, and fails
// where it was not fitted.
Status SeekTwoAtOnce(const Workbench& bench, Candidate& base, const Say& say, SearchResult* result) {
  for (const EffectUse& use : BestFitted(result->first, base)) {
    const auto& singles = result->first.children;
    const auto first =
        std::find_if(singles.begin(), singles.end(), [&](const auto& c) { return c->effects.front() == use; });
    result->single = first->get();
    GS_RETURN_IF_ERROR(SeekSeconds(bench, base, say, result));
    const Candidate& found = *result->chosen;
    if (Convincing(Compare(base, found), kFirst) &&
        RemovedExcess(base.held_out_floors, found.held_out_floors) > kTwoAtOnce)
      break;
    result->single = result->chosen = &base;
    result->second_parent = nullptr;
    result->second = {};
    result->exchange = {};
  }
  return Ok();
}

}  // namespace

Result<SearchResult> Search(const Workbench& bench, bool stop_if_uneven, const Say& say) {
  SearchResult result;
  result.one_signal = IsOneSignal(bench.data.train) && IsOneSignal(bench.data.held_out);
  const auto& measured = bench.data.train.front().measured;
  result.torque = std::any_of(measured.begin(), measured.end(),
                              [](const auto& m) { return TraitsOf(m.spec.kind).stage == SignalStage::kForces; });
  say("refitting the baseline");
  GS_ASSIGN(Candidate nominal, MakeCandidate(bench, {}));
  result.base = std::make_unique<Candidate>();
  GS_ASSIGN(*result.base, MakeCandidate(bench, {}));
  Candidate& base = *result.base;
  const FitPoint start = base.problem->Start();
  if (!std::isfinite(base.problem->Evaluate(start, Keep::kCost).cost)) {
    return Error{.what = "the base model cannot be simulated along these logs, even in windows",
                 .where = bench.rig->experiment().path,
                 .cure = "check units, signs and nominal parameters with `gapscope replay --mode windows`"};
  }
  nominal.point = start;
  nominal.values = nominal.model->Nominal();
  ScoreCandidate(bench, &nominal);
  result.nominal = std::make_unique<Candidate>(std::move(nominal));
  FitCandidate(bench, &base, start, kFinalIterations, kFinalTolerance);
  ScoreCandidate(bench, &base);
  result.single = result.chosen = &base;

  const double train_floors =
      std::sqrt(2 * base.train_cost / static_cast<double>(std::max<std::size_t>(1, base.problem->residuals())));
  constexpr double kUneven = 1.5;
  result.uneven = std::max(train_floors / base.held_out_floors, base.held_out_floors / train_floors) > kUneven;
  if (result.uneven && stop_if_uneven) return result;

  say("screening");
  // Where the base model is at the noise already, fewer refits show that nothing is missing.
  Explore(bench, base, base, base.held_out_floors > kRemains ? kRefits : kRefitsAtFloor, kFirstShare, say,
          &result.first, nullptr);
  const auto& children = result.first.children;
  if (base.held_out_floors > kFarOff &&
      (children.empty() || RemovedExcess(base.held_out_floors, children.front()->held_out_floors) < kFound)) {
    GS_RETURN_IF_ERROR(StartFromShortWindows(bench, say, &result));
  }
  Candidate* single = Simplest(result.first, base, FirstLimits(base));
  if (!single || single->held_out_floors <= kRemains) {
    // No second effect will be sought: the time is for rivals.
    Refit(bench, base, say, &result.first);
    FinishRivals(bench, base, &result.first);
    SortByMisfit(base, &result.first.children);
    single = Simplest(result.first, base, FirstLimits(base));
  }
  if (single && Convincing(Compare(base, *single), FirstLimits(base))) result.single = result.chosen = single;

  if (result.single == single) {
    GS_RETURN_IF_ERROR(SeekSeconds(bench, base, say, &result));
  } else if (base.held_out_floors > kUnknownFloors) {
    GS_RETURN_IF_ERROR(SeekTwoAtOnce(bench, base, say, &result));
  }
  // What the logs leave open goes to where the base model's nominal values pull it: undamped steps, as damping holds it
  // where the search left it.
  if (!bench.Late() && result.chosen != &base) {
    PolishCandidate(bench, result.chosen);
    ScoreCandidate(bench, result.chosen);
  }
  result.budget_spent = bench.Late();
  result.free_run_before = FreeRunError(bench, base);
  result.free_run_left = result.chosen == &base ? result.free_run_before : FreeRunError(bench, *result.chosen);
  return result;
}

}  // namespace gapscope
