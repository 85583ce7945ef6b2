// State space of a flexible joint, x = (th, th', a, a'), by convex least squares with the structure, signs and bounds
// of its coefficients as constraints, beside the unconstrained fit, both scored on data they did not see.
//
//   th'' =  A22 th' + A23 a + A24 a' + B2 u        A22 <= 0, A23, A24, B2 >= 0
//   a''  = -A22 th' + A43 a + A44 a' - B2 u        A43 <= -A23, A44 <= -A24  (the link's inertia is finite)
//
// and every coefficient within a share of its nominal value. The quadratic program is solved by NLopt's SLSQP (Kraft,
// 1988), whose steps are themselves solutions of least-squares problems with linear constraints. Source: "Rotary
// Flexible Joint", 2.1.3 and 2.2.2, which fits the same structure in the discrete form x_{k+1} = (1 + D A) x_k + D B
// u_k by CVX. Differences over a step D add D w^2 / 2 of damping to what they fit (2.3 1/s at 2 ms and the joint's 48
// rad/s, where the joint has 0.3), so the derivatives here are those of the low pass, and the discrete matrices are
// written out at the end.
#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <nlopt.hpp>
#include <unsupported/Eigen/MatrixFunctions>

#include "replay/initial_state.h"
#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {

using Matrix4 = Eigen::Matrix4d;
using Vector4 = Eigen::Vector4d;

struct System {
  Matrix4 a = Matrix4::Zero();
  Vector4 b = Vector4::Zero();
};

enum Coefficient { kA22, kA23, kA24, kA43, kA44, kB2, kCoefficients };
using Coefficients = Eigen::Matrix<double, kCoefficients, 1>;

System FromCoefficients(const Coefficients& c) {
  System s;
  s.a(0, 1) = s.a(2, 3) = 1;
  s.a.row(1) << 0, c[kA22], c[kA23], c[kA24];
  s.a.row(3) << 0, -c[kA22], c[kA43], c[kA44];
  s.b = Vector4(0, c[kB2], 0, -c[kB2]);
  return s;
}

struct Samples {
  std::vector<double> th, dth, ddth, a, da, dda, u, time_s;
  std::vector<int> log;
  double dt_s = 0;
};

// Of a speed's variance, as noise: what noise in the regressors can take off a coefficient, and so part of its
// interval.
constexpr double kSpeedNoiseShare = 0.003;

// The nominal model linearised about rest.
System Nominal(const IdentifyInput& input, int base, int link) {
  const mjModel& compiled = input.model.compiled();
  const ModelPtr m(mj_copyModel(nullptr, &compiled));
  const DataPtr d(mj_makeData(m.get()));
  StandHeldBodies(input.model, input.recordings.front(), input.values, m.get());
  ParameterWriter writer(input.model, m.get(), d.get());
  writer.Write(input.values, input.recordings.front().values);
  const int qb = m->jnt_qposadr[base], vb = m->jnt_dofadr[base], ql = m->jnt_qposadr[link], vl = m->jnt_dofadr[link],
            u = input.model.command_actuators().front();
  const auto accelerations = [&](double th, double dth, double a, double da, double command) {
    mj_resetData(m.get(), d.get());
    d->qpos[qb] = th, d->qpos[ql] = a, d->qvel[vb] = dth, d->qvel[vl] = da, d->ctrl[u] = command;
    mj_forward(m.get(), d.get());
    return Eigen::Vector2d(d->qacc[vb], d->qacc[vl]);
  };
  System s;
  s.a(0, 1) = s.a(2, 3) = 1;
  constexpr double kStep = 1e-4;
  const double unit[5][5] = {
      {kStep, 0, 0, 0, 0}, {0, kStep, 0, 0, 0}, {0, 0, kStep, 0, 0}, {0, 0, 0, kStep, 0}, {0, 0, 0, 0, kStep}};
  for (int i = 0; i < 5; ++i) {
    const double* x = unit[i];
    const Eigen::Vector2d slope =
        (accelerations(x[0], x[1], x[2], x[3], x[4]) - accelerations(-x[0], -x[1], -x[2], -x[3], -x[4])) / (2 * kStep);
    if (i < 4) {
      s.a(1, i) = slope[0], s.a(3, i) = slope[1];
    } else {
      s.b[1] = slope[0], s.b[3] = slope[1];
    }
  }
  return s;
}

// Root mean square over both angles of (RMSE / standard deviation), simulated in windows of a second that start from
// the measured state.
double Score(const System& system, const IdentifyInput& input,
             const std::vector<std::pair<std::size_t, IdentifyOptions>>& parts, int base, int link) {
  double sum = 0;
  int count = 0;
  for (const auto& [log, options] : parts) {
    const Recording& recording = input.recordings[log];
    const SmoothLog smooth(recording, options);
    const auto *th = FindSignal(input.model, recording, SignalKind::kPosition, base),
               *al = FindSignal(input.model, recording, SignalKind::kPosition, link);
    const std::vector<double> q = smooth.Sampled(th->values, 0), dq = smooth.Sampled(th->values, 1),
                              a = smooth.Sampled(al->values, 0), da = smooth.Sampled(al->values, 1),
                              u = smooth.GridOf(recording.commands.front().values, true);
    // Exact over a held command: exp of the augmented matrix.
    Eigen::Matrix<double, 5, 5> augmented = Eigen::Matrix<double, 5, 5>::Zero();
    augmented.topLeftCorner<4, 4>() = system.a * smooth.dt_s();
    augmented.topRightCorner<4, 1>() = system.b * smooth.dt_s();
    const Eigen::Matrix<double, 5, 5> step = augmented.exp();
    const std::size_t window = static_cast<std::size_t>(1 / smooth.dt_s());
    double eq = 0, ea = 0, mq = 0, ma = 0, vq = 0, va = 0, n = 0;
    for (std::size_t i = 0; i < q.size(); ++i) {
      if (std::isfinite(q[i])) mq += q[i], ma += a[i], n += 1;
    }
    if (n < 10) continue;
    mq /= n, ma /= n;
    Vector4 x = Vector4::Zero();
    std::size_t since = window;
    for (std::size_t i = 0; i < q.size(); ++i) {
      if (!std::isfinite(q[i])) continue;
      if (since >= window) {
        x = Vector4(q[i], dq[i], a[i], da[i]);
        since = 0;
      }
      eq += (x[0] - q[i]) * (x[0] - q[i]), ea += (x[2] - a[i]) * (x[2] - a[i]);
      vq += (q[i] - mq) * (q[i] - mq), va += (a[i] - ma) * (a[i] - ma);
      x = step.topLeftCorner<4, 4>() * x + step.topRightCorner<4, 1>() * u[i];
      ++since;
    }
    sum += 0.5 * (eq / vq + ea / va);
    ++count;
  }
  return count > 0 ? std::sqrt(sum / count) : kNaN;
}

struct FlexibleJoint {
  int base, link;
};

// The driven joint and the one with a spring. Error: the model is more or less than that.
Result<FlexibleJoint> FindFlexibleJoint(const Model& model) {
  GS_ASSIGN(const int base, DrivenJoint(model, ""));
  const mjModel& m = model.compiled();
  int link = -1;
  for (int j = 0; j < m.njnt; ++j) {
    if (j != base && m.jnt_stiffness[j] > 0) link = j;
  }
  if (link < 0 || m.nv != 2)
    return Error{.what = "this state space is that of a flexible joint",
                 .where = model.experiment().model_path,
                 .allowed = "a driven joint and a joint with a spring, nothing else"};
  return FlexibleJoint{base, link};
}

using LogPart = std::pair<std::size_t, IdentifyOptions>;  // a log, and the stretch of it

struct HoldOut {
  std::vector<LogPart> train, held_out;
  std::string how;  // a remark where it was not asked for
};

// What is held out: the logs asked for, or the last of several, or the last 30 % of one.
Result<HoldOut> SplitForScore(const std::vector<Recording>& recordings, const IdentifyOptions& options) {
  HoldOut split;
  std::vector<std::size_t> held = options.held_out;
  if (held.empty() && recordings.size() > 1) held = {recordings.size() - 1}, split.how = "held out: the last log";
  for (std::size_t log = 0; log < recordings.size(); ++log)
    (std::find(held.begin(), held.end(), log) != held.end() ? split.held_out : split.train).emplace_back(log, options);
  if (recordings.size() == 1) {
    const double cut = 0.7 * recordings.front().duration_s();
    split.train.front().second.to_s = cut;
    split.held_out.emplace_back(0, options);
    split.held_out.front().second.from_s = cut;
    split.how = "held out: the last 30 % of the log's time";
  }
  if (split.train.empty())
    return Error{.what = "every log is held out", .where = "--hold-out", .allowed = "at least one log to fit"};
  return split;
}

Result<Samples> ReadSamples(const IdentifyInput& input, const std::vector<LogPart>& train, FlexibleJoint joint) {
  Samples s;
  for (const auto& [log, part] : train) {
    const Recording& recording = input.recordings[log];
    const SmoothLog smooth(recording, part);
    const auto *th = FindSignal(input.model, recording, SignalKind::kPosition, joint.base),
               *al = FindSignal(input.model, recording, SignalKind::kPosition, joint.link);
    if (!th || !al) return Error{.what = "the state needs both angles", .where = recording.log_path};
    s.dt_s = smooth.dt_s();
    const std::vector<double> q = smooth.Sampled(th->values, 0), dq = smooth.Sampled(th->values, 1),
                              ddq = smooth.Sampled(th->values, 2), a = smooth.Sampled(al->values, 0),
                              da = smooth.Sampled(al->values, 1), dda = smooth.Sampled(al->values, 2),
                              u = smooth.Held(recording.commands.front().values);
    for (std::size_t i = 0; i < q.size(); ++i) {
      if (!std::isfinite(ddq[i]) || !std::isfinite(dda[i]) || !std::isfinite(u[i])) continue;
      s.th.push_back(q[i]), s.dth.push_back(dq[i]), s.ddth.push_back(ddq[i]), s.a.push_back(a[i]),
          s.da.push_back(da[i]), s.dda.push_back(dda[i]), s.u.push_back(u[i]);
      s.time_s.push_back(smooth.time_s(i)), s.log.push_back(static_cast<int>(log));
    }
  }
  if (s.u.size() < 100)
    return Error{.what = "too few rows to fit a state space",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(s.u.size()),
                 .allowed = "at least 100"};
  return s;
}

struct FreeFit {
  System system;
  double base_rmse = 0, link_rmse = 0;  // of the two accelerations
};

// Unconstrained: each acceleration on everything.
Result<FreeFit> FitWithoutStructure(const Samples& s) {
  Rows first({"base angle", "base speed", "deflection", "deflection's speed", "command"}), second(first.columns());
  for (std::size_t i = 0; i < s.u.size(); ++i) {
    first.Add(s.log[i], s.time_s[i], s.ddth[i], {s.th[i], s.dth[i], s.a[i], s.da[i], s.u[i]});
    second.Add(s.log[i], s.time_s[i], s.dda[i], {s.th[i], s.dth[i], s.a[i], s.da[i], s.u[i]});
  }
  GS_ASSIGN(const Regression base, Regress(first, s.dt_s));
  GS_ASSIGN(const Regression link, Regress(second, s.dt_s));
  FreeFit fit{.system = {}, .base_rmse = base.rmse, .link_rmse = link.rmse};
  fit.system.a(0, 1) = fit.system.a(2, 3) = 1;
  fit.system.a.row(1) = base.value.head(4).transpose();
  fit.system.a.row(3) = link.value.head(4).transpose();
  fit.system.b = Vector4(0, base.value[4], 0, link.value[4]);
  return fit;
}

struct StackedRows {
  Eigen::MatrixXd x;
  Eigen::VectorXd y;
  std::vector<int> logs;
  std::vector<double> times_s;
};

// Both accelerations stacked, each over its own noise.
StackedRows Stack(const Samples& s, double w1, double w2) {
  const Eigen::Index n = static_cast<Eigen::Index>(s.u.size());
  StackedRows rows{.x = Eigen::MatrixXd::Zero(2 * n, kCoefficients),
                   .y = Eigen::VectorXd(2 * n),
                   .logs = std::vector<int>(static_cast<std::size_t>(2 * n)),
                   .times_s = std::vector<double>(static_cast<std::size_t>(2 * n))};
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    // The two rows of a moment stand side by side, so that they share a block.
    rows.x.row(2 * i) << w1 * s.dth[k], w1 * s.a[k], w1 * s.da[k], 0, 0, w1 * s.u[k];
    rows.x.row(2 * i + 1) << -w2 * s.dth[k], 0, 0, w2 * s.a[k], w2 * s.da[k], -w2 * s.u[k];
    rows.y[2 * i] = w1 * s.ddth[k], rows.y[2 * i + 1] = w2 * s.dda[k];
    rows.logs[2 * k] = rows.logs[2 * k + 1] = s.log[k];
    rows.times_s[2 * k] = rows.times_s[2 * k + 1] = s.time_s[k];
  }
  return rows;
}

// In units of the nominal values: all coefficients are one there.
struct NominalUnits {
  Coefficients scale;
  std::vector<double> lower, upper, start;
};

NominalUnits UnitsOf(const System& nominal, double bounds_share) {
  const Coefficients center = (Coefficients() << nominal.a(1, 1), nominal.a(1, 2), nominal.a(1, 3), nominal.a(3, 2),
                               nominal.a(3, 3), nominal.b[1])
                                  .finished();
  NominalUnits units{.scale = center,
                     .lower = std::vector<double>(kCoefficients),
                     .upper = std::vector<double>(kCoefficients),
                     .start = std::vector<double>(kCoefficients, 1.0)};
  for (int i = 0; i < kCoefficients; ++i) {
    // A nominal of zero (a link without damping) is only held to its sign, in units of the base's.
    const bool has_nominal = std::abs(center[i]) >= 1e-9;
    if (!has_nominal) units.scale[i] = (i == kA44 ? -1 : 1) * std::abs(center[kA22]);
    // The dampings of the link are known worst: only their sign is held.
    const bool damping = i == kA24 || i == kA44;
    units.lower[i] = damping || !has_nominal ? 0 : std::max(0.0, 1 - bounds_share);
    units.upper[i] = damping || !has_nominal ? 50 : 1 + bounds_share;
    units.start[i] = std::clamp(has_nominal ? 1.0 : 0.1, units.lower[i], units.upper[i]);
  }
  return units;
}

// z'h z - 2 g'z + c
struct Quadratic {
  Eigen::MatrixXd h;
  Eigen::VectorXd g;
  double c;

  static double Value(const std::vector<double>& v, std::vector<double>& gradient, void* data) {
    const auto& q = *static_cast<const Quadratic*>(data);
    const Eigen::Map<const Eigen::VectorXd> z(v.data(), static_cast<Eigen::Index>(v.size()));
    const Eigen::VectorXd hz = q.h * z;
    if (!gradient.empty()) Eigen::Map<Eigen::VectorXd>(gradient.data(), z.size()) = 2 * (hz - q.g);
    return z.dot(hz) - 2 * z.dot(q.g) + q.c;
  }
};

// large x_j - small x_i <= 0
struct Inequality {
  double small, large;
  int i, j;

  static double Value(const std::vector<double>& v, std::vector<double>& gradient, void* data) {
    const auto& c = *static_cast<const Inequality*>(data);
    if (!gradient.empty()) {
      std::fill(gradient.begin(), gradient.end(), 0.0);
      gradient[c.i] = -c.small, gradient[c.j] = c.large;
    }
    return c.large * v[c.j] - c.small * v[c.i];
  }
};

// Least squares of the rows within bounds and with the link's inertia finite. `where` of an error: the log.
Result<Coefficients> FitWithStructure(const StackedRows& rows, const NominalUnits& units, const std::string& where) {
  const double n = static_cast<double>(rows.y.size()) / 2;
  const Coefficients& scale = units.scale;
  const Eigen::MatrixXd scaled = rows.x * scale.asDiagonal();
  Quadratic problem{
      .h = scaled.transpose() * scaled / n, .g = scaled.transpose() * rows.y / n, .c = rows.y.squaredNorm() / n};
  Inequality stiff{-scale[kA43], scale[kA23], kA43, kA23}, damped{-scale[kA44], scale[kA24], kA44, kA24};
  nlopt::opt solver(nlopt::LD_SLSQP, kCoefficients);
  solver.set_lower_bounds(units.lower);
  solver.set_upper_bounds(units.upper);
  solver.set_min_objective(Quadratic::Value, &problem);
  for (Inequality* inequality : {&stiff, &damped})
    solver.add_inequality_constraint(Inequality::Value, inequality, 1e-10);
  solver.set_xtol_rel(1e-12);
  solver.set_ftol_rel(1e-15);
  solver.set_maxeval(2000);
  std::vector<double> at = units.start;
  double value = 0;
  try {
    solver.optimize(at, value);
  } catch (const nlopt::roundoff_limited&) {  // as near as doubles go
  } catch (const std::exception& e) {
    return Error{.what = std::string("the quadratic program failed: ") + e.what(), .where = where};
  }
  Coefficients solution;
  for (int i = 0; i < kCoefficients; ++i) solution[i] = at[static_cast<std::size_t>(i)] * scale[i];
  return solution;
}

// The coefficients with their intervals, the remark of those at a bound, and how well the rows are met.
void AddCoefficients(const StackedRows& rows, const NominalUnits& units, const Coefficients& solution, double dt_s,
                     Identification* result) {
  const Eigen::VectorXd residual = rows.y - rows.x * solution;
  const BlockCovariance blocks = CovarianceByBlocks(rows.x, residual, rows.logs, rows.times_s, dt_s);
  static constexpr const char* kNames[] = {"A22", "A23", "A24", "A43", "A44", "B2"};
  static constexpr const char* kUnits[] = {"1/s", "1/s^2", "1/s", "1/s^2", "1/s", "rad/s^2 per command"};
  std::string bound;
  for (int i = 0; i < kCoefficients; ++i) {
    const double half =
        blocks.quantile * std::sqrt(std::max(0.0, blocks.covariance(i, i))) + kSpeedNoiseShare * std::abs(solution[i]);
    result->values.push_back({.name = kNames[i],
                              .unit = kUnits[i],
                              .value = solution[i],
                              .low = solution[i] - half,
                              .high = solution[i] + half});
    const double z = solution[i] / units.scale[i];
    if (z < units.lower[static_cast<std::size_t>(i)] + 1e-6 || z > units.upper[static_cast<std::size_t>(i)] - 1e-6)
      bound += (bound.empty() ? "" : ", ") + std::string(kNames[i]);
  }
  double misfit = 0, total = 0;
  for (Eigen::Index i = 0; i < residual.size(); ++i)
    misfit += residual[i] * residual[i], total += rows.y[i] * rows.y[i];
  result->r2 = 1 - misfit / total;
  result->rmse = std::sqrt(misfit / static_cast<double>(residual.size()));
  if (!bound.empty()) result->remarks.push_back("at a bound: " + bound);
}

// I + dt A | dt B
PointTable DiscreteTable(const char* name, const System& system, double dt_s) {
  PointTable table{.name = name, .columns = {"A1", "A2", "A3", "A4", "B"}, .rows = {}};
  for (int r = 0; r < 4; ++r) {
    std::vector<double> row;
    row.reserve(5);
    for (int c = 0; c < 4; ++c) row.push_back((r == c ? 1 : 0) + dt_s * system.a(r, c));
    row.push_back(dt_s * system.b[r]);
    table.rows.push_back(row);
  }
  return table;
}

}  // namespace

Result<Identification> IdentifyStateSpace(const IdentifyInput& input, const IdentifyOptions& asked) {
  GS_ASSIGN(const FlexibleJoint joint, FindFlexibleJoint(input.model));
  IdentifyOptions options = asked;
  options.cutoff_hz = std::min(QuietCutoff(input, joint.base, 1, kSpeedNoiseShare, asked),
                               QuietCutoff(input, joint.link, 1, kSpeedNoiseShare, asked));
  GS_ASSIGN(const HoldOut split, SplitForScore(input.recordings, options));
  const System nominal = Nominal(input, joint.base, joint.link);
  GS_ASSIGN(const Samples samples, ReadSamples(input, split.train, joint));
  GS_ASSIGN(const FreeFit free, FitWithoutStructure(samples));
  const double w1 = 1 / free.base_rmse, w2 = 1 / free.link_rmse;
  const StackedRows rows = Stack(samples, w1, w2);
  const NominalUnits units = UnitsOf(nominal, options.bounds_share);
  GS_ASSIGN(const Coefficients solution, FitWithStructure(rows, units, input.recordings.front().log_path));

  Identification result{.method = "state-space",
                        .relation = "th'' = A22 th' + A23 a + A24 a' + B2 u; a'' = -A22 th' + A43 a + A44 a' - B2 u",
                        .unit = "rad/s^2",
                        .rows = samples.u.size()};
  AddCoefficients(rows, units, solution, samples.dt_s, &result);
  result.rmse /= w1;  // of the base's acceleration: the rows are in units of its noise
  const auto add = [&](const char* name, double value) {
    result.values.push_back({.name = name, .unit = "1", .value = value, .low = kNaN, .high = kNaN});
  };
  const auto error = [&](const System& system) { return Score(system, input, split.held_out, joint.base, joint.link); };
  const System constrained = FromCoefficients(solution);
  // A43 / A23 = -(1 + J_base / J_link): what is known of the inertias without a force.
  add("base_over_link_inertia", -solution[kA43] / solution[kA23] - 1);
  add("error_nominal", error(nominal));
  add("error_constrained", error(constrained));
  add("error_unconstrained", error(free.system));
  if (!split.how.empty()) result.remarks.push_back(split.how);
  result.remarks.push_back("errors: RMSE over standard deviation on held-out data, windows of 1 s");
  result.tables = {DiscreteTable("discrete_constrained", constrained, samples.dt_s),
                   DiscreteTable("discrete_unconstrained", free.system, samples.dt_s),
                   DiscreteTable("discrete_nominal", nominal, samples.dt_s)};
  return result;
}

}  // namespace gapscope
