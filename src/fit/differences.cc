// Derivatives of a fit's residuals by finite differences: one replay of its window per column.
#include <algorithm>
#include <cmath>

#include "src/fit/coupling.h"
#include "src/fit/fit_worker.h"
#include "src/fit/policy.h"

namespace gapscope {

using Columns = DifferenceOptions::Columns;

// The columns of one window.
class FitProblem::Differences {
 public:
  Differences(const FitProblem& problem, Worker& worker, std::size_t window, const FitPoint& point,
              const std::vector<double>& values, const DifferenceOptions& options, Derivatives& result)
      : problem_(problem),
        layout_(problem.layout_),
        worker_(worker),
        window_(problem.windows_[window]),
        point_(point),
        values_(values),
        state_(point.states[window]),
        options_(options),
        stamps_(problem.Stamps(point)),
        residual_(result.residuals[window]),
        base_(result.base()[window]),
        steps_(result.steps()),
        jacobian_(result.jacobians[window]) {}

  // False: the window cannot be simulated at the point.
  bool Make() {
    if (residual_.size() == 0) {
      if (!problem_.Simulate(worker_, {window_, point_, values_, state_, stamps_}, worker_.base)) return false;
      problem_.ResidualsOf(window_, point_, worker_.base, residual_);
    }
    const Eigen::Index n = layout_.low.size();
    jacobian_.setZero(residual_.size(), n + state_.size());
    const bool all = options_.columns != Columns::kStates;
    if (all) Parameters();
    if (all) Shift(layout_.command_shift, &StampShift::commands_s);
    if (all) Shift(layout_.force_shift, &StampShift::forces_s);
    States(n);
    if (all) Offsets(n);
    return true;
  }

 private:
  // The residuals elsewhere, in worker_.other; false: they cannot be had.
  bool Replay(const FitPoint& point, const std::vector<double>& values, const Eigen::VectorXd& state,
              StampShift stamps) {
    if (!problem_.Simulate(worker_, {window_, point, values, state, stamps, steps_}, worker_.perturbed)) return false;
    problem_.ResidualsOf(window_, point_, worker_.perturbed, worker_.other);
    return true;
  }
  bool Known(Eigen::Index column) const {
    return !options_.known.empty() && options_.known[static_cast<std::size_t>(column)];
  }
  void Difference(Eigen::Index column, double h) { jacobian_.col(column) = (worker_.other - base_) / h; }

  // A column's difference in the signals that it moves.
  void OwnDifference(Eigen::Index column, double h, const MovedSignals& moved) {
    Difference(column, h);
    KeepMoved(problem_.recordings_[window_.log], window_, moved, jacobian_.col(column));
  }

  // Column by column, or in groups but for central differences: `in_one` makes a group's columns and says whether it
  // could.
  template <typename Wanted, typename One, typename InOne>
  void InGroups(const Together& columns, Wanted wanted, One one, InOne in_one) {
    for (const auto& all : columns.groups) {
      std::vector<Eigen::Index> group;
      std::copy_if(all.begin(), all.end(), std::back_inserter(group), wanted);
      if (options_.columns != Columns::kCentral && group.size() > 1 && in_one(group)) continue;
      for (const Eigen::Index column : group) one(column);
    }
  }

  // Towards the inside, so that the step does not leave the bounds.
  double StepOf(Eigen::Index i) const {
    const Coordinate& c = problem_.space_.coordinates()[static_cast<std::size_t>(i)];
    return point_.y[i] + options_.step <= c.high ? options_.step : -options_.step;
  }
  void Set(Eigen::Index i, double h) { problem_.space_.SetCoordinate(point_.y, i, point_.y[i] + h, &worker_.values); }

  void Parameters() {
    worker_.values = values_;
    const Together& columns = problem_.parameters_together_;
    const auto in_one = [&](const std::vector<Eigen::Index>& group) {
      for (const Eigen::Index i : group) Set(i, StepOf(i));
      const bool good = Replay(point_, worker_.values, state_, stamps_);
      for (const Eigen::Index i : group) {
        if (good) OwnDifference(i, StepOf(i), columns.moved[static_cast<std::size_t>(i)]);
        Set(i, 0);
      }
      return good;
    };
    InGroups(columns, [&](Eigen::Index i) { return !Known(i); }, [&](Eigen::Index i) { Parameter(i); }, in_one);
  }

  void Parameter(Eigen::Index i) {
    const auto move = [&](double h) {
      Set(i, h);
      return Replay(point_, worker_.values, state_, stamps_);
    };
    const Coordinate& c = problem_.space_.coordinates()[static_cast<std::size_t>(i)];
    // The other way when that cannot be simulated.
    double h = StepOf(i);
    for (int attempt = 0; attempt < 2; ++attempt, h = -h) {
      if (!move(h)) continue;
      Difference(i, h);
      break;
    }
    const bool inside = point_.y[i] - h >= c.low && point_.y[i] - h <= c.high;
    if (options_.columns == Columns::kCentral && inside && move(-h))
      jacobian_.col(i) = 0.5 * (jacobian_.col(i) - (worker_.other - base_) / h);
    Set(i, 0);
  }

  void Shift(Eigen::Index column, double StampShift::* part) {
    if (column < 0 || Known(column)) return;
    StampShift moved = stamps_;
    moved.*part += kFitPolicy.shift_step * layout_.shift_scale_s;
    if (Replay(point_, values_, state_, moved)) Difference(column, kFitPolicy.shift_step);
  }

  void States(Eigen::Index first) {
    Eigen::VectorXd moved = state_;
    const Together& columns = problem_.states_together_[window_.log];
    const auto step = [&](Eigen::Index j) { return kFitPolicy.state_step / window_.prior[j]; };
    const auto in_one = [&](const std::vector<Eigen::Index>& group) {
      for (const Eigen::Index j : group) moved[j] += step(j);
      const bool good = Replay(point_, values_, moved, stamps_);
      for (const Eigen::Index j : group) {
        if (good) OwnDifference(first + j, step(j), columns.moved[static_cast<std::size_t>(j)]);
        moved[j] = state_[j];
      }
      return good;
    };
    const auto one = [&](Eigen::Index j) {
      moved[j] += step(j);
      if (Replay(point_, values_, moved, stamps_)) Difference(first + j, step(j));
      moved[j] = state_[j];
    };
    InGroups(columns, [&](Eigen::Index j) { return j >= options_.known_states; }, one, in_one);
  }

  // An offset moves its own prediction, and a start that the log gave the other way.
  void Offsets(Eigen::Index first_state) {
    const auto& signals = layout_.signals[window_.log];
    const Eigen::Index scored = window_.scored();
    for (std::size_t s = 0; s < signals.size(); ++s) {
      const SignalLayout& signal = signals[s];
      if (signal.offset < 0 || Known(signal.offset)) continue;
      auto column = jacobian_.col(signal.offset);
      if (problem_.options_.start == WindowStart::kRest || !signal.moves_start) {
        column.setZero();
      } else if (signal.joint_state >= 0) {
        column = -signal.deviation * jacobian_.col(first_state + signal.joint_state);
      } else {
        FitPoint other = point_;
        other.y[signal.offset] += kFitPolicy.offset_step;
        if (!Replay(other, values_, state_, stamps_)) continue;
        column = (worker_.other - base_) / kFitPolicy.offset_step;
      }
      const double* measured =
          problem_.recordings_[window_.log].measured[s].values.data() + window_.rows.begin + window_.first_scored;
      for (Eigen::Index r = 0; r < scored; ++r) {
        if (std::isfinite(measured[r]))
          column[static_cast<Eigen::Index>(s) * scored + r] += signal.weight * signal.deviation;
      }
    }
  }

  const FitProblem& problem_;
  const FitLayout& layout_;
  Worker& worker_;
  const FitWindow& window_;
  const FitPoint& point_;
  const std::vector<double>& values_;
  const Eigen::VectorXd& state_;
  const DifferenceOptions& options_;
  const StampShift stamps_;
  Eigen::VectorXd& residual_;
  const Eigen::VectorXd& base_;  // what differences are taken from
  const StepKind steps_;
  Eigen::MatrixXd& jacobian_;
};

Work FitProblem::WorkOf(const DifferenceOptions& options, bool base_known) const {
  Work work;
  if (!base_known) work = {.evaluations = 1, .replays = 1};
  const bool alone = options.columns == Columns::kCentral;
  const auto count = [&](const Together& columns, const auto& wanted, std::size_t each) {
    for (const auto& group : columns.groups) {
      const auto members = static_cast<std::size_t>(std::count_if(group.begin(), group.end(), wanted));
      work.replays += each * (alone ? members : std::min<std::size_t>(members, 1));
    }
  };
  const auto wanted = [&](Eigen::Index i) {
    return options.known.empty() || !options.known[static_cast<std::size_t>(i)];
  };
  if (options.columns != Columns::kStates) {
    count(parameters_together_, wanted, options.columns == Columns::kCentral ? 2 : 1);
    for (const Eigen::Index shift : {layout_.command_shift, layout_.force_shift})
      if (shift >= 0) work.replays += wanted(shift);
  }
  if (!windows_.empty())
    count(states_together_[windows_.front().log], [&](Eigen::Index j) { return j >= options.known_states; }, 1);
  return work;
}

Derivatives FitProblem::Differentiate(const FitPoint& point, const DifferenceOptions& options, Residuals base) {
  Derivatives result{.residuals = std::move(base), .work = {}};
  result.work = WorkOf(options, !result.residuals.empty());
  if (options.steps == StepKind::kQuick && options_.steps == StepKind::kOwn && model_.HasQuickSteps()) {
    Evaluation quick = Evaluate(point, Keep::kResiduals, options.mask, StepKind::kQuick);
    result.work += quick.work;
    if (std::isfinite(quick.cost)) result.quick = std::move(quick.residuals);
  }
  result.residuals.resize(windows_.size());
  result.jacobians.resize(windows_.size());
  std::vector<char> good(windows_.size(), 1);
  const std::vector<double> values = Values(point);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    if (!options.mask.empty() && !options.mask[w]) return;
    Differences differences(*this, GetWorker(index), w, point, values, options, result);
    good[w] = static_cast<char>(differences.Make());
  });
  result.valid = std::all_of(good.begin(), good.end(), [](char g) { return g != 0; });
  result.work.steps += TakeSteps();
  return result;
}

}  // namespace gapscope
