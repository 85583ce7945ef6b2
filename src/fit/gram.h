// Products of a fit's columns over parts of the logs: what sets of effects are compared with by arithmetic, without
// another replay.
//
// Columns are [y | extra | residual]: the Jacobian of y at a point, what an effect at a trial value adds to the
// residuals there, and the residuals. Each window's state is taken out of all of them by an orthogonal projection (its
// columns and its prior's rows), so that sums of parts are the normal equations with the states eliminated (Reduce;
// Golub and Pereyra, SIAM J. Numer. Anal. 10, 1973), for any weights of the parts. What is known of a state belongs
// to each part by the share that it has of the log's rows of the signal whose joint starts there.
#ifndef GAPSCOPE_FIT_GRAM_H_
#define GAPSCOPE_FIT_GRAM_H_

#include <atomic>
#include <functional>
#include <span>
#include <string>
#include <vector>

#include "src/fit/normal_equations.h"

namespace gapscope {

struct GramSystem {
  std::vector<std::string> columns;    // "arm.mass", "offset arm_rad log 0", "shift", the extra ones' names, "residual"
  Eigen::Index parameters = 0;         // y's part of them
  std::vector<Eigen::MatrixXd> parts;  // products of the columns over each part's rows
  std::size_t half_seconds = 0;        // of the logs that have residuals
  std::vector<char> failed;            // per extra column: cannot be simulated, and is zero
  bool valid = false;                  // false: the point cannot be simulated, or it was stopped
  Work work;
};

// An effect at a trial value, or a torque that no effect makes: residuals of `child`, at the parent's point carried
// over, less the parent's.
struct ExtraColumn {
  std::string name;
  FitProblem* child = nullptr;  // of the same logs and windows, without parameters of its own that matter
  // At these values of the child's model, under these torques. Columns in a row that have both in common are made in
  // one replay, and each keeps its own signals alone.
  std::vector<double> values;
  std::vector<ProbeTorque> probes = {};
  MovedSignals moved = {};  // by the experiment's signals: those that are its own; empty: all
  // Where that cannot be simulated together: its own part of it.
  std::vector<double> own_values = {};
  std::vector<ProbeTorque> own_probes = {};
};

// GramSystem::columns of a problem with these.
std::vector<std::string> ColumnNames(const FitProblem& problem, std::span<const ExtraColumn> extra);

// Parts of the logs, and to which of them a half second of a log belongs, or one of the experiment's signals there.
struct GramParts {
  std::size_t count = 1;
  std::function<std::size_t(std::size_t log, long half_second, std::size_t signal)> of = [](std::size_t, long,
                                                                                            std::size_t) { return 0; };
};
// `stop`: once it is set no other column is begun, and the system is not valid.
GramSystem MakeGram(FitProblem& parent, const FitPoint& point, std::span<const ExtraColumn> extra,
                    const DifferenceOptions& options, const GramParts& parts = {},
                    const std::atomic<bool>* stop = nullptr);

// The best of a set of columns by arithmetic.
struct BoundedSolution {
  Eigen::VectorXd values;  // one per column of the system but the residual; zero where it is not in the set
  double cost = 0;         // half the sum of squares left, with the prior's part
  std::vector<Eigen::Index> at_bound;
};

// Minimises 1/2 |residual + columns c|^2 + 1/2 sum weight (c + gone)^2 over the columns in `set`, low <= c <= high.
// `sum`: of Sum(). `prior`: weight and how far the point already is from its centre, per column; low and high likewise.
struct ColumnBounds {
  Eigen::VectorXd low, high, prior_weight, prior_gone;  // one per column but the residual
};
BoundedSolution SolveBounded(const Eigen::MatrixXd& sum, std::span<const Eigen::Index> set, const ColumnBounds& bounds);

// Bounds of y's steps and the prior at a point; extra columns run from 0 to `most_extra` times their trial value.
ColumnBounds BoundsAt(const FitProblem& parent, const FitPoint& point, const GramSystem& gram, double most_extra);

// Share of a column, as the states leave it, that the columns in `set` can imitate: 1 - (what is left of it) / (its own
// square); 1 where it is nothing.
double Absorbed(const Eigen::MatrixXd& sum, std::span<const Eigen::Index> set, const ColumnBounds& bounds,
                Eigen::Index column);

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_GRAM_H_
