// A free swing that dies out: frequency, viscous and dry friction told apart, from the whole motion rather than from
// its peaks alone.
//
//   dd = -w^2 f(q - rest) - damping dq - dry sign(dq) - coupling cos(q - rest) dd_parent,  f = sin under gravity, the
//   angle itself on a spring
//
// With viscous friction alone the peaks fall exponentially, with dry friction alone by equal steps. The equation is
// integrated and fitted by Levenberg and Marquardt, so large swings need no small-angle formula, and the joint that
// carries the swinging one may move: its measured acceleration is an input. Source: "Quanser Qube 2 - Report", 2.4,
// which fits the envelope.
#include <algorithm>
#include <array>
#include <cmath>
#include <functional>
#include <numbers>

#include "replay/initial_state.h"
#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/regression.h"
#include "src/model/drive_facts.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {

enum Index { kLogW2, kDamping, kDry, kRest, kAngle, kSpeed, kCoupling, kCount };
using Parameters = std::array<double, kCount>;

struct Swing {
  std::vector<double> time_s, angle;                  // of the rows used
  std::vector<double> parent_s, parent_acceleration;  // regular grid; empty: the parent rests
  bool spring = false;
};

double ParentAt(const Swing& swing, double t) {
  if (swing.parent_s.empty()) return 0;
  const double dt = swing.parent_s[1] - swing.parent_s[0],
               x = std::clamp((t - swing.parent_s[0]) / dt, 0.0, static_cast<double>(swing.parent_s.size() - 1));
  const std::size_t k = std::min(static_cast<std::size_t>(x), swing.parent_s.size() - 2);
  return swing.parent_acceleration[k] +
         (x - static_cast<double>(k)) * (swing.parent_acceleration[k + 1] - swing.parent_acceleration[k]);
}

// The angle at each row. Fourth-order Runge-Kutta with the direction of dry friction held over a step; a step in which
// the speed turns ends in rest, from which the joint leaves only when the pull beats dry friction.
void Integrate(const Swing& swing, const Parameters& p, Eigen::VectorXd* angle) {
  constexpr double kStep_s = 0.002;
  const double w2 = std::exp(p[kLogW2]);
  const auto pull = [&](double q, double t) {
    const double x = q - p[kRest];
    return -w2 * (swing.spring ? x : std::sin(x)) -
           p[kCoupling] * (swing.spring ? 1 : std::cos(x)) * ParentAt(swing, t);
  };
  double q = p[kAngle], v = p[kSpeed];
  for (std::size_t r = 0; r < swing.time_s.size(); ++r) {
    (*angle)[static_cast<Eigen::Index>(r)] = q;
    if (r + 1 == swing.time_s.size()) break;
    const double span = swing.time_s[r + 1] - swing.time_s[r];
    const int steps = std::max(1, static_cast<int>(std::ceil(span / kStep_s - 1e-9)));
    const double h = span / steps;
    for (int s = 0; s < steps; ++s) {
      const double t = swing.time_s[r] + s * h, at_rest = pull(q, t);
      double direction = v > 0 ? 1 : v < 0 ? -1 : 0;
      if (v == 0) {
        if (std::abs(at_rest) <= p[kDry]) continue;
        direction = at_rest > 0 ? 1 : -1;
      }
      const auto rate = [&](double qq, double vv, double tt) {
        return pull(qq, tt) - p[kDamping] * vv - p[kDry] * direction;
      };
      const double a1 = rate(q, v, t), v2 = v + 0.5 * h * a1, a2 = rate(q + 0.5 * h * v, v2, t + 0.5 * h),
                   v3 = v + 0.5 * h * a2;
      const double a3 = rate(q + 0.5 * h * v2, v3, t + 0.5 * h), v4 = v + h * a3, a4 = rate(q + h * v3, v4, t + h);
      const double next_v = v + h / 6 * (a1 + 2 * a2 + 2 * a3 + a4), next_q = q + h / 6 * (v + 2 * v2 + 2 * v3 + v4);
      if (next_v * direction < 0 && p[kDry] > 0) {
        // Turns inside the step: up to there, then on from rest with the rest of the step.
        const double share = v == 0 ? 0 : v / (v - next_v), turn = q + 0.5 * v * share * h, left = (1 - share) * h,
                     now = pull(turn, t + share * h);
        if (std::abs(now) <= p[kDry]) {
          q = turn, v = 0;
        } else {
          const double a = now + p[kDry] * direction;
          q = turn + 0.5 * a * left * left, v = a * left;
        }
        continue;
      }
      q = next_q, v = next_v;
    }
  }
}

struct SwingFit {
  Parameters parameters{};
  std::vector<int> free;
  Eigen::MatrixXd jacobian;
  Eigen::VectorXd residual;
  double rmse = INFINITY;
};

// Dry friction that would go below zero stands still: the others' step must not count on it.
void HoldDryAtZero(const SwingFit& fit, Eigen::MatrixXd* normal, Eigen::VectorXd* right) {
  const auto at = std::ranges::find(fit.free, static_cast<int>(kDry));
  if (at == fit.free.end() || fit.parameters[kDry] > 0) return;
  const Eigen::Index c = at - fit.free.begin();
  if ((*right)[c] >= 0) return;
  const double scale = (*normal)(c, c);
  normal->row(c).setZero();
  normal->col(c).setZero();
  (*normal)(c, c) = scale;
  (*right)[c] = 0;
}

SwingFit Fit(const Swing& swing, Parameters start, std::vector<int> free) {
  const Eigen::Index rows = static_cast<Eigen::Index>(swing.time_s.size()),
                     columns = static_cast<Eigen::Index>(free.size());
  const Eigen::VectorXd measured = Eigen::Map<const Eigen::VectorXd>(swing.angle.data(), rows);
  const double w = std::exp(0.5 * start[kLogW2]);
  const std::array<double, kCount> step = {1e-3, 1e-3 * w, 1e-4 * w * w, 1e-3, 1e-3, 1e-3 * w, 1e-3};
  SwingFit fit{.parameters = start, .free = std::move(free)};
  Eigen::VectorXd predicted(rows), moved(rows);
  Integrate(swing, fit.parameters, &predicted);
  fit.residual = measured - predicted;
  double damping = 1e-3;
  fit.jacobian.resize(rows, columns);
  for (int iteration = 0; iteration < 60; ++iteration) {
    for (Eigen::Index c = 0; c < columns; ++c) {
      const int index = fit.free[static_cast<std::size_t>(c)];
      Parameters other = fit.parameters;
      other[index] += step[index];
      Integrate(swing, other, &moved);
      fit.jacobian.col(c) = (moved - predicted) / step[index];
    }
    Eigen::MatrixXd normal = fit.jacobian.transpose() * fit.jacobian;
    Eigen::VectorXd right = fit.jacobian.transpose() * fit.residual;
    HoldDryAtZero(fit, &normal, &right);
    bool better = false;
    double gain = 0;
    for (int attempt = 0; attempt < 8 && !better; ++attempt) {
      Eigen::MatrixXd damped = normal;
      damped.diagonal() +=
          damping * normal.diagonal() + Eigen::VectorXd::Constant(columns, 1e-15 * normal.diagonal().maxCoeff());
      const Eigen::VectorXd move = damped.ldlt().solve(right);
      Parameters next = fit.parameters;
      for (Eigen::Index c = 0; c < columns; ++c) next[fit.free[static_cast<std::size_t>(c)]] += move[c];
      next[kDry] = std::max(next[kDry], 0.0);
      Integrate(swing, next, &moved);
      const Eigen::VectorXd residual = measured - moved;
      if (residual.allFinite() && residual.squaredNorm() < fit.residual.squaredNorm()) {
        gain = 1 - residual.squaredNorm() / fit.residual.squaredNorm();
        fit.parameters = next, fit.residual = residual, predicted = moved;
        damping = std::max(0.1 * damping, 1e-9);
        better = true;
      } else {
        damping *= 10;
      }
    }
    if (!better || gain < 1e-7) break;
  }
  fit.rmse = std::sqrt(fit.residual.squaredNorm() / static_cast<double>(rows));
  return fit;
}

// The longest stretch in which nothing drives: a drive that is switched off, or a command of zero.
Result<std::pair<double, double>> FreeStretch(const Model& model, const Recording& recording,
                                              const IdentifyOptions& options) {
  if (options.from_s > 0 || options.to_s > 0)
    return std::pair{options.from_s, options.to_s > 0 ? options.to_s : recording.time_s.back()};
  const Recording::Command* gate = &recording.commands.front();
  for (std::size_t c = 0; c < recording.commands.size(); ++c) {
    if (FactsOf(model.compiled(), model.command_actuators()[c]).enables) gate = &recording.commands[c];
  }
  double best_from = 0, best_to = 0;
  std::size_t begin = 0;
  for (std::size_t k = 0; k <= recording.rows(); ++k) {
    if (k < recording.rows() && std::abs(gate->values[k]) < 1e-9) continue;
    if (k > begin && recording.time_s[k - 1] - recording.time_s[begin] > best_to - best_from)
      best_from = recording.time_s[begin], best_to = recording.time_s[k - 1];
    begin = k + 1;
  }
  if (best_to - best_from < 0.5) {
    return Error{.what = "the log has no stretch without a command",
                 .where = recording.log_path,
                 .actual = std::to_string(best_to - best_from) + " s",
                 .allowed = "at least 0.5 s",
                 .cure = "name the stretch by --from and --to"};
  }
  return std::pair{best_from, best_to};
}

using Stretch = std::pair<double, double>;  // from, to: seconds

// The joint asked for, or the one on a spring, or the last link.
Result<int> SwingingJoint(const Model& model, const std::string& asked) {
  if (!asked.empty()) return DrivenJoint(model, asked);
  const mjModel& m = model.compiled();
  int joint = static_cast<int>(m.njnt) - 1;
  for (int j = 0; j < m.njnt; ++j) {
    if (m.jnt_stiffness[j] > 0) joint = j;
  }
  return joint;
}

// Where the joint that carries the swinging one moves, its acceleration drives the swing.
void AddCarrier(const Model& model, const Recording& recording, int joint, Stretch stretch,
                const IdentifyOptions& options, Swing* swing) {
  const mjModel& m = model.compiled();
  const int parent_body = m.body_parentid[m.jnt_bodyid[joint]];
  if (parent_body <= 0 || m.body_jntnum[parent_body] != 1) return;
  const auto* carrier = FindSignal(model, recording, SignalKind::kPosition, m.body_jntadr[parent_body]);
  if (!carrier) return;
  double low = kInfinity, high = -kInfinity;
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    if (recording.time_s[k] >= stretch.first && recording.time_s[k] <= stretch.second)
      low = std::min(low, carrier->values[k]), high = std::max(high, carrier->values[k]);
  }
  if (!(high - low > std::max(0.01, 3 * carrier->spec.resolution))) return;
  IdentifyOptions whole = options;
  whole.from_s = whole.to_s = 0;
  const SmoothLog smooth(recording, whole);
  const std::vector<double> acceleration = smooth.Sampled(carrier->values, 2);
  for (std::size_t i = 0; i < smooth.size(); ++i) {
    swing->parent_s.push_back(smooth.time_s(i));
    swing->parent_acceleration.push_back(std::isfinite(acceleration[i]) ? acceleration[i] : 0);
  }
}

Result<Swing> ReadSwing(const Recording& recording, const Recording::Measured& angle, Stretch stretch) {
  Swing swing;
  for (std::size_t k = 0; k < recording.rows(); ++k) {
    if (recording.time_s[k] < stretch.first || recording.time_s[k] > stretch.second || !std::isfinite(angle.values[k]))
      continue;
    swing.time_s.push_back(recording.time_s[k]);
    swing.angle.push_back(angle.values[k]);
  }
  if (swing.time_s.size() < 50)
    return Error{.what = "the free stretch is too short",
                 .where = recording.log_path,
                 .actual = std::to_string(swing.time_s.size()) + " rows",
                 .allowed = "at least 50"};
  return swing;
}

// What is seen of a swing without a fit.
struct Sight {
  double rest = 0, amplitude = 0;
  std::vector<double> crossings_s;  // of rest, behind a dead band, so that noise does not count
};

Sight LookAt(const Swing& swing, double resolution) {
  Sight sight;
  const std::vector<double> tail(swing.angle.begin() + static_cast<std::ptrdiff_t>(swing.angle.size() * 3 / 4),
                                 swing.angle.end());
  for (const double q : tail) sight.rest += q / static_cast<double>(tail.size());
  for (const double q : swing.angle) sight.amplitude = std::max(sight.amplitude, std::abs(q - sight.rest));
  int side = 0;
  for (std::size_t k = 0; k < swing.angle.size(); ++k) {
    const double x = swing.angle[k] - sight.rest;
    if (std::abs(x) < std::max(0.04 * sight.amplitude, 2 * resolution)) continue;
    const int now = x > 0 ? 1 : -1;
    if (side != 0 && now != side) sight.crossings_s.push_back(swing.time_s[k]);
    side = now;
  }
  return sight;
}

Parameters GuessFrom(const Swing& swing, const Sight& sight) {
  // Later swings are small ones: their period is the linear one.
  const std::size_t n = sight.crossings_s.size(), first = n > 6 ? n / 2 : 0;
  const double half_period = (sight.crossings_s.back() - sight.crossings_s[first]) / static_cast<double>(n - 1 - first);
  const double w = std::numbers::pi / half_period;
  Parameters start{};
  start[kLogW2] = 2 * std::log(w), start[kDamping] = 0.05 * w, start[kDry] = 0.002 * w * w * sight.amplitude,
  start[kRest] = sight.rest, start[kAngle] = swing.angle.front();
  start[kSpeed] = (swing.angle[3] - swing.angle[0]) / (swing.time_s[3] - swing.time_s[0]);
  start[kCoupling] = swing.parent_s.empty() ? 0 : swing.spring ? 1 : 0.5;
  return start;
}

// Several starts of frequency and dry friction: the cost has minima a swing apart.
SwingFit FitFromSeveral(const Swing& swing, const Parameters& start) {
  std::vector<int> free = {kLogW2, kDamping, kDry, kRest, kAngle, kSpeed};
  if (!swing.parent_s.empty()) free.push_back(kCoupling);
  SwingFit best;
  for (const double factor : {1.0, 0.94, 1.06, 0.88, 1.13}) {
    for (const double dry : {0.0, 1.0}) {
      Parameters other = start;
      other[kLogW2] += 2 * std::log(factor);
      other[kDry] *= dry * 10;
      SwingFit fit = Fit(swing, other, free);
      if (fit.rmse < best.rmse) best = std::move(fit);
    }
  }
  return best;
}

// The mean square of the same fit with one parameter held at zero.
double MeanSquareWithout(Index held, const Swing& swing, const SwingFit& fit) {
  std::vector<int> free = fit.free;
  std::erase(free, static_cast<int>(held));
  Parameters start = fit.parameters;
  start[held] = 0;
  return std::pow(Fit(swing, start, free).rmse, 2);
}

// Peaks of the measured motion between passages, one row each: log, time, amplitude.
void AddPeaks(std::size_t log, const Swing& swing, const std::vector<double>& crossings_s, double rest,
              PointTable* peaks) {
  for (std::size_t c = 0; c + 1 < crossings_s.size(); ++c) {
    double peak = 0, at = 0;
    for (std::size_t k = 0; k < swing.angle.size(); ++k) {
      if (swing.time_s[k] < crossings_s[c] || swing.time_s[k] >= crossings_s[c + 1]) continue;
      if (std::abs(swing.angle[k] - rest) > peak) peak = std::abs(swing.angle[k] - rest), at = swing.time_s[k];
    }
    peaks->rows.push_back({static_cast<double>(log), at, peak});
  }
}

struct FittedLog {
  SwingFit fit;
  BlockCovariance covariance;
};

// What the logs add up to.
struct RingDown {
  std::vector<FittedLog> logs;
  bool coupled = false, spring = false;
  double square = 0, rows = 0, variance = 0;  // of the residuals; of the angles
  double viscous_only = 0, dry_only = 0;      // squares of the residuals of each friction alone
  PointTable peaks{.name = "peaks", .columns = {"log", "time_s", "amplitude_rad"}, .rows = {}};
};

Status AddLog(const IdentifyInput& input, std::size_t log, int joint, const IdentifyOptions& options, RingDown* all) {
  const Recording& recording = input.recordings[log];
  const auto* angle = FindSignal(input.model, recording, SignalKind::kPosition, joint);
  if (!angle)
    return Error{.what = "the log has no angle of '" + JointName(input.model, joint) + "'",
                 .where = recording.log_path};
  GS_ASSIGN(const Stretch stretch, FreeStretch(input.model, recording, options));
  GS_ASSIGN(Swing swing, ReadSwing(recording, *angle, stretch));
  swing.spring = all->spring;
  AddCarrier(input.model, recording, joint, stretch, options, &swing);
  all->coupled = all->coupled || !swing.parent_s.empty();
  const Sight sight = LookAt(swing, angle->spec.resolution);
  if (sight.crossings_s.size() < 2) {
    return Error{.what = "the joint does not swing in the free stretch",
                 .where = recording.log_path,
                 .actual = std::to_string(sight.crossings_s.size()) + " passages through rest between " +
                           std::to_string(stretch.first) + " and " + std::to_string(stretch.second) + " s",
                 .allowed = "at least two",
                 .cure = "let it go from a larger angle, or name the stretch by --from and --to"};
  }
  SwingFit fit = FitFromSeveral(swing, GuessFrom(swing, sight));
  const double rows = static_cast<double>(swing.angle.size());
  all->viscous_only += MeanSquareWithout(kDry, swing, fit) * rows;
  all->dry_only += MeanSquareWithout(kDamping, swing, fit) * rows;
  all->square += fit.residual.squaredNorm();
  all->rows += rows;
  double mean = 0;
  for (const double q : swing.angle) mean += q / rows;
  for (const double q : swing.angle) all->variance += (q - mean) * (q - mean);
  AddPeaks(log, swing, sight.crossings_s, fit.parameters[kRest], &all->peaks);
  const std::vector<int> ids(swing.angle.size(), 0);
  BlockCovariance covariance =
      CovarianceByBlocks(fit.jacobian, fit.residual, ids, swing.time_s, recording.timeline.median_step_s);
  all->logs.push_back({std::move(fit), std::move(covariance)});
  return Ok();
}

// Mean over the logs of `value(parameter)`, weighted by each one's variance, with their scatter where it is larger than
// the intervals say. `slope`: that of `value`.
Estimate Combine(const std::vector<FittedLog>& logs, Index index, const std::function<double(double)>& value,
                 const std::function<double(double)>& slope) {
  const auto deviation = [&](const FittedLog& one) {
    const Eigen::Index c = std::find(one.fit.free.begin(), one.fit.free.end(), index) - one.fit.free.begin();
    return slope(one.fit.parameters[index]) * std::sqrt(std::max(one.covariance.covariance(c, c), 1e-300));
  };
  double weight = 0, mean = 0, quantile = 0;
  for (const auto& one : logs) {
    const double s = deviation(one);
    weight += 1 / (s * s), mean += value(one.fit.parameters[index]) / (s * s);
    quantile = std::max(quantile, one.covariance.quantile);
  }
  mean /= weight;
  double chi = 0;
  for (const auto& one : logs) chi += std::pow((value(one.fit.parameters[index]) - mean) / deviation(one), 2);
  const double n = static_cast<double>(logs.size()), scatter = n > 1 ? std::max(1.0, std::sqrt(chi / (n - 1))) : 1;
  const double half = (n > 1 && scatter > 1 ? StudentQuantile(n - 1) : quantile) * scatter / std::sqrt(weight);
  return Estimate{.name = "", .unit = "", .value = mean, .low = mean - half, .high = mean + half};
}

// The model's own inertia about the joint, in the pose it starts from.
Result<double> InertiaAbout(const IdentifyInput& input, int joint) {
  const mjModel& m = input.model.compiled();
  const DataPtr data(mj_makeData(&m));
  const ModelPtr copy(mj_copyModel(nullptr, &m));
  StandHeldBodies(input.model, input.recordings.front(), input.values, copy.get());
  ParameterWriter writer(input.model, copy.get(), data.get());
  if (!writer.Write(input.values, input.recordings.front().values))
    return Error{.what = "the parameters make no model", .where = input.model.experiment().path};
  mj_resetData(copy.get(), data.get());
  mj_fwdPosition(copy.get(), data.get());
  std::vector<mjtNum> unit(m.nv, 0), column(m.nv);
  unit[m.jnt_dofadr[joint]] = 1;
  mj_mulM(copy.get(), data.get(), column.data(), unit.data());
  return column[m.jnt_dofadr[joint]];
}

// The values of all logs together; torques by the model's inertia about the joint.
void AddValues(const RingDown& all, double inertia, Identification* result) {
  const auto add = [&](const char* name, const char* unit, Estimate e) {
    e.name = name, e.unit = unit;
    result->values.push_back(e);
    return e;
  };
  const auto own = [&](Index index) {
    return Combine(all.logs, index, [](double x) { return x; }, [](double) { return 1.0; });
  };
  const auto known = [](double value) {
    return Estimate{.name = "", .unit = "", .value = value, .low = kNaN, .high = kNaN};
  };
  const auto scaled = [&](const Estimate& e) {
    return Estimate{
        .name = "", .unit = "", .value = e.value * inertia, .low = e.low * inertia, .high = e.high * inertia};
  };
  const double two_pi = 2 * std::numbers::pi;
  add("frequency", "Hz",
      Combine(
          all.logs, kLogW2, [&](double x) { return std::exp(0.5 * x) / two_pi; },
          [&](double x) { return 0.5 * std::exp(0.5 * x) / two_pi; }));
  const Estimate damping = add("damping_rate", "1/s", own(kDamping)), dry = add("dry_rate", "rad/s^2", own(kDry));
  add("rest", "rad", own(kRest));
  if (all.coupled) add("coupling", "1", own(kCoupling));
  add("viscous", "N m s/rad", scaled(damping));
  add("coulomb", "N m", scaled(dry));
  add("inertia_nominal", "kg m2", known(inertia));
  add("rmse_viscous_only", "rad", known(std::sqrt(all.viscous_only / all.rows)));
  add("rmse_dry_only", "rad", known(std::sqrt(all.dry_only / all.rows)));
  const bool viscous_seen = damping.low > 0, dry_seen = dry.low > 0;
  result->remarks.push_back(
      viscous_seen && dry_seen
          ? "the envelope is between exponential and linear: viscous and dry friction both stand clear of zero"
      : viscous_seen ? "the envelope is exponential: viscous friction; dry friction does not stand clear of zero"
      : dry_seen     ? "the envelope is linear: dry friction; viscous friction does not stand clear of zero"
                     : "neither viscous nor dry friction stands clear of zero: the swing is too short");
}

}  // namespace

Result<Identification> IdentifyRingDown(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, SwingingJoint(input.model, options.joint));
  RingDown all{.spring = input.model.compiled().jnt_stiffness[joint] > 0};
  for (std::size_t log = 0; log < input.recordings.size(); ++log)
    GS_RETURN_IF_ERROR(AddLog(input, log, joint, options, &all));
  GS_ASSIGN(const double inertia, InertiaAbout(input, joint));
  Identification result{
      .method = "ring-down",
      .relation =
          all.spring
              ? "acceleration = -(2 pi frequency)^2 (angle - rest) - damping_rate speed - dry_rate sign(speed)"
              : "acceleration = -(2 pi frequency)^2 sin(angle - rest) - damping_rate speed - dry_rate sign(speed)",
      .r2 = all.variance > 0 ? 1 - all.square / all.variance : kNaN,
      .rmse = std::sqrt(all.square / all.rows),
      .unit = "rad",
      .rows = static_cast<std::size_t>(all.rows)};
  if (all.coupled) result.relation += " - coupling x acceleration of the joint that carries it";
  AddValues(all, inertia, &result);
  if (result.r2 < 0.98)
    result.remarks.push_back(
        "the equation leaves more than 2 % of the motion's variance: another effect, or not a free swing");
  result.tables.push_back(std::move(all.peaks));
  return result;
}

}  // namespace gapscope
