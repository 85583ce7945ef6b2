// Every threshold of a diagnosis, in one place: written into its result.
#ifndef GAPSCOPE_DIAGNOSE_POLICY_H_
#define GAPSCOPE_DIAGNOSE_POLICY_H_

#include <cstddef>

namespace gapscope {

// Gains are ln(cost without / cost with), costs those of refitted sets.
struct SearchPolicy {
  std::size_t widenings = 2;  // of base parameters' bounds, before effects are judged
  // Error of the base model, refitted, above which it leaves the logs within a window: then a search in shorter ones
  // leads, halved down to so many seconds and samples, with so much of the work as the whole search may take.
  double lost = 0.5, least_window_s = 0.1, short_share = 0.3;
  std::size_t least_samples = 25;
  std::size_t beam = 8;                             // sets kept per size while arithmetic orders them
  std::size_t singles = 5, pairs = 3, triples = 1;  // of the base model, that are refitted
  std::size_t go_on = 2;                            // of the sets that were begun, how many are fitted on
  double hopeless = 0.4;                            // a rival behind by more after a few steps is given up
  double far_behind = 1;                            // a set without a member by more: its fit may end early
  std::size_t scan = 12, scanned = 6;               // an effect of more trials is tried on a leader at its best few
  std::size_t leaders = 2, additions = 3;           // sets that are added to, and effects tried on each
  std::size_t alone = 2;                            // effects that gain much alone, tried beside each
  std::size_t most_effects = 6;                     // of a limb
  double promise = 0.1;    // least gain by arithmetic for which a set of several effects is refitted
  double member = 0.03;    // least gain of each effect of the final set
  std::size_t rivals = 3;  // tried in each member's place
  double imitates = 0.3;   // least share of a member's column that a rival's columns hold, to be tried in its place
  double exchange = 0.02;  // least gain of a rival that takes a member's place
  double tie = 0.1, tie_share = 0.05;  // what costs more by less than this, or this share of the member's gain, ties
  double simpler = 0.05;               // a richer effect that gains less over one that it contains gives way to it
  std::size_t jacobians = 24;          // kept, of the last fits: what the next ones begin with
  // Where fewer windows than this could be fitted, the time step is one whose halving changes the error by up to so
  // much: a robot's error is known better from more of its motion than from a finer step.
  std::size_t least_windows = 8;
  double coarse_step = 0.03;
  double jacobian_numbers = 6e7;     // in all of them, half a gigabyte; the base model's and two more are kept anyway
  std::size_t least_replays = 1500;  // that must fit into a time that is asked for: else fewer windows are fitted
  std::size_t replays = 6000;        // of all training windows: what a diagnosis of normal effort may take
  // Shares of that until which sets are begun and added to, and until which effects are tried in each other's place.
  // The rest is for judging, shares and intervals, which are never cut.
  double until_grown = 0.35, until_exchanged = 0.8;
};

struct EvidencePolicy {
  std::size_t torques = 12;                     // random torques a joint: thirds of angle, speed, both
  std::size_t free_form = 30;                   // torques a joint of the yardstick
  double bound_deviations = 1.645;              // of an absent effect's size, above its best value: 95 of 100
  double ratio_share = 0.5;                     // of a size's deviation, below which its ratio is told beside it
  double least_data_s = 60;                     // below it little rests on much
  double angle_waves = 1.6, speed_waves = 1.1;  // deviations of their phase's slopes, a deviation of the motion
  // Their amplitude, a share of the joint's torque: about what is found on rigs. A larger torque ends dry friction's
  // rests, so that its column says little of a small one.
  double torque_share = 0.005;
  double per_block = 4;       // what half a second of residuals counts for
  double free_run_s = 20;     // free runs: of logs twice as long as this only parts this long
  std::size_t free_runs = 8;  // so many of them
  // By which intervals of sizes are wider than their covariance says: a set that is not quite right leaves more than
  // noise and torques. Fitted to banks (docs/results/diagnosis.md).
  double interval_factor = 1.6;
  // Of the windows that sizes are fitted to, for each fitted parameter: with fewer no covariance is left.
  double half_seconds = 2;
  // Training logs are left out in so many parts, the parameters fitted to the others from where they are.
  std::size_t folds = 5;
  int left_out_iterations = 3;
  double left_out_tolerance = 1e-3;
  std::size_t draws = 200;  // of held-out half seconds, for the intervals of shares
  double most_gain = 3;     // above it a gain says nothing more
  // For two to be told as one: most of their gain that shows when one of them is taken out, or least share of the
  // larger gain that the lesser one is. For two to be there both or neither: most of what one gains that it also gains
  // without the other.
  double alone = 0.5, alike = 0.5;
};

// P = 1 / (1 + exp(-x)): weights of a statement's numbers, fitted to a rough bank (docs/results/diagnosis.md).
struct ProbabilityPolicy {
  double constant = -3.51, gain = 0.88, discrepancy = 0.68, clear = 0.27, smooth = -1.84, dry = 0.86;
  double most_discrepancy = 6, most_clear = 2, least_clear = -3;  // beyond them they say nothing more
  double present = 0.5;                                           // least probability of an effect that is listed
};

struct VerdictPolicy {
  double much_missing = 2.5;  // residual over noise, from which on something is missing
  double retuned = 0.05;      // least share of the held-out cost that retuned parameters gain to be worth saying
};

// Of the next experiment.
struct NextPolicy {
  double absent = 0.2, sure = 0.8;              // probabilities between which a statement is open
  double of_one_log = 0.9;                      // share of what an effect gains, above which one log alone shows it
  double duration_s = 8, least_duration_s = 1;  // of the input
  std::size_t designs = 6;                      // questions that an input is looked for
  double answers = 0.5;   // least difference of P with the effect and without, for an input to be proposed
  double apart = 0.5;     // of what an effect gains, what random torques do not, where the logs do not say
  double beyond_tie = 2;  // what a foretold log must tell apart, over what ties: forecasts are rough
};

struct DiagnosePolicy {
  SearchPolicy search;
  EvidencePolicy evidence;
  ProbabilityPolicy probability;
  VerdictPolicy verdict;
  NextPolicy next;
};
inline constexpr DiagnosePolicy kDiagnosePolicy;

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_POLICY_H_
