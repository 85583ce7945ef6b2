// Fits of candidates from good starts: an unconverged rival looks exactly like a rejected one.
#ifndef GAPSCOPE_DIAGNOSE_REFIT_H_
#define GAPSCOPE_DIAGNOSE_REFIT_H_

#include <memory>

#include "src/diagnose/screen.h"

namespace gapscope {

// The last fits of a leader.
inline constexpr int kFinalIterations = 20;
inline constexpr double kFinalTolerance = 2e-4;

using Candidates = std::vector<std::unique_ptr<Candidate>>;

// What was found on top of one parent.
struct Layer {
  std::vector<Screened>
      screen;  // all effects, the most promising first; their candidates are spent where they were refitted
  std::vector<std::size_t> leaders;  // of the screen, in the order of refits
  std::size_t refitted = 0;          // of them
  Candidates children;               // refitted, the best first
};

// A few Jacobians of `child`, a parent's model and one effect more, from the screen's own steps: from each where a scan
// left several.
void TasteChild(const Workbench& bench, const Candidate& parent, const Trial& trial, Candidate* child);
// Goes on from there, and where that ends above the parent from hardly any effect. Given up where it stays far above
// `best_cost`.
void FinishChild(const Workbench& bench, const Candidate& parent, const EffectUse& use, const Trial& trial,
                 double best_cost, Candidate* child);
// Another start for a candidate: these values, with states from the logs.
void StartFromValues(const Workbench& bench, const std::vector<double>& values, Candidate* candidate);
// Rivals of the layer's first start anew where they best imitate it, and are scored.
void ImitateLeader(const Workbench& bench, Candidate& parent, Layer* layer);
// Other starts: on the other side of each parameter that was not screened (how an inertia splits), and at trial values
// of another order of size. Valleys of their own.
void VaryShape(const Workbench& bench, const Candidate& parent, Candidate* candidate);
// The fits that were given up because another was far ahead, of effects that explain much all the same: to their end
// and from other starts, the nearest first. For when there is time and nothing more to seek.
void FinishRivals(const Workbench& bench, const Candidate& parent, Layer* layer);
// What contains a simpler effect starts from where that ended. Coulomb friction: both directions alike, or a hump a
// little above the sliding level, below which a hump has no gradient and its fit would stay Coulomb's. A torque limit:
// a ceiling that sags.
void StartFromSimpler(const Workbench& bench, Layer* layer);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_REFIT_H_
