// What one more column would explain of a fit's residuals, with all of y and the states free to answer it (score test;
// Rao, Proc. Cambridge Phil. Soc. 44, 1948). Plain squares only.
#ifndef GAPSCOPE_DIAGNOSE_SCORE_TEST_H_
#define GAPSCOPE_DIAGNOSE_SCORE_TEST_H_

#include "src/fit/normal_equations.h"

namespace gapscope {

// Derivatives and normal equations at a point.
struct Snapshot {
  Derivatives derivatives;  // windows that were left out (Thin) have no residuals
  Linearization linearization;
  bool valid = false;  // false: the point cannot be simulated
  double cost = 0;
};
Snapshot Capture(FitProblem& problem, const FitPoint& point, double step);
// The same with `count` evenly chosen windows only: a cheaper test.
Snapshot Thin(const FitProblem& problem, const Snapshot& snapshot, const FitPoint& point, std::size_t count);

struct ColumnTest {
  double drop = 0;      // of the cost, at the best scale in [0, 2]
  double scale = 0;     // that scale
  double absorbed = 1;  // share of the column that y and the states can imitate: near 1 it cannot be seen in these logs
  Eigen::VectorXd dy;   // how y answers at that scale
  bool valid = false;
};
// The change of residuals from `base` (a snapshot of `parent` at `parent_point`) to `child` at `point`, over the same
// windows, as a column.
ColumnTest TestColumn(FitProblem& child, const FitPoint& point, const FitProblem& parent, const FitPoint& parent_point,
                      const Snapshot& base);

// A parent's solution, moved by `dy` inside its bounds, as a point of a child (CarryOver).
FitPoint FromParent(const FitProblem& parent, const FitPoint& point, const FitProblem& child,
                    const std::vector<double>& values, const Eigen::VectorXd& dy);

// Cost of each half second of each window, in the order of windows; states as they are. Empty where it cannot be
// simulated.
std::vector<double> BlockCosts(FitProblem& problem, const FitPoint& point);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_SCORE_TEST_H_
