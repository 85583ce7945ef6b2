// What the sources of FitProblem share.
#ifndef GAPSCOPE_TUNE_FIT_PROBLEM_PARTS_H_
#define GAPSCOPE_TUNE_FIT_PROBLEM_PARTS_H_

#include <vector>

#include "src/tune/fit_problem.h"

namespace gapscope {

inline constexpr double kBlock_s = 0.5;  // length of a block of residuals that is judged as one

// How a signal of a log enters the cost.
struct FitProblem::Scaling {
  double weight = 0;  // 1 / standard deviation of the signal; 0: not scored
  double deviation = 1;
  int offset = -1;       // index in y
  int joint_state = -1;  // index in the window's state of the joint's angle; its speed is the next one
};

struct FitProblem::FitWindow {
  std::size_t log = 0;
  Window rows;
  std::size_t first_scored = 0;  // row in the window
  double weight = 1;
  InitialState start;  // from the log, without offsets
  Eigen::VectorXd
      prior;  // weight of each state correction: angle and speed of each measured joint, then of each hidden motor side
};

struct FitProblem::Worker {
  Worker(const Model& model, double step) : simulator(model, step) {}
  Simulator simulator;
  InitialState start;
  std::vector<double> values, base, perturbed;
  Eigen::VectorXd residual, other;
  Eigen::MatrixXd jacobian;
};

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_FIT_PROBLEM_PARTS_H_
