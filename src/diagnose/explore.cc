#include "src/diagnose/explore.h"

#include <algorithm>
#include <cmath>

#include "src/diagnose/rules.h"

namespace gapscope {
namespace {

constexpr double kNearly = 0.6;  // of the best one's gain

// Adds to `order` the visible partners of an effect, wherever they act.
void AddPartners(const Layer& layer, const EffectUse& use, const Model& model, std::vector<std::size_t>* order) {
  for (std::size_t i = 0; i < layer.screen.size(); ++i) {
    const bool known = std::find(order->begin(), order->end(), i) != order->end();
    if (!known && layer.screen[i].trial.visible && ArePartners(use, layer.screen[i].use, model)) order->push_back(i);
  }
}

// Indices into the screen: the leaders by the score test, then the partners of the first two wherever they act.
std::vector<std::size_t> Leaders(const Layer& layer, const Model& model, std::size_t refits) {
  std::vector<std::size_t> order;
  for (std::size_t i = 0; i < layer.screen.size() && order.size() < refits; ++i) {
    if (layer.screen[i].trial.visible) order.push_back(i);
  }
  for (std::size_t leader = 0, leaders = std::min<std::size_t>(2, order.size()); leader < leaders; ++leader)
    AddPartners(layer, layer.screen[order[leader]].use, model, &order);
  return order;
}

// What explained much alone beside the first effect is tried beside it too, from where it ended: where much is missing,
// a step of the score test says little.
void AddStrongSingles(const Candidate& base, const Candidates& singles, const Candidate& parent, Layer* layer) {
  constexpr Limits kStrong{.share = 0.3, .z = 3.0};
  constexpr std::size_t kMost = 2, kPlace = 2;
  // A partner of the first one mostly mends its shape: it is tried where more than a shape is missing.
  const bool much_left = parent.held_out_floors > kUnknownFloors;
  std::size_t added = 0;
  for (const auto& child : singles) {
    if (added == kMost || child->held_out_blocks.empty() || child->effects == parent.effects ||
        Contains(*child, parent) || Contains(parent, *child) ||
        (!much_left && ArePartners(child->effects.back(), parent.effects.back(), *parent.model)) ||
        !Convincing(Compare(base, *child), kStrong)) {
      continue;
    }
    const auto entry = std::find_if(layer->screen.begin(), layer->screen.end(), [&](const Screened& s) {
      return s.use == child->effects.back() && s.left_out.empty();
    });
    if (entry == layer->screen.end()) continue;
    ++added;
    Trial start{.drop = entry->trial.drop,
                .absorbed = entry->trial.absorbed,
                .trial = {},
                .values = entry->child.model->Nominal(),
                .dy = {},
                .visible = true,
                .valid = true,
                .others = {}};
    for (std::size_t i = 0; i < start.values.size(); ++i) {
      const std::string& name = entry->child.model->parameters()[i].name;
      if (name.starts_with(entry->use.Text() + ".")) start.values[i] = child->values[child->model->IndexOf(name)];
    }
    entry->trial.others.push_back(std::move(start));
    const auto index = static_cast<std::size_t>(entry - layer->screen.begin());
    if (std::find(layer->leaders.begin(), layer->leaders.end(), index) == layer->leaders.end()) {
      layer->leaders.insert(
          layer->leaders.begin() + static_cast<std::ptrdiff_t>(std::min(kPlace, layer->leaders.size())), index);
    }
  }
}

}  // namespace

bool AreRivals(const Candidate& a, const Candidate& b) {
  return std::max(a.held_out_floors, b.held_out_floors) < kAtNoise || !Convincing(Compare(b, a), kTold);
}

void SortByMisfit(const Candidate& parent, Candidates* children) {
  std::stable_sort(children->begin(), children->end(),
                   [](const auto& a, const auto& b) { return LogMisfit(*a) < LogMisfit(*b); });
  if (children->empty() || !children->front()->at_bound) return;
  const double most = Compare(parent, *children->front()).gain;
  const auto sound = std::find_if(children->begin(), children->end(), [&](const auto& c) {
    return !c->at_bound && Compare(parent, *c).gain > kNearly * most;
  });
  if (sound != children->end()) std::rotate(children->begin(), sound, sound + 1);
}

Workbench Hurried(const Workbench& bench, double share) {
  Workbench hurried = bench;
  if (bench.deadline) {
    const auto now = std::chrono::steady_clock::now();
    hurried.deadline =
        now + std::chrono::duration_cast<std::chrono::steady_clock::duration>(share * (*bench.deadline - now));
  }
  return hurried;
}

void Refit(const Workbench& bench, const Candidate& parent, const Say& say, Layer* layer) {
  struct Tasted {
    const Screened* entry;
    std::unique_ptr<Candidate> child;
  };
  std::vector<Tasted> tasted;
  for (; layer->refitted < layer->leaders.size() && !bench.Late(); ++layer->refitted) {
    Screened& entry = layer->screen[layer->leaders[layer->refitted]];
    say("trying " + entry.use.Text());
    tasted.push_back({&entry, std::make_unique<Candidate>(std::move(entry.child))});
    TasteChild(bench, parent, entry.trial, tasted.back().child.get());
  }
  std::stable_sort(tasted.begin(), tasted.end(),
                   [](const Tasted& a, const Tasted& b) { return a.child->train_cost < b.child->train_cost; });
  double best_cost = parent.train_cost;
  for (const auto& other : layer->children) best_cost = std::min(best_cost, other->train_cost);
  for (auto& [entry, child] : tasted) {
    if (!bench.Late()) {
      say("fitting " + entry->use.Text());
      FinishChild(bench, parent, entry->use, entry->trial, best_cost, child.get());
    }
    best_cost = std::min(best_cost, child->train_cost);
    ScoreCandidate(bench, child.get());
    layer->children.push_back(std::move(child));
  }
}

void Explore(const Workbench& bench, const Candidate& base, Candidate& parent, std::size_t refits, double share,
             const Say& say, Layer* layer, const Candidates* singles) {
  const Workbench hurried = Hurried(bench, share);
  std::vector<EffectUse> uses;
  for (const auto& use : AllUses(*bench.rig)) {
    if (IsFinding(use, *base.model)) uses.push_back(use);
  }
  layer->screen = Screen(bench, parent, uses);
  for (const auto& entry : layer->screen) {
    if (!entry.left_out.empty()) say("leaving out " + entry.use.Text() + ", which " + entry.left_out);
  }
  layer->leaders = Leaders(*layer, *parent.model, refits);
  if (singles) AddStrongSingles(base, *singles, parent, layer);
  Refit(hurried, parent, say, layer);
  if (layer->children.empty()) return;
  SortByMisfit(parent, &layer->children);
  // Who leads now need not be who led the screen.
  AddPartners(*layer, layer->children.front()->effects.back(), *parent.model, &layer->leaders);
  Refit(hurried, parent, say, layer);
  SortByMisfit(parent, &layer->children);
  ImitateLeader(hurried, parent, layer);
  StartFromSimpler(hurried, layer);
  SortByMisfit(parent, &layer->children);
  // The leaders once more to the end.
  for (std::size_t i = 0; i < std::min<std::size_t>(3, layer->children.size()) && !bench.Late(); ++i) {
    Candidate& leader = *layer->children[i];
    if (i == 0 && leader.held_out_floors > kRemains) VaryShape(hurried, parent, &leader);
    if (i > 0 && (leader.train_cost > 1.5 * layer->children.front()->train_cost || hurried.Late())) break;
    // Where much is missing the last digits tell nothing: a second effect moves them all.
    if (leader.converged && leader.held_out_floors > kUnknownFloors) continue;
    FitCandidate(bench, &leader, leader.point, kFinalIterations, kFinalTolerance);
    ScoreCandidate(bench, &leader);
  }
  SortByMisfit(parent, &layer->children);
}

double RemovedExcess(double floors_before, double floors_after) {
  constexpr double kLeastExcess = 0.1;
  return floors_before > 1 + kLeastExcess ? (floors_before - std::max(floors_after, 1.0)) / (floors_before - 1) : 0;
}

bool Pays(const Candidate& richer, const Candidate& simpler, const Candidate& parent) {
  const Evidence more = Compare(simpler, richer);
  if (more.held_out > kSureNested.share && more.z > kSureNested.z) return true;
  const bool much = more.gain > kNestedShare * Compare(parent, richer).gain ||
                    RemovedExcess(simpler.held_out_floors, richer.held_out_floors) > kNestedExcess;
  return much && Convincing(more, kNested);
}

Candidate* Simplest(const Layer& layer, const Candidate& parent, const Limits& limits) {
  if (layer.children.empty()) return nullptr;
  const auto sound = [&](const auto& child) { return Convincing(Compare(parent, *child), limits); };
  const auto first = std::find_if(layer.children.begin(), layer.children.end(), sound);
  if (first == layer.children.end()) return layer.children.front().get();
  Candidate* best = first->get();
  for (const auto& child : layer.children) {
    if (child.get() == best || child->held_out_blocks.empty() || !sound(child)) continue;
    const Evidence more = Compare(*child, *best);
    if (Contains(*best, *child)) {
      if (!Pays(*best, *child, parent)) best = child.get();
    } else if (child->parameters < best->parameters && !child->at_bound && more.z < kNested.z &&
               !Convincing(more, kNested) && Compare(parent, *child).gain > kNearly * Compare(parent, *best).gain) {
      best = child.get();
    } else if (IsLessLikely(*best, *child) && AreRivals(*best, *child)) {
      best = child.get();
    }
  }
  return best;
}

}  // namespace gapscope
