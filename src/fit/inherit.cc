#include "src/fit/inherit.h"

#include <algorithm>

namespace gapscope {
namespace {

// Of each number of `to`'s y: its place in `from`'s; -1: it has none. Coordinates are the same parameter's in the same
// unit.
std::vector<Eigen::Index> SharedColumns(const FitProblem& from, const FitProblem& to) {
  std::vector<Eigen::Index> shared(static_cast<std::size_t>(to.layout().low.size()), -1);
  const auto &mine = to.space().coordinates(), &theirs = from.space().coordinates();
  for (std::size_t i = 0; i < mine.size(); ++i) {
    for (std::size_t k = 0; k < theirs.size(); ++k) {
      if (to.space().parameter(mine[i]).name == from.space().parameter(theirs[k]).name &&
          mine[i].logarithmic == theirs[k].logarithmic && mine[i].scale == theirs[k].scale)
        shared[i] = static_cast<Eigen::Index>(k);
    }
  }
  for (const auto& [at_from, at_to] : SharedNuisances(from.layout(), to.layout()))
    shared[static_cast<std::size_t>(at_to)] = at_from;
  return shared;
}

}  // namespace

Derivatives Inherit(const FitProblem& from, const Derivatives& known, FitProblem& to, const FitPoint& point,
                    double step) {
  const std::vector<Eigen::Index> shared = SharedColumns(from, to);
  const Eigen::Index n = to.layout().low.size(), theirs = from.layout().low.size();
  DifferenceOptions options{.step = step, .steps = StepKind::kQuick, .known = std::vector<char>(shared.size(), 0)};
  for (std::size_t i = 0; i < shared.size(); ++i) options.known[i] = static_cast<char>(shared[i] >= 0);
  // States that only one of the two has come last: motor sides.
  const Eigen::Index states = known.jacobians.empty() ? 0 : known.jacobians.front().cols() - theirs;
  options.known_states = states;
  Derivatives result = to.Differentiate(point, options);
  if (!result.valid || result.jacobians.size() != known.jacobians.size()) return result;
  for (std::size_t w = 0; w < result.jacobians.size(); ++w) {
    Eigen::MatrixXd& jacobian = result.jacobians[w];
    for (std::size_t i = 0; i < shared.size(); ++i) {
      if (shared[i] >= 0) jacobian.col(static_cast<Eigen::Index>(i)) = known.jacobians[w].col(shared[i]);
    }
    const Eigen::Index both = std::min(states, jacobian.cols() - n);
    jacobian.middleCols(n, both) = known.jacobians[w].middleCols(theirs, both);
  }
  return result;
}

}  // namespace gapscope
