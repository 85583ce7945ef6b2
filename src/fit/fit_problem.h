// The least-squares problem of a fit: residuals of replayed windows against the log, with the nuisances that every log
// brings.
//
//   cost(y, x) = 1/2 sum_windows [ sum_rows,signals rho(w (predicted - measured)) + |prior(x_w)|^2 ] + prior(y)
//
// y and x: layout.h. Windows are independent given y. A problem knows replays, residuals and their derivatives, which
// are finite differences (every column is a replay of its window, windows run in parallel); no optimiser, no journal.
#ifndef GAPSCOPE_FIT_FIT_PROBLEM_H_
#define GAPSCOPE_FIT_FIT_PROBLEM_H_

#include <Eigen/Core>
#include <memory>
#include <vector>

#include "replay/replay.h"
#include "src/fit/prior.h"
#include "src/fit/robust.h"
#include "src/fit/windows.h"

namespace gapscope {

// One candidate solution.
struct FitPoint {
  Eigen::VectorXd y;                    // parameters, then offsets, then shifts
  std::vector<Eigen::VectorXd> states;  // per window
};

// Cost alone, or the residuals too.
enum class Keep { kCost, kResiduals };

struct Evaluation {
  double cost = 0;                // infinity where a replay diverges
  std::vector<double> log_costs;  // each log's part of it
  Residuals residuals;            // with Keep::kResiduals; of a window that diverged: empty
  Work work;
};

struct DifferenceOptions {
  double step = 0.01;  // in search coordinates
  // kStates: those of the windows' states alone, the rest zero. kCentral: all, those of parameters by central
  // differences where the bounds allow: a pair of parameters that only acts as a ratio then has columns that are
  // parallel to rounding, which one-sided ones are not.
  enum class Columns { kAll, kStates, kCentral } columns = Columns::kAll;
  // How the motions are made that differences are taken of. Costs and residuals are always those of the model's own
  // steps.
  StepKind steps = StepKind::kOwn;
  // Columns that are left zero: of y (empty: none), and the first ones of a window's state.
  std::vector<char> known = {};
  Eigen::Index known_states = 0;
  WindowMask mask = {};  // windows that are left out have no residuals and no Jacobian
};

// Residuals and Jacobian of a point.
struct Derivatives {
  Residuals residuals;
  std::vector<Eigen::MatrixXd> jacobians;  // per window: y, then the window's state
  Residuals quick;     // those that differences of quick steps are taken from; none where the model's own were needed
  bool valid = false;  // false: the point cannot be simulated
  Work work;
  // How the differences' motions were made, and the residuals that they are taken from.
  StepKind steps() const { return quick.empty() ? StepKind::kOwn : StepKind::kQuick; }
  const Residuals& base() const { return quick.empty() ? residuals : quick; }
};

class FitProblem {
 public:
  // All references must outlive the problem. `values`: fixed parameters, and where the free ones start.
  FitProblem(const Model& model, const std::vector<Recording>& recordings, FitOptions options,
             std::vector<double> values, ThreadPool& pool);
  ~FitProblem();

  const Model& model() const { return model_; }
  const std::vector<Recording>& recordings() const { return recordings_; }
  const FitOptions& options() const { return options_; }
  const SearchSpace& space() const { return space_; }
  const FitLayout& layout() const { return layout_; }
  const std::vector<FitWindow>& windows() const { return windows_; }
  const Prior& prior() const { return prior_; }
  const Huber& huber() const { return huber_; }
  ThreadPool& pool() const { return pool_; }
  std::size_t residuals() const { return residuals_; }  // scored rows x signals, those without a value left out

  FitPoint Start() const;
  // The point with these parameters' values, its offsets, shifts and states as they are.
  FitPoint At(const std::vector<double>& values, FitPoint point) const;
  std::vector<double> Values(const FitPoint& point) const { return space_.Values(point.y); }
  StampShift Stamps(const FitPoint& point) const;

  // What is known beforehand counts as against residuals of this variance, in units of the noise's: 2 cost / residuals
  // of a model that is left with much more than noise.
  void CountKnown(double variance) { prior_.SetScale(options_.prior_scale * variance); }
  // The cost of a point that needs no such variance: that of the data, D, and K (Prior::Surprise) where the variance
  // is unknown too, D exp(2 scale K / residuals). It has its least value where D + scale (2 D / residuals) K has it:
  // n/2 ln D + scale K is the negative logarithm of the likelihood at its best variance (Seber and Wild, Nonlinear
  // Regression, 1989, sec. 2.2).
  double CostOfAnyVariance(double cost, const Eigen::VectorXd& y) const;

  // `mask`: windows that are left out cost nothing and have no residuals.
  Evaluation Evaluate(const FitPoint& point, Keep keep, const WindowMask& mask = {}, StepKind steps = StepKind::kOwn);
  // `base`: the point's residuals where they are known.
  Derivatives Differentiate(const FitPoint& point, const DifferenceOptions& options, Residuals base = {});
  // What that takes, beside the steps.
  Work WorkOf(const DifferenceOptions& options, bool base_known) const;
  // Cost of one window with these residuals and this state.
  double WindowCost(std::size_t window, const Eigen::VectorXd& residual, const Eigen::VectorXd& state) const;
  // Predictions on the rows of the problem's windows, offsets added, without lead-ins: one entry per recording.
  std::vector<LogReplay> Predict(const FitPoint& point);

  // Where each window starts there, and what its signals' zero offsets are (measured = predicted + offset).
  struct FittedStart {
    InitialState state;
    std::vector<double> offsets;
  };
  std::vector<FittedStart> FittedStarts(const FitPoint& point);

  // In all replays from now on.
  void SetProbes(std::vector<ProbeTorque> probes) { probes_ = std::move(probes); }

  // By the residuals of a point whose states are solved: weighs the states by the sensors' noise (StatePriorsByNoise),
  // and sets Huber's threshold where the options ask for one.
  void WeighStates(const Residuals& residuals);
  void SetHuberThreshold(const Residuals& residuals);

 private:
  struct Worker;
  // Where a window is simulated: at a point, or beside it in its values, the window's state or the stamps.
  struct Place {
    const FitWindow& window;
    const FitPoint& point;
    const std::vector<double>& values;
    const Eigen::VectorXd& state;
    StampShift stamps;
    StepKind steps = StepKind::kOwn;
  };

  Worker& GetWorker(int index);
  // Simulator steps since they were last taken.
  std::size_t TakeSteps();
  // Writes where the window starts.
  void PlaceStart(Worker& worker, const Place& place) const;
  void RemountBodies(Worker& worker, const Place& place) const;
  void MoveUnseen(Worker& worker, const Place& place) const;
  bool Simulate(Worker& worker, const Place& place, std::vector<double>& predicted) const;
  void ResidualsOf(const FitWindow& window, const FitPoint& point, const std::vector<double>& predicted,
                   Eigen::VectorXd& residual) const;
  class Differences;  // the columns of one window
  // Columns that one-sided differences make together, and the signals that each moves.
  struct Together {
    std::vector<std::vector<Eigen::Index>> groups;
    std::vector<MovedSignals> moved;
    explicit Together(std::vector<MovedSignals> of_columns);
  };

  const Model& model_;
  const std::vector<Recording>& recordings_;
  FitOptions options_;
  ThreadPool& pool_;
  std::vector<Parameter> parameters_;  // the model's, with the bounds that the options ask for
  SearchSpace space_;
  FitLayout layout_;
  std::vector<FitWindow> windows_;
  std::size_t residuals_;
  Together parameters_together_;
  std::vector<Together> states_together_;  // per log
  Huber huber_;
  Prior prior_;
  std::vector<ProbeTorque> probes_;
  std::vector<std::unique_ptr<Worker>> workers_;
};

// A solution of `from` as a point of `to`, of the same logs: parameters by name (those that `from` lacks start from
// `values`, which are of `to`), offsets, shift, and states of the windows that both have.
FitPoint CarryOver(const FitProblem& from, const FitPoint& point, const FitProblem& to,
                   const std::vector<double>& values);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_FIT_PROBLEM_H_
