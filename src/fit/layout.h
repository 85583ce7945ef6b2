// What a fit's unknowns consist of. y: the search coordinates of parameters, one zero offset per measured position and
// log, how far commands' and forces' stamps are off, below a sample. x of a window: what its initial state differs by
// from what the log says (angle and speed of each measured joint), from the model's initial pose at rest (of each joint
// that no signal is of), and from the pre-roll (of each hidden motor side).
#ifndef GAPSCOPE_FIT_LAYOUT_H_
#define GAPSCOPE_FIT_LAYOUT_H_

#include <Eigen/Core>
#include <utility>
#include <vector>

#include "src/experiment/recording.h"
#include "src/fit/options.h"
#include "src/fit/search_space.h"
#include "src/model/model.h"

namespace gapscope {

// How a signal of a log enters the cost.
struct SignalLayout {
  double weight = 0;        // of a residual: 1 / standard deviation of the signal, or as asked; 0: not scored
  double deviation = 1;     // of the signal over the log
  int offset = -1;          // index in y of its zero offset, which counts in deviations
  bool moves_start = true;  // the offset moves where windows start
  int joint_state = -1;     // index in the window's state of the joint's angle; its speed is the next one
};

// Degrees of freedom whose start no joint's own signal gives: two numbers of a window's state each, displacement and
// speed.
struct UnseenStates {
  struct Dof {
    int dof = 0;
    int signal = -1;  // of a free body's pose: that gives its start; -1: the model's initial pose does
  };
  Eigen::Index first = 0;  // index in the window's state
  std::vector<Dof> dofs;
};

struct FitLayout {
  std::vector<std::vector<SignalLayout>> signals;  // per log, per signal
  std::vector<UnseenStates> unseen;                // per log
  std::vector<Eigen::VectorXd> state_priors;       // per log: weight of each number of a window's state
  Eigen::VectorXd low, high;                       // of y
  Eigen::Index parameters = 0;                     // the first numbers of y
  double shift_scale_s = 0;                        // unit of both shifts: a sample, or as asked
  // Indices in y of StampShift's two; -1: not fitted.
  Eigen::Index command_shift = -1, force_shift = -1;

  // Zero offset of a signal at y, in its unit.
  double Offset(const Eigen::VectorXd& y, std::size_t log, std::size_t signal) const;
  // Largest weight that a deviation of any signal has, squared: what one residual counts for.
  double UnitCost() const;
};

// Offsets and shifts that two layouts of the same logs both have, in the same units: indices in `from`'s y and in
// `to`'s.
std::vector<std::pair<Eigen::Index, Eigen::Index>> SharedNuisances(const FitLayout& from, const FitLayout& to);

FitLayout MakeLayout(const Model& model, const std::vector<Recording>& recordings, const FitOptions& options,
                     const SearchSpace& space);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_LAYOUT_H_
