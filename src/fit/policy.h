// The constants of a fit that no option sets: what they are, and why they have that size.
#ifndef GAPSCOPE_FIT_POLICY_H_
#define GAPSCOPE_FIT_POLICY_H_

#include "replay/simulator.h"

namespace gapscope {

struct FitPolicy {
  // A window's initial state as the log has it counts as much as this many samples at the window's start.
  double state_prior_samples = 5;
  // How long what was commanded before a log's first row may still act: longer than any delay of the catalogue. Windows
  // begin later, or a delay would be judged by a guess. Not so where the log begins at rest, nothing having acted: its
  // angles then change over the first `start_s` by at most this share of the most that they ever do in as long.
  double unknown_past_s = 0.08, start_s = 0.01, rest_share = 0.1;
  // How far the log's own initial speed is trusted: position over this time. The slope of a parabola through 40 ms of a
  // swing of 5 Hz is 4 % off, more than its standard error: kInitialFitHalfWidth_s here made fitted inertias 0.3 %
  // wrong with intervals half as wide.
  double speed_prior_s = 0.25 * kInitialFitHalfWidth_s;
  // How well the pre-roll knows where a transmission's motor side stands beside its load.
  double motor_side_prior_rad = 0.02;
  // How far a joint that no signal is of may stand from the model's initial pose, and how fast it may move there, as a
  // rate of that way. Wide beside what any sensor says of it.
  double unseen_prior_rad = 0.5, unseen_prior_m = 0.05, unseen_rad_per_s = 10;
  // Largest zero offset of a position sensor.
  double offset_bound_rad = 0.3;
  // The pull to the start, of the sum of squares, per residual and squared range of a coordinate: only holds what the
  // logs leave open.
  double anchor = 1e-8;
  // Of the way to where a window's state is said to be best: what is tried where all of it costs more than none.
  static constexpr double state_shares[] = {0, 0.5, 0.25};
  // An effect's size as a logarithm: zero is out of reach, at this share of where it starts.
  double least_size_share = 1e-3;
  // Finite differences of the command shift in samples, of a zero offset in standard deviations of its signal, of a
  // window's state as a share of what the log leaves open.
  double shift_step = 0.2, offset_step = 0.01, state_step = 0.02;
  // Where a fit is told what is known beforehand (FitOptions::prior_share, prior_offset_rad): base parameters lie
  // within about +-20 % of nominal, and their bounds at nominal / 1.6 and nominal * 1.6; sensors are zeroed by hand or
  // at start, and what a rest angle could explain as well is the rest angle's.
  double known_share = 0.15, known_offset_rad = 0.03;
  // What a change moves of a signal, as a share of all that it moves, from which on it moves that signal too.
  double touches = 0.05;
  // Length of a block of residuals that is judged as one: longer than sensors' noise and slow residuals remember.
  double block_s = 0.5;
};
inline constexpr FitPolicy kFitPolicy;

struct LmPolicy {
  double least_damping = 1e-9, small_damping = 1e-3, most_damping = 1e8;
  double first_rejection = 1e-3, grow = 8;          // damping after a step that was not taken
  double shrink = 0.1, secant_shrink = 0.3;         // after one that was
  double worthwhile = 0.1, worthwhile_coarse = 10;  // least promise of a more damped step, in tolerances
  int most_secant_steps = 8;
  double poor_ratio = 0.2;  // of the promised gain: a secant Jacobian that keeps less is spent
  double bend_share = 0.1;  // of the step, at which its bend is measured
  double kink = 0.01;       // of the cost: what a whole step still promises at a kink, and looking over it must gain
  double most_bend =
      0.75;  // |acceleration| / |velocity|: beyond it the second derivative says nothing of the whole step
};
inline constexpr LmPolicy kLmPolicy;

struct CovariancePolicy {
  double flat_share = 0.25;  // a direction whose deviation exceeds this share of the range is not known
  // Of a signal's deviation: with less misfit no model of a rig is left, whatever a linear step promises.
  double least_misfit = 1e-3;
  double correlated = 0.95;
  double bound_share = 1e-3;        // of the range: nearer is on the bound
  double least_eigenvalue = 1e-13;  // of the largest: below is rounding
};
inline constexpr CovariancePolicy kCovariancePolicy;

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_POLICY_H_
