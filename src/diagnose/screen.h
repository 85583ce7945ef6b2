// The score test over all candidate effects: what would each one explain, before any refit (see
// score_test.h).
#ifndef GAPSCOPE_DIAGNOSE_SCREEN_H_
#define GAPSCOPE_DIAGNOSE_SCREEN_H_

#include "src/diagnose/candidate.h"
#include "src/diagnose/score_test.h"

namespace gapscope {

inline constexpr std::size_t kScan = 8;  // trial values that make a scan

// The most promising of an effect's trial values.
struct Trial {
  double drop = 0;             // share of the parent's cost that the best step promises
  double absorbed = 1;         // share of the column that the parent can imitate, at that trial
  std::vector<double> trial;   // the trial value of each of the effect's parameters
  std::vector<double> values;  // the child's parameters to start from
  Eigen::VectorXd dy;          // and how the parent's own coordinates answer
  bool visible = false;        // some trial value leaves a column that the parent cannot imitate
  bool valid = false;          // false: no trial value can be simulated
  std::vector<Trial>
      others;  // the next best at other values of a scanned parameter (the number of periods): valleys of their own
};

// Tries the values of `use`, the last effect of `child`, against `base`: a snapshot of `parent` at `point`. A scan
// tests all its values on few windows, the best of them on all.
Trial TryEffect(const Workbench& bench, Candidate& child, const EffectUse& use, FitProblem& parent,
                const FitPoint& point, const Snapshot& base);

struct Screened {
  EffectUse use;
  Trial trial;
  Candidate child;       // its model and problem, unfitted
  std::string left_out;  // why it was not tested; empty: it was
};

// Tests `uses` on top of `parent` at its optimum; the most promising first. Those that cannot be built or simulated
// come last and say why.
std::vector<Screened> Screen(const Workbench& bench, Candidate& parent, const std::vector<EffectUse>& uses);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SCREEN_H_
