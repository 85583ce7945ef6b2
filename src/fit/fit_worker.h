// What one worker of a FitProblem owns.
#ifndef GAPSCOPE_FIT_FIT_WORKER_H_
#define GAPSCOPE_FIT_FIT_WORKER_H_

#include <vector>

#include "src/fit/fit_problem.h"

namespace gapscope {

struct FitProblem::Worker {
  Worker(const Model& model, double step)
      : simulator(model, step), way(static_cast<std::size_t>(model.compiled().nv), 0.0) {}
  Simulator simulator;
  InitialState start;
  std::vector<double> way;  // of each degree of freedom: by how much a window's state moves its start; zero elsewhere
  std::vector<double> values, base, perturbed;
  Eigen::VectorXd residual, other;
  std::size_t steps = 0;  // of the simulator, since they were last counted
};

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_FIT_WORKER_H_
