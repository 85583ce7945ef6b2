// How much of an effect shows in the logs, measured in sensor floors: the change of the angles between the plant that
// made the logs and another plant, in windows of about a second that start at the true motion.
//   raw    root mean square over samples and signals of (change / floor)
//   refit  the same after the best linearised move of the other plant's own parameters, a zero offset per signal, a
//          delay, and each window's initial state: what no retuning takes away
#ifndef GAPSCOPE_TESTS_TWIN_GAP_H_
#define GAPSCOPE_TESTS_TWIN_GAP_H_

#include <Eigen/Dense>
#include <array>
#include <functional>
#include <vector>

#include "tests/twin/plant.h"
#include "tests/twin/recorder.h"

namespace gapscope::twin {

// One thing a retuning may change: move(plant, step * x), x about N(0, (spread / step)^2).
template <class P>
struct DirectionOf {
  std::function<void(P*, double)> move;
  double step, spread;
};
using Direction = DirectionOf<Plant>;
// Deviations that a retuning allows itself: of an offset of each signal, of a delay; of a base parameter, relative.
inline constexpr double kOffsetSpread_rad = 0.02, kDelaySpread_s = 5e-4, kParameterSpread = 0.2;
// The free base parameters, relative moves with the contract's spread.
std::vector<Direction> BaseDirections(Rig rig);

struct GapOptions {
  double step_s = 2.5e-4;
  double window_s = 1.0;
  double sample_s = 0.008;
};

struct Gap {
  double raw = 0, refit = 0;
  std::vector<double> moves;  // best moves along the directions
  std::vector<double> logs;   // raw, of each record alone
  bool Finite() const;
};

// The records must hold snapshots (one window apart). `refit` false leaves `refit` and `moves` empty.
Gap MeasureGap(const std::vector<Record>& records, const Plant& other, const std::array<double, 2>& floor_rad,
               const std::vector<Direction>& directions, bool refit, const GapOptions& options);

// How far each of the others, and last the records themselves, are from `plant` in windows that start at the true
// motion: less what a retuning along the directions takes up, and less what the directions `beside` take up too. Linear
// about `plant`.
struct Trace {
  double refit = 0, beside = 0;
};
std::vector<Trace> MeasureTraces(const std::vector<Record>& records, const Plant& plant,
                                 const std::vector<Plant>& others, const std::array<double, 2>& floor_rad,
                                 const std::vector<Direction>& directions, const std::vector<Direction>& beside,
                                 const GapOptions& options);

// An orthonormal basis of the columns' span: what a window's own initial state explains.
Eigen::MatrixXd BasisOf(const Eigen::MatrixXd& columns);

// What columns that all windows share leave of changes, summed window by window. The first `beside` columns may be left
// out of a solution.
class Leftover {
 public:
  Leftover(Eigen::Index columns, Eigen::Index changes);
  // Sums over the windows stay as they are for the columns; the changes are of others from here on.
  void NewChanges(Eigen::Index changes);
  void AddColumns(const Eigen::MatrixXd& global) { normal_ += global.transpose() * global; }
  // `change`, one a column and in floors, loses its part in `basis`.
  void AddChanges(const Eigen::MatrixXd& global, const Eigen::MatrixXd& basis, double samples, Eigen::MatrixXd change);
  Eigen::MatrixXd* normal() { return &normal_; }
  // Root mean squares that are left of each change, by all but the first `beside` columns and by all.
  std::vector<Trace> Solve(Eigen::Index beside) const;

 private:
  double samples_ = 0;
  Eigen::VectorXd left_;
  Eigen::MatrixXd normal_, right_;
};

// Moves `rival` along the directions until its gap is least (damped Gauss-Newton); returns that gap.
Gap FitRival(const std::vector<Record>& records, const std::array<double, 2>& floor_rad,
             const std::vector<Direction>& directions, int iterations, const GapOptions& options, Plant* rival);

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_GAP_H_
