// Where an iterative solve is between two iterations: all that it takes to go on, as the journal keeps it.
#ifndef GAPSCOPE_FIT_CHECKPOINT_H_
#define GAPSCOPE_FIT_CHECKPOINT_H_

#include <vector>

#include "src/fit/optimizers.h"

namespace gapscope {

struct Checkpoint {
  FitPoint point;
  double cost = 0, damping = 0, difference = 0;  // difference: step of the finite differences
  int quiet = 0, iterations = 0;                 // quiet: iterations in a row that gained hardly anything
  bool done = false;
  Termination termination = Termination::kIterations;
  Work work;
};

std::vector<double> Pack(const Checkpoint& s);
// Into a checkpoint whose point has the sizes of the recorded one.
void Unpack(const std::vector<double>& record, Checkpoint* s);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_CHECKPOINT_H_
