// How far a predicted signal lies from the measured one, as the numbers under "signals" of `replay --json`.
#ifndef GAPSCOPE_COMPARE_SCORE_H_
#define GAPSCOPE_COMPARE_SCORE_H_

#include <cstddef>
#include <span>
#include <string>

namespace gapscope {

// Error e = measured - predicted, in the signal's SI unit. What cannot be computed is NaN, never zero.
struct SignalScore {
  std::string signal;
  double rmse = 0;          // sqrt(mean e^2)
  double mae = 0;           // mean |e|
  double nrmse = 0;         // rmse / max(standard deviation of measured, resolution); 1
  double max = 0;           // greatest |e|
  double lag_s = 0;         // shift that aligns best; positive: measured later than predicted
  double correlation = 0;   // Pearson's, at zero lag; -1..1
  std::size_t samples = 0;  // rows used
};

// Scores one signal of one log. All spans have the same size; time_s is finite and strictly increasing (a contract:
// broken, it throws).
//
// Rows: left out where `measured` is not finite or `predicted` is NaN (not simulated, or not to be scored); `samples`
// says how many are used. A prediction of infinity is not left out: it makes the errors infinite, and lag and
// correlation NaN.
//
// nrmse: the standard deviation is that of all finite `measured` rows of the log (divided by n), predicted there or
// not, so that two predictions of one log are always on the same scale. It is not taken below `resolution` (the
// sensor's step in the signal's unit): a signal that stands still is scored in steps of its sensor. For a constant
// signal and resolution 0 it is NaN.
//
// lag_s: measured(t) is compared with predicted(t - lag). Both are brought to a uniform step (the median one) by linear
// interpolation, points in gaps of more than three steps left out; the lag is the greatest Pearson coefficient over the
// pairs of points that overlap, for |lag| <= min(0.25 s, duration / 4), with a parabola through the peak and its
// neighbours. At the limit of the range it is the limit. NaN where there is
// nothing to align: fewer than 8 rows, a constant signal, or signals such as ramps that correlate equally at every lag
// (within 1e-9). correlation is NaN below three rows or for a constant signal.
SignalScore ScoreSignal(std::string signal, std::span<const double> time_s, std::span<const double> measured,
                        std::span<const double> predicted, double resolution = 0);

// The contract's error of one log: root mean square of nrmse over its signals. NaN without signals, or where any
// signal's nrmse is NaN: an error that leaves out a signal would be another number by the same name.
double CombinedError(std::span<const SignalScore> scores);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_SCORE_H_
