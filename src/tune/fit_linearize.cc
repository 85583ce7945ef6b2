// Derivatives of a fit: finite differences of every window, normal equations with the states eliminated, secant
// updates, the score test.
#include <algorithm>
#include <cmath>
#include <map>

#include "src/tune/fit_problem_parts.h"
#include "src/tune/journal.h"

namespace gapscope {
namespace {

// The solution of hessian x = right, with the fixed coordinates held at zero.
Eigen::VectorXd SolveFree(Eigen::MatrixXd hessian, Eigen::VectorXd right, const std::vector<char>& fixed) {
  for (Eigen::Index i = 0; i < right.size(); ++i) {
    if (!fixed[static_cast<std::size_t>(i)]) continue;
    hessian.row(i).setZero();
    hessian.col(i).setZero();
    hessian(i, i) = 1;
    right[i] = 0;
  }
  return hessian.ldlt().solve(right);
}

// What the window's own states answer to a slope of all columns (the last ones are the states'): S^-1 times their part,
// S with what is known of them beforehand.
Eigen::VectorXd StateAnswer(const Eigen::MatrixXd& jacobian, const Eigen::VectorXd& prior,
                            const Eigen::VectorXd& slope) {
  const Eigen::Index m = prior.size();
  Eigen::MatrixXd own = jacobian.rightCols(m).transpose() * jacobian.rightCols(m);
  own.diagonal() += prior.cwiseAbs2();
  return own.ldlt().solve(slope.tail(m));
}

}  // namespace

Linearization FitProblem::Linearize(const FitPoint& point, double step, Columns columns) {
  std::vector<double> record;
  if (journal_ && journal_->Next(point, &record)) {
    CountDifferences(columns, false);
    return Unpack(record);
  }
  const Snapshot snapshot = Differentiate(point, step, columns);
  Linearization result = Reduce(point, snapshot, columns == Columns::kCentral);
  if (journal_) journal_->Append(point, Pack(result));
  return result;
}

void FitProblem::CountDifferences(Columns columns, bool base_known) {
  if (!base_known) ++evaluations_;
  const std::size_t parameters =
      columns == Columns::kStates ? 0 : coordinates_.size() * (columns == Columns::kCentral ? 2 : 1);
  replays_ += (base_known ? 0 : 1) + parameters + (columns != Columns::kStates && shift_scale_s_ > 0 ? 1 : 0) +
              (windows_.empty() ? 0 : static_cast<std::size_t>(windows_.front().prior.size()));
}

Snapshot FitProblem::Differentiate(const FitPoint& point, double step, Columns columns,
                                   std::vector<Eigen::VectorXd> base) {
  CountDifferences(columns, !base.empty());
  Snapshot snapshot;
  snapshot.residuals = std::move(base);
  snapshot.residuals.resize(windows_.size());
  snapshot.jacobians.resize(windows_.size());
  std::vector<char> good(windows_.size(), 0);
  const std::vector<double> values = Values(point);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    good[w] = DifferentiateWindow(GetWorker(index), windows_[w], point, values, point.states[w], step, columns,
                                  snapshot.residuals[w], snapshot.jacobians[w]);
  });
  snapshot.valid = std::all_of(good.begin(), good.end(), [](char g) { return g != 0; });
  return snapshot;
}

bool FitProblem::DifferentiateWindow(Worker& worker, const FitWindow& window, const FitPoint& point,
                                     const std::vector<double>& values, const Eigen::VectorXd& state, double step,
                                     Columns columns, Eigen::VectorXd& residual, Eigen::MatrixXd& jacobian) const {
  const bool all = columns != Columns::kStates;
  const Eigen::Index n = low_.size(), parameters = all ? static_cast<Eigen::Index>(coordinates_.size()) : 0,
                     m = state.size();
  const double shift = Shift(point);
  if (residual.size() == 0) {
    if (!Simulate(worker, window, point, values, state, shift, worker.base)) return false;
    Residuals(window, point, worker.base, residual);
  }
  jacobian.setZero(residual.size(), n + m);
  const auto difference = [&](Eigen::Index column, double h, bool simulated) {
    if (!simulated) return false;
    Residuals(window, point, worker.perturbed, worker.other);
    jacobian.col(column) = (worker.other - residual) / h;
    return true;
  };
  worker.values = values;
  for (Eigen::Index i = 0; i < parameters; ++i) {
    const Coordinate& c = coordinates_[static_cast<std::size_t>(i)];
    // Towards the inside, so that the step does not leave the bounds; the other way when that cannot be simulated.
    double h = point.y[i] + step <= c.high ? step : -step;
    for (int attempt = 0; attempt < 2; ++attempt, h = -h) {
      SetCoordinate(point.y, i, point.y[i] + h, &worker.values);
      if (difference(i, h, Simulate(worker, window, point, worker.values, state, shift, worker.perturbed))) break;
    }
    if (columns == Columns::kCentral && point.y[i] - h >= c.low && point.y[i] - h <= c.high) {
      SetCoordinate(point.y, i, point.y[i] - h, &worker.values);
      if (Simulate(worker, window, point, worker.values, state, shift, worker.perturbed)) {
        Residuals(window, point, worker.perturbed, worker.other);
        jacobian.col(i) = 0.5 * (jacobian.col(i) - (worker.other - residual) / h);
      }
    }
    SetCoordinate(point.y, i, point.y[i], &worker.values);
  }
  if (all && shift_scale_s_ > 0) {
    constexpr double kShiftStep = 0.2;  // samples
    difference(n - 1, kShiftStep,
               Simulate(worker, window, point, values, state, shift + kShiftStep * shift_scale_s_, worker.perturbed));
  }
  Eigen::VectorXd moved = state;
  for (Eigen::Index j = 0; j < m; ++j) {
    const double h = 0.02 / window.prior[j];  // small beside what the log leaves open
    moved[j] += h;
    difference(n + j, h, Simulate(worker, window, point, values, moved, shift, worker.perturbed));
    moved[j] = state[j];
  }
  // An offset moves its own prediction, and the start the other way.
  const std::size_t signals = recordings_[window.log].measured.size();
  for (std::size_t s = 0; s < signals && all; ++s) {
    const Scaling& scaling = scaling_[window.log][s];
    if (scaling.offset < 0) continue;
    auto column = jacobian.col(scaling.offset);
    if (scaling.joint_state >= 0) {
      column = -scaling.deviation * jacobian.col(n + scaling.joint_state);
    } else {
      FitPoint other = point;
      constexpr double kOffsetStep = 0.01;
      other.y[scaling.offset] += kOffsetStep;
      if (!Simulate(worker, window, other, values, state, shift, worker.perturbed)) continue;
      Residuals(window, point, worker.perturbed, worker.other);
      column = (worker.other - residual) / kOffsetStep;
    }
    const auto scored = static_cast<Eigen::Index>(window.rows.rows() - window.first_scored);
    const double* measured =
        recordings_[window.log].measured[s].values.data() + window.rows.begin + window.first_scored;
    for (Eigen::Index r = 0; r < scored; ++r) {
      if (std::isfinite(measured[r]))
        column[static_cast<Eigen::Index>(s) * scored + r] += scaling.weight * scaling.deviation;
    }
  }
  return true;
}

Linearization FitProblem::Reduce(const FitPoint& point, const Snapshot& snapshot, bool with_blocks) {
  const Eigen::Index n = low_.size();
  struct Part {
    double cost = 0;
    Eigen::MatrixXd hessian, gain;
    Eigen::VectorXd gradient, state_step;
    std::vector<std::pair<long, Eigen::VectorXd>> blocks;  // by half second of the log
  };
  std::vector<Part> parts(windows_.size());
  Linearization result;
  result.hessian = Eigen::MatrixXd::Zero(n, n);
  result.gradient = Eigen::VectorXd::Zero(n);
  result.valid = snapshot.valid;
  if (!snapshot.valid) return result;
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    const Eigen::VectorXd& state = point.states[w];
    Part& part = parts[w];
    if (snapshot.residuals[w].size() == 0) {
      part = {.cost = 0,
              .hessian = Eigen::MatrixXd::Zero(n, n),
              .gain = Eigen::MatrixXd::Zero(state.size(), n),
              .gradient = Eigen::VectorXd::Zero(n),
              .state_step = Eigen::VectorXd::Zero(state.size()),
              .blocks = {}};
      return;
    }
    part.cost = WindowCost(snapshot.residuals[w], window, state);
    worker.residual = snapshot.residuals[w];
    worker.jacobian = snapshot.jacobians[w];
    ApplyRobustWeights(worker.residual, worker.jacobian);
    const Eigen::Index m = state.size();
    const Eigen::MatrixXd full = worker.jacobian.transpose() * worker.jacobian;
    const Eigen::VectorXd slope = worker.jacobian.transpose() * worker.residual;
    if (m > 0) {
      Eigen::MatrixXd own = full.bottomRightCorner(m, m);
      own.diagonal() += window.prior.cwiseAbs2();
      const Eigen::LDLT<Eigen::MatrixXd> solver(own);
      part.gain = solver.solve(full.bottomLeftCorner(m, n));
      part.state_step = -solver.solve(slope.tail(m) + window.prior.cwiseAbs2().cwiseProduct(state));
      part.hessian = full.topLeftCorner(n, n) - full.topRightCorner(n, m) * part.gain;
      part.gradient = slope.head(n) + full.topRightCorner(n, m) * part.state_step;
    } else {
      part.hessian = full;
      part.gradient = slope;
      part.gain.resize(0, n);
      part.state_step.resize(0);
    }
    if (!with_blocks) return;
    // The gradient once more in blocks of time, at the states' optimum: rows less what the states take.
    Eigen::MatrixXd reduced = worker.jacobian.leftCols(n);
    Eigen::VectorXd after = worker.residual;
    if (m > 0) {
      reduced -= worker.jacobian.rightCols(m) * part.gain;
      after += worker.jacobian.rightCols(m) * part.state_step;
    }
    const auto scored = static_cast<Eigen::Index>(window.rows.rows() - window.first_scored);
    const double* time = recordings_[window.log].time_s.data() + window.rows.begin + window.first_scored;
    for (Eigen::Index begin = 0; begin < scored;) {
      const auto number = static_cast<long>(time[begin] / kBlock_s);
      Eigen::Index end = begin + 1;
      while (end < scored && static_cast<long>(time[end] / kBlock_s) == number) ++end;
      Eigen::VectorXd block = Eigen::VectorXd::Zero(n);
      for (std::size_t s = 0; s < recordings_[window.log].measured.size(); ++s) {
        const Eigen::Index first = static_cast<Eigen::Index>(s) * scored + begin;
        block += reduced.middleRows(first, end - begin).transpose() * after.segment(first, end - begin);
      }
      part.blocks.emplace_back(number, std::move(block));
      begin = end;
    }
  });
  std::map<std::pair<std::size_t, long>, Eigen::VectorXd> blocks;
  for (std::size_t w = 0; w < parts.size(); ++w) {
    Part& part = parts[w];
    result.cost += part.cost;
    result.hessian += part.hessian;
    result.gradient += part.gradient;
    for (auto& [number, block] : part.blocks) {
      const auto [entry, added] = blocks.try_emplace({windows_[w].log, number}, block);
      if (!added) entry->second += block;
    }
    result.state_gain.push_back(std::move(part.gain));
    result.state_step.push_back(std::move(part.state_step));
  }
  for (auto& [key, block] : blocks) {
    result.block_logs.push_back(static_cast<int>(key.first));
    result.block_gradients.push_back(std::move(block));
  }
  result.cost += AnchorCost(point);
  result.gradient += anchor_weight_.cwiseProduct(point.y - anchor_);
  result.hessian.diagonal() += anchor_weight_;
  return result;
}

void FitProblem::ApplyRobustWeights(Eigen::VectorXd& residual, Eigen::MatrixXd& jacobian) const {
  if (std::isinf(huber_threshold_)) return;
  for (Eigen::Index i = 0; i < residual.size(); ++i) {
    if (const double a = std::abs(residual[i]); a > huber_threshold_) {
      const double weight = std::sqrt(huber_threshold_ / a);
      jacobian.row(i) *= weight;
      residual[i] *= weight;
    }
  }
}

void FitProblem::UpdateSecant(Snapshot& snapshot, const FitPoint& from, const FitPoint& to,
                              std::vector<Eigen::VectorXd> residuals) {
  const Eigen::VectorXd dy = to.y - from.y;
  pool_.ForEach(windows_.size(), [&](std::size_t w, int) {
    Eigen::MatrixXd& jacobian = snapshot.jacobians[w];
    Eigen::VectorXd moved(jacobian.cols());
    moved << dy, to.states[w] - from.states[w];
    // In the metric of the columns, so that coordinates of different units share the blame by their effect.
    Eigen::VectorXd weighted = moved.cwiseProduct(jacobian.colwise().squaredNorm().transpose());
    const double length = weighted.dot(moved);
    if (length > 0)
      jacobian += (residuals[w] - snapshot.residuals[w] - jacobian * moved) * (weighted / length).transpose();
    snapshot.residuals[w] = std::move(residuals[w]);
  });
}

Linearization FitProblem::Bend(const Linearization& at, const Snapshot& snapshot, const FitPoint& from,
                               const FitPoint& to, double share, const std::vector<Eigen::VectorXd>& probe) {
  const Eigen::Index n = low_.size();
  const Eigen::VectorXd dy = to.y - from.y;
  std::vector<Eigen::VectorXd> gradients(windows_.size());
  Linearization bend{.cost = at.cost,
                     .hessian = at.hessian,
                     .gradient = Eigen::VectorXd::Zero(n),
                     .block_gradients = {},
                     .block_logs = {},
                     .state_gain = at.state_gain,
                     .state_step = at.state_step,
                     .valid = true};
  pool_.ForEach(windows_.size(), [&](std::size_t w, int) {
    const Eigen::MatrixXd& jacobian = snapshot.jacobians[w];
    Eigen::VectorXd moved(jacobian.cols());
    moved << dy, to.states[w] - from.states[w];
    // r(x + s v) = r + s J v + s^2/2 r_vv; of r_vv, the half that a step takes.
    const Eigen::VectorXd half = ((probe[w] - snapshot.residuals[w]) / share - jacobian * moved) / share;
    const Eigen::VectorXd slope = jacobian.transpose() * half;
    gradients[w] = slope.head(n);
    if (const Eigen::Index m = jacobian.cols() - n; m > 0) {
      bend.state_step[w] = -StateAnswer(jacobian, windows_[w].prior, slope);
      gradients[w] -= at.state_gain[w].transpose() * slope.tail(m);
    }
  });
  for (const auto& gradient : gradients) bend.gradient += gradient;
  return bend;
}

Snapshot FitProblem::Capture(const FitPoint& point, double step) {
  Snapshot snapshot = Differentiate(point, step, Columns::kAll);
  snapshot.linearization = Reduce(point, snapshot, false);
  snapshot.cost = snapshot.linearization.cost;
  for (std::size_t w = 0; w < windows_.size() && snapshot.valid; ++w)
    ApplyRobustWeights(snapshot.residuals[w], snapshot.jacobians[w]);
  return snapshot;
}

Snapshot FitProblem::Thin(const Snapshot& snapshot, const FitPoint& point, std::size_t count) {
  GS_CHECK(std::isinf(huber_threshold_));
  if (!snapshot.valid || count >= windows_.size()) return snapshot;
  Snapshot thin;
  thin.residuals.resize(windows_.size());
  thin.jacobians.resize(windows_.size());
  for (std::size_t i = 0; i < count; ++i) {
    const std::size_t w = i * windows_.size() / count;
    thin.residuals[w] = snapshot.residuals[w];
    thin.jacobians[w] = snapshot.jacobians[w];
  }
  thin.valid = true;
  thin.linearization = Reduce(point, thin, false);
  thin.cost = thin.linearization.cost;
  return thin;
}

ColumnTest FitProblem::TestColumn(const FitPoint& point, const FitProblem& parent, const FitPoint& parent_point,
                                  const Snapshot& base) {
  GS_CHECK(parent.windows_.size() == windows_.size());
  const Eigen::Index n = base.linearization.gradient.size();
  struct Part {
    Eigen::VectorXd cross;  // reduced J' c
    double square = 0, slope = 0, raw = 0;
    bool valid = false;
  };
  std::vector<Part> parts(windows_.size());
  const std::vector<double> values = Values(point);
  const double shift = Shift(point);
  pool_.ForEach(windows_.size(), [&](std::size_t w, int index) {
    if (base.residuals[w].size() == 0) {
      parts[w] = {.cross = Eigen::VectorXd::Zero(n), .valid = true};
      return;
    }
    Worker& worker = GetWorker(index);
    const FitWindow& window = windows_[w];
    if (!Simulate(worker, window, point, values, point.states[w], shift, worker.base)) return;
    Residuals(window, point, worker.base, worker.residual);
    const Eigen::VectorXd column = worker.residual - base.residuals[w];
    const Eigen::MatrixXd& jacobian = base.jacobians[w];
    const Eigen::Index m = jacobian.cols() - n;
    Part& part = parts[w];
    const Eigen::VectorXd all = jacobian.transpose() * column;
    part.raw = part.square = column.squaredNorm();
    part.slope = column.dot(base.residuals[w]);
    part.cross = all.head(n);
    if (m > 0) {
      // The states' own answer: with gain = S^-1 Jx' Jy and step = -S^-1 Jx' r, S^-1 Jx' c needs S once more.
      const Eigen::VectorXd answer = StateAnswer(jacobian, parent.windows_[w].prior, all);
      part.square -= all.tail(m).dot(answer);
      part.slope += all.tail(m).dot(base.linearization.state_step[w]);
      part.cross -= base.linearization.state_gain[w].transpose() * all.tail(m);
    }
    part.valid = true;
  });
  ++replays_;
  ColumnTest test;
  Eigen::VectorXd cross = Eigen::VectorXd::Zero(n);
  double square = 0, slope = 0, raw = 0;
  for (const Part& part : parts) {
    if (!part.valid) return test;
    cross += part.cross;
    square += part.square;
    slope += part.slope;
    raw += part.raw;
  }
  test.valid = true;
  if (!(raw > 0)) return test;
  // A coordinate on its bound cannot go further: the nuisance shift of a command that is later than one sample. Those
  // that push outward already are held; one that the column would pull back inside is let go, one that it would push
  // out is held too.
  std::vector<int> bound(static_cast<std::size_t>(n), 0);  // 1: on its upper bound, -1: on its lower one
  std::vector<char> fixed(static_cast<std::size_t>(n), 0);
  const Eigen::VectorXd& gradient = base.linearization.gradient;
  for (Eigen::Index i = 0; i < n; ++i) {
    const double edge = 1e-6 * (parent.high_[i] - parent.low_[i]);
    const auto k = static_cast<std::size_t>(i);
    bound[k] = parent_point.y[i] >= parent.high_[i] - edge ? 1 : parent_point.y[i] <= parent.low_[i] + edge ? -1 : 0;
    fixed[k] = bound[k] != 0 && bound[k] * gradient[i] < 0;
  }
  constexpr int kRounds = 8;
  for (int round = 0; round < kRounds; ++round) {
    const Eigen::VectorXd answer = SolveFree(base.linearization.hessian, cross, fixed);
    const double left = square - cross.dot(answer), pull = slope - answer.dot(gradient);
    constexpr double kLeast = 1e-6;  // of the column: below it is rounding
    test.absorbed = std::clamp(1 - left / raw, 0.0, 1.0);
    const bool seen = left > kLeast * raw;
    test.scale = seen ? std::clamp(-pull / left, 0.0, 2.0) : 0;
    test.drop = -(test.scale * pull + 0.5 * test.scale * test.scale * left);
    test.dy = -(test.scale * answer);
    bool again = false;
    const Eigen::VectorXd slopes = gradient + test.scale * (cross - base.linearization.hessian * answer);
    for (Eigen::Index i = 0; i < n; ++i) {
      const auto k = static_cast<std::size_t>(i);
      const bool hold = fixed[k] ? bound[k] * slopes[i] <= 0 : bound[k] * test.dy[i] > 0;
      if (bound[k] != 0 && hold != (fixed[k] != 0)) fixed[k] = hold, again = true;
    }
    if (!again) break;
  }
  return test;
}

}  // namespace gapscope
