// The effects that may stand on one parent: screened, the leaders refitted, the best of them chosen.
#ifndef GAPSCOPE_DIAGNOSE_EXPLORE_H_
#define GAPSCOPE_DIAGNOSE_EXPLORE_H_

#include <functional>
#include <string>

#include "src/diagnose/evidence.h"
#include "src/diagnose/refit.h"

namespace gapscope {

using Say = std::function<void(const std::string&)>;

// The bench with less time: what is left of the budget is for what comes later.
Workbench Hurried(const Workbench& bench, double share);

// Screens all effects on top of `parent`, refits `refits` leaders and their partners, and the best to the end. `share`
// of the time that is left goes to finding the leader; its own last fit may take more. `base`: the model without
// effects. `singles`: what effects did alone, for a second one; null: nothing.
void Explore(const Workbench& bench, const Candidate& base, Candidate& parent, std::size_t refits, double share,
             const Say& say, Layer* layer, const Candidates* singles);
// Refits the leaders that have not been, as far as the time goes: a taste of each in the screen's order, then the rest
// of each in the order of how those ended. However little the time, all of them were looked at.
void Refit(const Workbench& bench, const Candidate& parent, const Say& say, Layer* layer);
// The best first. An effect with a parameter on its bound is stretched into something it is not: it comes after one
// that gains nearly as much.
void SortByMisfit(const Candidate& parent, Candidates* children);
// Whether what `richer` can do beyond `simpler`, which it contains, is worth its parameters. `parent`: what both stand
// on.
bool Pays(const Candidate& richer, const Candidate& simpler, const Candidate& parent);
// The best child that is convincing over the parent, or a simpler one that is too when the richer is not convincingly
// better: one that it contains, or one with fewer parameters. Where none is convincing, the best of all.
Candidate* Simplest(const Layer& layer, const Candidate& parent, const Limits& limits);

// Two effects on the same parent that explain the logs equally well: `a` is not convincingly better than `b`.
bool AreRivals(const Candidate& a, const Candidate& b);
// Share of what stood above the noise that is gone; nothing where hardly anything stood.
double RemovedExcess(double floors_before, double floors_after);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_EXPLORE_H_
