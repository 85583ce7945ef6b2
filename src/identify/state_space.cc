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
};

// The nominal model linearised about rest.
System Nominal(const IdentifyInput& input, int base, int link) {
  const mjModel& compiled = input.model.compiled();
  const ModelPtr m(mj_copyModel(nullptr, &compiled));
  const DataPtr d(mj_makeData(m.get()));
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
  return count > 0 ? std::sqrt(sum / count) : NAN;
}

}  // namespace

Result<Identification> IdentifyStateSpace(const IdentifyInput& input, const IdentifyOptions& asked) {
  IdentifyOptions options = asked;
  GS_ASSIGN(const int base, DrivenJoint(input.model, ""));
  const mjModel& m = input.model.compiled();
  int link = -1;
  for (int j = 0; j < m.njnt; ++j) {
    if (j != base && m.jnt_stiffness[j] > 0) link = j;
  }
  if (link < 0 || m.nv != 2)
    return Error{.what = "this state space is that of a flexible joint",
                 .where = input.model.experiment().model_path,
                 .allowed = "a driven joint and a joint with a spring, nothing else"};
  // Of a speed's variance, as noise: what noise in the regressors can take off a coefficient, and so part of its
  // interval.
  constexpr double kNoiseShare = 0.003;
  options.cutoff_hz =
      std::min(QuietCutoff(input, base, 1, kNoiseShare, asked), QuietCutoff(input, link, 1, kNoiseShare, asked));
  // What is held out: the logs asked for, or the last of several, or the last 30 % of one.
  std::vector<std::pair<std::size_t, IdentifyOptions>> train, held_out;
  std::string how;
  std::vector<std::size_t> held = options.held_out;
  if (held.empty() && input.recordings.size() > 1) held = {input.recordings.size() - 1}, how = "held out: the last log";
  for (std::size_t log = 0; log < input.recordings.size(); ++log)
    (std::find(held.begin(), held.end(), log) != held.end() ? held_out : train).emplace_back(log, options);
  if (input.recordings.size() == 1) {
    const double cut = 0.7 * input.recordings.front().duration_s();
    train.front().second.to_s = cut;
    held_out.emplace_back(0, options);
    held_out.front().second.from_s = cut;
    how = "held out: the last 30 % of the log's time";
  }
  if (train.empty())
    return Error{.what = "every log is held out", .where = "--hold-out", .allowed = "at least one log to fit"};
  const System nominal = Nominal(input, base, link);

  Samples s;
  double dt = 0;
  for (const auto& [log, part] : train) {
    const Recording& recording = input.recordings[log];
    const SmoothLog smooth(recording, part);
    const auto *th = FindSignal(input.model, recording, SignalKind::kPosition, base),
               *al = FindSignal(input.model, recording, SignalKind::kPosition, link);
    if (!th || !al) return Error{.what = "the state needs both angles", .where = recording.log_path};
    dt = smooth.dt_s();
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

  // Unconstrained: each acceleration on everything.
  Rows first({"base angle", "base speed", "deflection", "deflection's speed", "command"}), second(first.columns());
  for (std::size_t i = 0; i < s.u.size(); ++i) {
    first.Add(s.log[i], s.time_s[i], s.ddth[i], {s.th[i], s.dth[i], s.a[i], s.da[i], s.u[i]});
    second.Add(s.log[i], s.time_s[i], s.dda[i], {s.th[i], s.dth[i], s.a[i], s.da[i], s.u[i]});
  }
  GS_ASSIGN(const Regression free1, Regress(first, dt));
  GS_ASSIGN(const Regression free2, Regress(second, dt));
  System unconstrained;
  unconstrained.a(0, 1) = unconstrained.a(2, 3) = 1;
  unconstrained.a.row(1) = free1.value.head(4).transpose();
  unconstrained.a.row(3) = free2.value.head(4).transpose();
  unconstrained.b = Vector4(0, free1.value[4], 0, free2.value[4]);

  // Constrained: both accelerations stacked, each over its own noise.
  const double w1 = 1 / free1.rmse, w2 = 1 / free2.rmse;
  const Eigen::Index n = static_cast<Eigen::Index>(s.u.size());
  Eigen::MatrixXd x = Eigen::MatrixXd::Zero(2 * n, kCoefficients);
  Eigen::VectorXd y(2 * n);
  std::vector<int> logs(static_cast<std::size_t>(2 * n));
  std::vector<double> times(static_cast<std::size_t>(2 * n));
  for (Eigen::Index i = 0; i < n; ++i) {
    const std::size_t k = static_cast<std::size_t>(i);
    // The two rows of a moment stand side by side, so that they share a block.
    x.row(2 * i) << w1 * s.dth[k], w1 * s.a[k], w1 * s.da[k], 0, 0, w1 * s.u[k];
    x.row(2 * i + 1) << -w2 * s.dth[k], 0, 0, w2 * s.a[k], w2 * s.da[k], -w2 * s.u[k];
    y[2 * i] = w1 * s.ddth[k], y[2 * i + 1] = w2 * s.dda[k];
    logs[2 * k] = logs[2 * k + 1] = s.log[k];
    times[2 * k] = times[2 * k + 1] = s.time_s[k];
  }
  const Coefficients center = (Coefficients() << nominal.a(1, 1), nominal.a(1, 2), nominal.a(1, 3), nominal.a(3, 2),
                               nominal.a(3, 3), nominal.b[1])
                                  .finished();
  // In units of the nominal values: all coefficients are one there. A nominal of zero (a link without damping) is only
  // held to its sign, in units of the base's.
  Coefficients scale = center;
  for (int i = 0; i < kCoefficients; ++i) {
    if (std::abs(scale[i]) < 1e-9) scale[i] = (i == kA44 ? -1 : 1) * std::abs(center[kA22]);
  }
  const Eigen::MatrixXd scaled = x * scale.asDiagonal();
  const Eigen::MatrixXd hessian = scaled.transpose() * scaled / static_cast<double>(n);
  const Eigen::VectorXd linear = scaled.transpose() * y / static_cast<double>(n);
  const double constant = y.squaredNorm() / static_cast<double>(n);
  std::vector<double> lower(kCoefficients), upper(kCoefficients), start(kCoefficients, 1.0);
  for (int i = 0; i < kCoefficients; ++i) {
    const bool has_nominal = std::abs(center[i]) >= 1e-9;
    // The dampings of the link are known worst: only their sign is held.
    const bool damping = i == kA24 || i == kA44;
    lower[i] = damping || !has_nominal ? 0 : std::max(0.0, 1 - options.bounds_share);
    upper[i] = damping || !has_nominal ? 50 : 1 + options.bounds_share;
    start[i] = std::clamp(has_nominal ? 1.0 : 0.1, lower[i], upper[i]);
  }
  struct Quadratic {
    Eigen::MatrixXd h;
    Eigen::VectorXd g;
    double c;
  } problem{hessian, linear, constant};
  struct Inequality {
    double small, large;
    int i, j;  // large x_j - small x_i <= 0
  } stiff{-scale[kA43], scale[kA23], kA43, kA23}, damped{-scale[kA44], scale[kA24], kA44, kA24};
  nlopt::opt solver(nlopt::LD_SLSQP, kCoefficients);
  solver.set_lower_bounds(lower);
  solver.set_upper_bounds(upper);
  solver.set_min_objective(
      [](const std::vector<double>& v, std::vector<double>& gradient, void* data) {
        const auto& q = *static_cast<const Quadratic*>(data);
        const Eigen::Map<const Eigen::VectorXd> z(v.data(), static_cast<Eigen::Index>(v.size()));
        const Eigen::VectorXd hz = q.h * z;
        if (!gradient.empty()) Eigen::Map<Eigen::VectorXd>(gradient.data(), z.size()) = 2 * (hz - q.g);
        return z.dot(hz) - 2 * z.dot(q.g) + q.c;
      },
      &problem);
  for (Inequality* inequality : {&stiff, &damped}) {
    solver.add_inequality_constraint(
        [](const std::vector<double>& v, std::vector<double>& gradient, void* data) {
          const auto& c = *static_cast<const Inequality*>(data);
          if (!gradient.empty()) {
            std::fill(gradient.begin(), gradient.end(), 0.0);
            gradient[c.i] = -c.small, gradient[c.j] = c.large;
          }
          return c.large * v[c.j] - c.small * v[c.i];
        },
        inequality, 1e-10);
  }
  solver.set_xtol_rel(1e-12);
  solver.set_ftol_rel(1e-15);
  solver.set_maxeval(2000);
  double value = 0;
  try {
    solver.optimize(start, value);
  } catch (const nlopt::roundoff_limited&) {  // as near as doubles go
  } catch (const std::exception& e) {
    return Error{.what = std::string("the quadratic program failed: ") + e.what(),
                 .where = input.recordings.front().log_path};
  }
  Coefficients solution;
  for (int i = 0; i < kCoefficients; ++i) solution[i] = start[static_cast<std::size_t>(i)] * scale[i];
  const System constrained = FromCoefficients(solution);

  Identification result{.method = "state-space",
                        .relation = "th'' = A22 th' + A23 a + A24 a' + B2 u; a'' = -A22 th' + A43 a + A44 a' - B2 u",
                        .unit = "rad/s^2",
                        .rows = s.u.size()};
  const Eigen::VectorXd residual = y - x * solution;
  const BlockCovariance blocks = CovarianceByBlocks(x, residual, logs, times, dt);
  static constexpr const char* kNames[] = {"A22", "A23", "A24", "A43", "A44", "B2"};
  static constexpr const char* kUnits[] = {"1/s", "1/s^2", "1/s", "1/s^2", "1/s", "rad/s^2 per command"};
  std::string bound;
  for (int i = 0; i < kCoefficients; ++i) {
    const double half =
        blocks.quantile * std::sqrt(std::max(0.0, blocks.covariance(i, i))) + kNoiseShare * std::abs(solution[i]);
    result.values.push_back({.name = kNames[i],
                             .unit = kUnits[i],
                             .value = solution[i],
                             .low = solution[i] - half,
                             .high = solution[i] + half});
    const double z = solution[i] / scale[i];
    if (z < lower[static_cast<std::size_t>(i)] + 1e-6 || z > upper[static_cast<std::size_t>(i)] - 1e-6)
      bound += (bound.empty() ? "" : ", ") + std::string(kNames[i]);
  }
  // A43 / A23 = -(1 + J_base / J_link): what is known of the inertias without a force.
  result.values.push_back({.name = "base_over_link_inertia",
                           .unit = "1",
                           .value = -solution[kA43] / solution[kA23] - 1,
                           .low = NAN,
                           .high = NAN});
  result.values.push_back({.name = "error_nominal",
                           .unit = "1",
                           .value = Score(nominal, input, held_out, base, link),
                           .low = NAN,
                           .high = NAN});
  result.values.push_back({.name = "error_constrained",
                           .unit = "1",
                           .value = Score(constrained, input, held_out, base, link),
                           .low = NAN,
                           .high = NAN});
  result.values.push_back({.name = "error_unconstrained",
                           .unit = "1",
                           .value = Score(unconstrained, input, held_out, base, link),
                           .low = NAN,
                           .high = NAN});
  double misfit = 0, total = 0;
  for (Eigen::Index i = 0; i < 2 * n; ++i) misfit += residual[i] * residual[i], total += y[i] * y[i];
  result.r2 = 1 - misfit / total;
  result.rmse = std::sqrt(misfit / static_cast<double>(2 * n)) / w1;
  if (!bound.empty()) result.remarks.push_back("at a bound: " + bound);
  if (!how.empty()) result.remarks.push_back(how);
  result.remarks.push_back("errors: RMSE over standard deviation on held-out data, windows of 1 s");
  const auto table = [&](const char* name, const System& system) {
    PointTable t{.name = name, .columns = {"A1", "A2", "A3", "A4", "B"}, .rows = {}};
    for (int r = 0; r < 4; ++r) {
      std::vector<double> row;
      for (int c = 0; c < 4; ++c) row.push_back((r == c ? 1 : 0) + dt * system.a(r, c));
      row.push_back(dt * system.b[r]);
      t.rows.push_back(row);
    }
    result.tables.push_back(std::move(t));
  };
  table("discrete_constrained", constrained);
  table("discrete_unconstrained", unconstrained);
  table("discrete_nominal", nominal);
  return result;
}

}  // namespace gapscope
