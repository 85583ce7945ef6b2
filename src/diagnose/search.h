// The search for effects: refits the base model, screens all effects, refits the leaders, adds a second effect where
// one is not enough.
#ifndef GAPSCOPE_DIAGNOSE_SEARCH_H_
#define GAPSCOPE_DIAGNOSE_SEARCH_H_

#include "src/diagnose/explore.h"

namespace gapscope {

struct SearchResult {
  std::unique_ptr<Candidate> nominal, base;  // base: refitted
  Layer first, second;                       // on top of the base; on top of `single`
  Layer
      exchange;  // of a pair: on top of its second effect alone, where another one in the first one's place was sought
  Candidate* single = nullptr;                    // the accepted single effect, or the base
  Candidate* chosen = nullptr;                    // single, or a pair
  const Candidate* second_parent = nullptr;       // what `second` stands on; null where no second effect was sought
  double free_run_before = 0, free_run_left = 0;  // see FreeRunError: of the base, of the chosen one
  bool one_signal = false;                        // see IsOneSignal
  bool torque = false;                            // a drive's torque is measured: a constant load on a servo shows
  bool uneven =
      false;  // train and held-out logs show the gap very differently; then nothing else was searched unless asked to
  bool budget_spent = false;
};

// `stop_if_uneven`: ends after the base model's refit when the split is a poor one. Errors: the base model cannot be
// simulated along the logs.
Result<SearchResult> Search(const Workbench& bench, bool stop_if_uneven, const Say& say);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SEARCH_H_
