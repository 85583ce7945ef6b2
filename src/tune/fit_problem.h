// The least-squares problem of a fit: residuals of replayed windows against the log, with the nuisances that every log
// brings.
//
//   cost(y, x) = 1/2 sum_windows [ sum_rows,signals rho(w (predicted - measured)) + |prior(x_w)|^2 ]
//
// y: the tuned parameters (in search coordinates), one zero offset per measured position and log, one command shift
// below a sample. x_w: the window's initial state, as corrections of what the log says (angle and speed of every
// measured joint). Windows are independent given y, so each x_w is eliminated from the normal equations by its own
// small Schur complement (Golub & Pereyra, "The differentiation of pseudo-inverses and nonlinear least squares problems
// whose variables separate", SIAM J. Numer. Anal. 10, 1973; Triggs et al., "Bundle adjustment", 2000, sec. 6).
// Derivatives are finite differences: every column is a replay of its window, and windows run in parallel.
#ifndef GAPSCOPE_TUNE_FIT_PROBLEM_H_
#define GAPSCOPE_TUNE_FIT_PROBLEM_H_

#include <Eigen/Dense>
#include <memory>
#include <string>
#include <vector>

#include "replay/replay.h"

namespace gapscope {

// Which windows of each log a problem takes: with kTrain and kHeldOut every third one, from the second on, is held out.
enum class Fold { kAll, kTrain, kHeldOut };

// What makes signals of different size comparable: 1 / standard deviation over the log, or 1 / root mean square
// (mujoco.sysid's choice).
enum class Normalization { kDeviation, kRootMeanSquare };

enum class Objective { kWindows, kFreeRun, kBoth };

struct FitOptions {
  std::vector<int> free;  // indices of tuned parameters
  Objective objective = Objective::kWindows;
  double window_s = 1.0;
  double lead_in_s = 0.05;  // start of a window that is not scored
  Fold fold = Fold::kAll;
  std::size_t max_windows = 0;  // 0: all; else evenly chosen ones
  double time_step_s = 0;       // 0: the model's
  bool fit_offsets = true;      // zero offsets of measured positions, per log
  bool fit_shift = true;        // command shift within +-1 sample, common to all logs
  bool fit_states = true;       // initial state of each window
  double shift_range_s = 0;     // the shift lies within +- this; 0: one sample
  double shift_s = 0;           // where no shift is fitted: this one
  std::vector<double>
      weights;  // per experiment signal: residual = weight * (predicted - measured); empty: 1 / standard deviation
  Normalization normalization = Normalization::kDeviation;
  double prior_share = 0;  // standard deviation of what is known of the base parameters beforehand, as a share of their
                           // range; 0: nothing
  double prior_offset_rad = 0;       // likewise of zero offsets, around zero; 0: nothing
  bool logarithmic_effects = false;  // torques and stiffnesses of effects as logarithms, those of zero excepted: a
                                     // factor common to all torques is then a straight line
  bool linear_terms = false;         // an effect's size and angle (or rest) as the two terms that act linearly
                                     // (Parameter::with): as size and angle they make curved valleys
  double huber = 0;  // residuals beyond this many robust standard deviations are weighted down; 0: plain squares
};

// A parameter in search coordinates: logarithmic where its lower bound is positive (or asked for:
// FitOptions::logarithmic_effects), else in units of `scale`.
struct Coordinate {
  int parameter = 0;
  bool logarithmic = false;
  double scale = 1, low = 0, high = 0;  // bounds in search coordinates; logarithmic: scale is the sign, +-1
  double ToSearch(double value) const;  // logarithmic: what is zero or of the other sign becomes a very small number
  double ToValue(double search) const;
};

class Journal;

// How far the log's own initial speed is trusted: position over this time. The slope of a parabola through 40 ms of a
// swing of 5 Hz is 4 % off, more than its standard error: kInitialFitHalfWidth_s here made fitted inertias 0.3 % wrong
// with intervals half as wide.
inline constexpr double kSpeedPrior_s = 0.25 * kInitialFitHalfWidth_s;

// One candidate solution.
struct FitPoint {
  Eigen::VectorXd y;                    // parameters, then offsets, then the shift
  std::vector<Eigen::VectorXd> states;  // per window
};

// Normal equations at a point with the window states eliminated.
struct Linearization {
  double cost = 0;
  Eigen::MatrixXd hessian;   // Gauss-Newton, of y
  Eigen::VectorXd gradient;  // of y, at the states' own optimum
  std::vector<Eigen::VectorXd>
      block_gradients;  // reduced, per half second of a log, all windows there together: for cluster-robust covariances
  std::vector<int> block_logs;              // log of each block; blocks of a log stand in the order of time
  std::vector<Eigen::MatrixXd> state_gain;  // dx_w = state_step - state_gain dy
  std::vector<Eigen::VectorXd> state_step;
  bool valid = false;  // false: the point cannot be simulated
};

// Residuals and Jacobian of a point: for normal equations (FitProblem::Reduce), or to test what one more column would
// explain (TestColumn).
struct Snapshot {
  std::vector<Eigen::VectorXd> residuals;  // per window, weighted; empty: left out (Thin)
  std::vector<Eigen::MatrixXd> jacobians;  // per window: y, then the window's states
  bool valid = false;                      // false: the point cannot be simulated
  Linearization linearization;             // of Capture
  double cost = 0;
};

// What a column would do to the cost, with all of y and the states free to answer it (score test; Rao, Proc. Cambridge
// Phil. Soc. 44, 1948).
struct ColumnTest {
  double drop = 0;      // of the cost, at the best scale in [0, 2]
  double scale = 0;     // that scale
  double absorbed = 1;  // share of the column that y and the states can imitate: near 1 it cannot be seen in these logs
  Eigen::VectorXd dy;   // how y answers at that scale
  bool valid = false;
};

class FitProblem {
 public:
  // All references must outlive the problem. `values`: fixed parameters, and where the free ones start.
  FitProblem(const Model& model, const std::vector<Recording>& recordings, FitOptions options,
             std::vector<double> values, ThreadPool& pool);
  ~FitProblem();

  const std::vector<Coordinate>& coordinates() const { return coordinates_; }
  std::size_t size() const { return low_.size(); }
  const Eigen::VectorXd& low() const { return low_; }
  const Eigen::VectorXd& high() const { return high_; }
  // Multiplies the weight of what is known beforehand (prior_share), as the variance of the residuals does that of the
  // data.
  void ScalePrior(double factor);
  // What is known beforehand of the base parameters lies around `values` (as the model's Nominal()) instead of around
  // the start.
  void CentrePrior(const std::vector<double>& values);
  const Eigen::VectorXd& anchor_weight() const { return anchor_weight_; }  // on the hessian's diagonal
  std::size_t windows() const;
  std::size_t residuals() const;  // scored rows x signals

  FitPoint Start() const;
  // The point with these parameters' values, its offsets, shift and states as they are.
  FitPoint At(const std::vector<double>& values, FitPoint point) const;
  // Parameter values at a point; offset of log l and signal s (0 where none is fitted).
  std::vector<double> Values(const FitPoint& point) const;
  double Offset(const FitPoint& point, std::size_t log, std::size_t signal) const;
  double Shift(const FitPoint& point) const;

  // Cost; infinity where a replay diverges. `log_costs` receives each log's part, `residuals` each window's weighted
  // ones, unless the cost is the journal's.
  double Cost(const FitPoint& point, std::vector<double>* log_costs = nullptr,
              std::vector<Eigen::VectorXd>* residuals = nullptr);
  // The same, unknown to the journal.
  double CostAndResiduals(const FitPoint& point, std::vector<Eigen::VectorXd>* residuals);
  // Gives each window of `point` the state of `other` (of the same y) where that costs less; `residuals` and `others`
  // are the residuals there. The cost.
  double TakeBetterStates(FitPoint& point, std::vector<Eigen::VectorXd>& residuals, const FitPoint& other,
                          std::vector<Eigen::VectorXd>& others) const;
  // What the journal did not keep; not counted as a replay.
  std::vector<Eigen::VectorXd> ResidualsAgain(const FitPoint& point);
  // `step`: finite difference in search coordinates. Columns of parameters, offsets and shift may be left out: the
  // gradient and hessian are zero then. kCentral: all, those of parameters by central differences where the bounds
  // allow: a pair of parameters that only acts as a ratio then has columns that are parallel to rounding, which
  // one-sided ones are not.
  enum class Columns { kAll, kStates, kCentral };
  Linearization Linearize(const FitPoint& point, double step, Columns columns = Columns::kAll);
  // Linearize in two steps. `base`: the point's residuals where they are known. Blocks of the gradient are made only
  // when asked for.
  Snapshot Differentiate(const FitPoint& point, double step, Columns columns, std::vector<Eigen::VectorXd> base = {});
  Linearization Reduce(const FitPoint& point, const Snapshot& snapshot, bool with_blocks);
  // Moves a snapshot of `from` to `to`, whose residuals are known, without a replay: Broyden's rank-one update of each
  // window's Jacobian (Broyden, Mathematics of Computation 19, 1965).
  void UpdateSecant(Snapshot& snapshot, const FitPoint& from, const FitPoint& to,
                    std::vector<Eigen::VectorXd> residuals);
  // What bends the way from `from` to `to` (a step of `at`): half the residuals' second derivative along it, answered
  // as Reduce answers residuals. `probe`: residuals at `from` + share (to - from).
  Linearization Bend(const Linearization& at, const Snapshot& snapshot, const FitPoint& from, const FitPoint& to,
                     double share, const std::vector<Eigen::VectorXd>& probe);
  // Moves y by dy and each window's state by its own best answer to that.
  FitPoint Move(const FitPoint& point, const Linearization& at, const Eigen::VectorXd& dy) const;

  // Snapshot of a point.
  Snapshot Capture(const FitPoint& point, double step);
  // The same with `count` evenly chosen windows only: a cheaper test. Plain squares only.
  Snapshot Thin(const Snapshot& snapshot, const FitPoint& point, std::size_t count);
  // The change of residuals from `base` (a snapshot of `parent` at `parent_point`, over the same windows) to this
  // problem at `point`, as a column.
  ColumnTest TestColumn(const FitPoint& point, const FitProblem& parent, const FitPoint& parent_point,
                        const Snapshot& base);
  // A parent's solution as a point of this problem, whose model has more parameters: they start from `values` (this
  // model's parameters).
  FitPoint FromParent(const FitProblem& parent, const FitPoint& parent_point, const std::vector<double>& values,
                      const Eigen::VectorXd& parent_dy) const;
  // Cost of each half second of each window, in the order of windows; states as they are. Empty where it cannot be
  // simulated.
  std::vector<double> BlockCosts(const FitPoint& point);

  // Predictions at a point on all rows of the problem's windows, offsets added: one entry per recording.
  std::vector<LogReplay> Predict(const FitPoint& point);

  std::size_t replays() const { return replays_; }          // passes over all windows
  std::size_t evaluations() const { return evaluations_; }  // calls of Cost and Linearize
  // Results of Cost and Linearize are recorded there, and taken from there as long as the same calls come in the same
  // order; an optimiser may record its own state there between calls that are not.
  void set_journal(Journal* journal) { journal_ = journal; }
  Journal* journal() const { return journal_; }
  void CountResumed(std::size_t evaluations, std::size_t replays) { evaluations_ += evaluations, replays_ += replays; }
  // Weighs the log's own initial states by its sensors' noise, in units of the residuals at a point: a model that
  // misses by far must not make up for it by starting where the mechanism was not.
  void WeighStates(const FitPoint& point);
  // Huber threshold in residual units; infinity: plain squares. Set from the residuals of the last Cost().
  void UpdateRobustScale(const FitPoint& point);

 private:
  double CostNow(const FitPoint& point, std::vector<double>* log_costs,
                 std::vector<Eigen::VectorXd>* residuals = nullptr);
  double AnchorCost(const FitPoint& point) const;
  struct FitWindow;
  struct Worker;
  struct Scaling;

  // Two coordinates that give two parameters together (FitOptions::linear_terms).
  struct Couple {
    Eigen::Index size, other;
    Parameter::With with;
  };
  void CoupleTerms();
  void SetCouple(const Couple& couple, double size, double other, std::vector<double>* values) const;
  // The values of coordinate i and of the one that it is coupled with, at y with `moved` in the place of y[i].
  void SetCoordinate(const Eigen::VectorXd& y, Eigen::Index i, double moved, std::vector<double>* values) const;
  Eigen::VectorXd ToSearch(const std::vector<double>& values) const;  // of the parameters

  void CountDifferences(Columns columns, bool base_known);
  bool DifferentiateWindow(Worker& worker, const FitWindow& window, const FitPoint& point,
                           const std::vector<double>& values, const Eigen::VectorXd& state, double step,
                           Columns columns, Eigen::VectorXd& residual, Eigen::MatrixXd& jacobian) const;
  void ApplyRobustWeights(Eigen::VectorXd& residual, Eigen::MatrixXd& jacobian) const;  // Huber's
  bool Simulate(Worker& worker, const FitWindow& window, const FitPoint& point, const std::vector<double>& values,
                const Eigen::VectorXd& state, double shift, std::vector<double>& predicted) const;
  void Residuals(const FitWindow& window, const FitPoint& point, const std::vector<double>& predicted,
                 Eigen::VectorXd& residual) const;
  double WindowCost(const Eigen::VectorXd& residual, const FitWindow& window, const Eigen::VectorXd& state) const;
  Worker& GetWorker(int index);

  const Model& model_;
  const std::vector<Recording>& recordings_;
  FitOptions options_;
  std::vector<double> values_;
  ThreadPool& pool_;
  std::vector<Coordinate> coordinates_;
  std::vector<Couple> couples_;
  Eigen::VectorXd low_, high_;
  std::vector<FitWindow> windows_;
  std::vector<std::vector<Scaling>> scaling_;  // per log, per signal
  std::vector<std::unique_ptr<Worker>> workers_;
  double huber_threshold_;
  Eigen::VectorXd prior_weight_;  // part of anchor_weight_
  Eigen::VectorXd anchor_,
      anchor_weight_;  // a pull to the start, weak enough to only hold directions that the logs leave open
  Journal* journal_ = nullptr;
  std::size_t replays_ = 0, evaluations_ = 0;
  double shift_scale_s_ = 0;  // one sample; 0: no shift is fitted
};

}  // namespace gapscope

#endif  // GAPSCOPE_TUNE_FIT_PROBLEM_H_
