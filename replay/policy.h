// The numbers that a replay was given rather than found: what each decides, and why it is what it is.
#ifndef GAPSCOPE_REPLAY_POLICY_H_
#define GAPSCOPE_REPLAY_POLICY_H_

#include <cstddef>

namespace gapscope {

// The choice of a time step: the log's own sample time is halved until halving it once more changes little.
struct TimeStepPolicy {
  int halvings = 5;           // at most, below the model's own step: a 32nd
  double error_share = 0.01;  // change of the combined error, as a share of it, that is little
};

// How far back a window's past reaches, s, so that what has a memory starts with what went before.
struct PastPolicy {
  double delays_s = 0.2;          // where only delays remember
  double transmission_s = 0.5;    // the motor side of a gap or a spring finds its flank
  double unknown_states_s = 1.5;  // states whose time constant is nobody's parameter
  double time_constants = 5;      // of each known one: 0.7 % of a step is left
  double longest_s = 6;
  // A first command moves a mechanism at once that goes at least kRestShare of the way that the model would, when that
  // is so many times the samples' scatter and takes so many rows. Later than at_once_s that says nothing of a delay.
  double at_once_s = 0.02, at_once_scatters = 8;
  std::size_t at_once_rows = 3;
};

// What was commanded before a log that begins at rest: nothing, where the model accelerates less than this share under
// no command than under the first one.
inline constexpr double kRestShare = 0.5;

// |position| in rad or m, |speed| / 1000: beyond this a simulation has diverged.
inline constexpr double kRunaway = 1e6;

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_POLICY_H_
