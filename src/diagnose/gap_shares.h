// What each effect takes of the gap: Shapley's value (1953) over all sets of up to three of them, each refitted.
#ifndef GAPSCOPE_DIAGNOSE_GAP_SHARES_H_
#define GAPSCOPE_DIAGNOSE_GAP_SHARES_H_

#include <random>
#include <vector>

#include "src/diagnose/diagnosis.h"
#include "src/diagnose/search.h"

namespace gapscope {

// Effects that are told together are one player. Of more than three players: the mean of adding one to nothing and of
// taking it out of the whole. Errors of sets are those on held-out logs; the interval holds 95 of 100 draws of their
// half seconds, the same draws for all sets.
class GapShares {
 public:
  // `groups`: of effects that are told together. All must outlive this.
  GapShares(const Workbench& bench, SearchResult& found, const Candidate& final,
            const std::vector<std::vector<EffectUse>>& groups);

  // Of an effect of the final set.
  ShareOfGap Of(const EffectUse& use);

 private:
  // Held-out errors: of the logs as they are, then of each draw. NaN: the set cannot be fitted.
  const std::vector<double>& Errors(const EffectSet& set);

  const Workbench& bench_;
  SearchResult& found_;
  const Candidate& final_;
  std::vector<EffectSet> players_;
  std::vector<std::vector<double>> draws_;  // how often each half second is in it
  std::map<EffectSet, std::vector<double>> errors_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_GAP_SHARES_H_
