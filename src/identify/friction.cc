// Friction of the driven joint against speed, and what rests on the same balance of torques: its own inertia, settled
// speeds, a cable's spring.
//
//   drive(V or A, w) - M a - bias + springs = Tc+ [w > 0] - Tc- [w < 0] + b+ max(w, 0) + b- min(w, 0) (+ k (q - rest))
//
// Everything on the left is the model's or logged (torque.h). While the joint slides a constant torque cannot be told
// from a difference of Tc+ and Tc-. Source: "Quanser Qube 2 - Report", 2.2 (friction ladder, equivalent viscous
// damping), 2.3 (inertia from step responses), 2.5 (cable).
#include <algorithm>
#include <cmath>
#include <functional>
#include <optional>

#include "src/core/statistics.h"
#include "src/identify/plateaus.h"
#include "src/identify/regression.h"
#include "src/identify/torque.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {

struct Slide {
  int log;
  double time_s, angle, speed, acceleration, drive, demand, others;
};

struct Slides {
  std::vector<Slide> rows;
  double dt_s = 0, fastest = 0, least = 0;
  bool torque_logged = false;
};

Result<Slides> LoadSlides(const IdentifyInput& input, int joint, const IdentifyOptions& options) {
  Slides slides;
  std::vector<Motion> motions;
  std::vector<std::size_t> reaches;
  std::vector<std::vector<double>>
      quick;  // speeds behind the usual low pass: a motion faster than a lower one reverses unseen
  double resolution = 0;
  for (std::size_t log = 0; log < input.recordings.size(); ++log) {
    GS_ASSIGN(Motion motion, MotionOf(input, log, joint, options));
    const SmoothLog smooth(input.recordings[log], options);
    slides.dt_s = smooth.dt_s();
    reaches.push_back(smooth.reach());
    IdentifyOptions usual = options;
    usual.cutoff_hz = 0;
    const auto* logged = FindSignal(input.model, input.recordings[log], SignalKind::kPosition, joint);
    quick.push_back(SmoothLog(input.recordings[log], usual).Sampled(logged->values, 1));
    for (const double v : motion.speed_rad_per_s) {
      if (std::isfinite(v)) slides.fastest = std::max(slides.fastest, std::abs(v));
    }
    // One count over the filter's width.
    if (const auto* angle = FindSignal(input.model, input.recordings[log], SignalKind::kPosition, joint))
      resolution = std::max(resolution, angle->spec.resolution * smooth.cutoff_hz());
    slides.torque_logged = motion.torque_logged;
    motions.push_back(std::move(motion));
  }
  slides.least = std::max(0.02 * slides.fastest, 2 * resolution);
  for (std::size_t log = 0; log < motions.size(); ++log) {
    const Motion& m = motions[log];
    const std::vector<char> sliding = Sliding(m.speed_rad_per_s, quick[log], slides.least, reaches[log] / 2);
    for (std::size_t i = 0; i < sliding.size(); ++i) {
      if (!sliding[i] || !std::isfinite(m.drive_n_m[i]) || !std::isfinite(m.demand_n_m[i])) continue;
      slides.rows.push_back({static_cast<int>(log), m.time_s[i], m.angle_rad[i], m.speed_rad_per_s[i],
                             m.acceleration_rad_per_s2[i], m.drive_n_m[i], m.demand_n_m[i], m.others_n_m[i]});
    }
  }
  std::size_t forward = 0;
  for (const auto& row : slides.rows) forward += row.speed > 0 ? 1 : 0;
  if (slides.rows.size() < 50 || forward < 10 || slides.rows.size() - forward < 10) {
    return Error{.what = "the joint hardly slides in both directions",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(forward) + " rows forward, " + std::to_string(slides.rows.size() - forward) +
                           " backward",
                 .allowed = "at least 10 each and 50 in all",
                 .cure = "a ladder of the command or a slow triangle"};
  }
  return slides;
}

// Mean left side in bins of speed, with the standard error by blocks.
PointTable SpeedMap(const Slides& slides, const std::function<double(const Slide&)>& torque) {
  PointTable table{.name = "map", .columns = {"speed_rad_per_s", "torque_n_m", "low", "high", "rows"}, .rows = {}};
  constexpr int kBins = 12;
  for (int b = -kBins; b < kBins; ++b) {
    // Finer bins at low speed.
    const auto edge = [&](int i) {
      return (i < 0 ? -1 : 1) * slides.fastest * std::pow(std::abs(i) / static_cast<double>(kBins), 2);
    };
    const double low = edge(b), high = edge(b + 1);
    Rows rows({"constant"});
    double sum = 0;
    for (const auto& s : slides.rows) {
      if (s.speed < low || s.speed >= high) continue;
      rows.Add(s.log, s.time_s, torque(s), {1});
      sum += s.speed;
    }
    const auto fit = Regress(rows, slides.dt_s);
    if (!fit.ok()) continue;
    table.rows.push_back({sum / static_cast<double>(rows.size()), fit.value().value[0], fit.value().low[0],
                          fit.value().high[0], static_cast<double>(rows.size())});
  }
  return table;
}

// Inertial torques as regressors want accelerations without noise in them.
IdentifyOptions ForFreeInertia(const IdentifyInput& input, int joint, IdentifyOptions options) {
  if (options.free_inertia) options.cutoff_hz = QuietCutoff(input, joint, 2, 0.003, options);
  return options;
}

void CommonRemarks(const Slides& slides, Identification* result) {
  if (!slides.torque_logged)
    result->remarks.push_back(
        "the drive's torque is the model's, from command and speed: errors of its torque and back-EMF constants show "
        "as friction");
}

}  // namespace

Result<Identification> IdentifyFriction(const IdentifyInput& input, const IdentifyOptions& asked) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, asked.joint));
  const IdentifyOptions options = ForFreeInertia(input, joint, asked);
  GS_ASSIGN(const Slides slides, LoadSlides(input, joint, options));
  double lowest = INFINITY, highest = -INFINITY;
  for (const auto& s : slides.rows) lowest = std::min(lowest, s.angle), highest = std::max(highest, s.angle);
  // A cable's or a spring's pull is not friction; on a joint that turns round and round there is none.
  const bool pull = highest - lowest < 12.6;
  const auto base = [&](const Slide& s) {
    std::vector<double> x = {s.speed > 0 ? 1.0 : 0.0, s.speed < 0 ? -1.0 : 0.0, std::max(s.speed, 0.0),
                             std::min(s.speed, 0.0)};
    if (pull) x.push_back(s.angle);
    if (options.free_inertia) x.insert(x.end(), {s.demand - s.others, s.others});
    return x;
  };
  std::vector<std::string> columns = {"forward dry friction", "backward dry friction", "forward viscous friction",
                                      "backward viscous friction"};
  if (pull) columns.push_back("angle");
  if (options.free_inertia) columns.insert(columns.end(), {"own inertia", "other links"});
  Rows plain(columns);
  for (const auto& s : slides.rows) plain.Add(s.log, s.time_s, s.drive - s.demand, base(s));
  GS_ASSIGN(const Regression fit, Regress(plain, slides.dt_s));
  Identification result{.method = "friction",
                        .relation = "drive - inertia - gravity - springs = +-coulomb + viscous speed" +
                                    std::string(pull ? " + pull angle" : ""),
                        .r2 = fit.r2,
                        .rmse = fit.rmse,
                        .unit = "N m",
                        .rows = fit.rows};
  result.values.push_back(ToEstimate(fit, 0, "coulomb_positive", "N m"));
  result.values.push_back(ToEstimate(fit, 1, "coulomb_negative", "N m"));
  result.values.push_back(ToEstimate(fit, 2, "viscous_positive", "N m s/rad"));
  result.values.push_back(ToEstimate(fit, 3, "viscous_negative", "N m s/rad"));
  const auto mean = [&](Eigen::Index i, Eigen::Index j, const char* name, const char* unit) {
    const double value = 0.5 * (fit.value[i] + fit.value[j]);
    const double error =
        fit.quantile * 0.5 *
        std::sqrt(std::max(0.0, fit.covariance(i, i) + fit.covariance(j, j) + 2 * fit.covariance(i, j)));
    result.values.push_back({.name = name, .unit = unit, .value = value, .low = value - error, .high = value + error});
  };
  mean(0, 1, "coulomb", "N m");
  mean(2, 3, "viscous", "N m s/rad");
  if (pull) result.values.push_back(ToEstimate(fit, 4, "pull", "N m/rad"));
  // Stribeck's hump: one more column, its width scanned; kept when it stands clear of zero.
  double best = fit.residual.squaredNorm(), width = 0;
  columns.push_back("hump at low speed");
  const auto with_hump = [&](double vs) {
    Rows rows(columns);
    for (const auto& s : slides.rows) {
      std::vector<double> x = base(s);
      x.push_back((s.speed > 0 ? 1 : -1) * std::exp(-s.speed * s.speed / (vs * vs)));
      rows.Add(s.log, s.time_s, s.drive - s.demand, x);
    }
    return Regress(rows, slides.dt_s);
  };
  for (int i = 0; i < 12; ++i) {
    const double vs =
        2 * slides.least * std::pow(std::max(slides.fastest / 4, 3 * slides.least) / (2 * slides.least), i / 11.0);
    const auto trial = with_hump(vs);
    if (trial.ok() && trial.value().residual.squaredNorm() < best)
      best = trial.value().residual.squaredNorm(), width = vs;
  }
  // A hump as narrow as the edge of what counts as sliding is that edge: presliding, and rows that noise has let in.
  if (width > 4 * slides.least) {
    const auto hump = with_hump(width);
    const Eigen::Index at = hump.value().value.size() - 1;
    // Twice the interval: the width was chosen to make it large. And a tenth of the dry friction: presliding bends the
    // first milliradians too.
    if (hump.value().value[at] > 0.05 * std::abs(fit.value[0] + fit.value[1]) &&
        hump.value().value[at] - 2 * (hump.value().value[at] - hump.value().low[at]) > 0) {
      result.values.push_back(ToEstimate(hump.value(), at, "stribeck_rise", "N m"));
      result.values.push_back({.name = "stribeck_speed", .unit = "rad/s", .value = width, .low = NAN, .high = NAN});
      result.r2 = hump.value().r2, result.rmse = hump.value().rmse;
    }
  }
  result.tables.push_back(
      SpeedMap(slides, [&](const Slide& s) { return s.drive - s.demand - (pull ? fit.value[4] * s.angle : 0); }));
  if (result.Find("coulomb_positive")->low > result.Find("coulomb_negative")->high ||
      result.Find("coulomb_negative")->low > result.Find("coulomb_positive")->high) {
    result.remarks.push_back(
        "the two directions differ; while sliding that equals a constant torque beside equal friction");
  }
  if (result.Find("coulomb")->high < 0 || result.Find("viscous")->high < 0)
    result.remarks.push_back(
        "friction below zero: the drive's torque of the model is too small, or an effect is missing");
  CommonRemarks(slides, &result);
  return result;
}

Result<Identification> IdentifyInertia(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  // Noise in the acceleration makes the inertia too small, by its share of what the other columns leave of it: the
  // cut-off with the smallest share is taken.
  IdentifyOptions quiet = options;
  double share = 0;
  std::optional<Regression> chosen;
  bool pull = false;
  for (double cutoff = SmoothLog(input.recordings.front(), options).cutoff_hz(); cutoff > 0.5; cutoff *= 0.8) {
    IdentifyOptions trial = options;
    trial.cutoff_hz = cutoff;
    const auto slides = LoadSlides(input, joint, trial);
    if (!slides.ok()) {
      if (!chosen && cutoff * 0.8 <= 0.5) return slides.error();
      continue;
    }
    double lowest = INFINITY, highest = -INFINITY;
    for (const auto& s : slides.value().rows) lowest = std::min(lowest, s.angle), highest = std::max(highest, s.angle);
    pull = highest - lowest < 12.6;
    std::vector<std::string> columns = {"acceleration", "speed", "direction", "constant"};
    if (pull) columns.push_back("angle");
    Rows rows(columns);
    for (const auto& s : slides.value().rows) {
      std::vector<double> x = {s.acceleration, s.speed, s.speed > 0 ? 1.0 : -1.0, 1.0};
      if (pull) x.push_back(s.angle);
      rows.Add(s.log, s.time_s, s.drive - s.others, x);
    }
    auto fit = Regress(rows, slides.value().dt_s);
    if (!fit.ok()) return fit.error();
    const Eigen::MatrixXd x = rows.X();
    const double left = 1 / (static_cast<double>(rows.size()) * (x.transpose() * x).inverse()(0, 0));
    const double own = NoiseVariance(input, joint, 2, trial) / left;
    if (!chosen || own < share) {
      share = own, quiet = trial;
      chosen = std::move(fit).value();
    }
    if (options.cutoff_hz > 0 || own < 1e-4) break;
  }
  if (!chosen) return Error{.what = "no cut-off leaves rows to fit", .where = input.recordings.front().log_path};
  const Regression& fit = *chosen;
  GS_ASSIGN(const Slides slides, LoadSlides(input, joint, quiet));
  Identification result{
      .method = "inertia",
      .relation = "drive - other links = inertia acceleration + viscous speed + coulomb sign(speed) + offset" +
                  std::string(pull ? " + pull angle" : ""),
      .r2 = fit.r2,
      .rmse = fit.rmse,
      .unit = "N m",
      .rows = fit.rows};
  result.values.push_back(ToEstimate(fit, 0, "inertia", "kg m2"));
  result.values.back().high += std::abs(fit.value[0]) * share / std::max(0.1, 1 - share);
  result.values.push_back(ToEstimate(fit, 1, "viscous", "N m s/rad"));
  result.values.push_back(ToEstimate(fit, 2, "coulomb", "N m"));
  result.values.push_back(ToEstimate(fit, 3, "offset", "N m"));
  if (pull) result.values.push_back(ToEstimate(fit, 4, "pull", "N m/rad"));
  result.values.push_back({.name = "inertia_nominal",
                           .unit = "kg m2",
                           .value = DrivenInertia(input.model.compiled(), joint),
                           .low = NAN,
                           .high = NAN});
  result.remarks.push_back("low pass at " + std::to_string(quiet.cutoff_hz).substr(0, 4) + " Hz; noise is " +
                           std::to_string(100 * share).substr(0, 4) +
                           " % of the acceleration that the other columns leave: the interval holds it");
  if (fit.high[0] - fit.low[0] > 0.5 * std::abs(fit.value[0]))
    result.remarks.push_back("the acceleration hardly shows in these logs: steps or a faster input");
  CommonRemarks(slides, &result);
  return result;
}

Result<Identification> IdentifySteady(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  std::vector<Plateau> plateaus = FindPlateaus(input, joint, {}, options, 0.3);
  const mjModel& base = input.model.compiled();
  const ModelPtr m(mj_copyModel(nullptr, &base));
  const DataPtr d(mj_makeData(m.get()));
  const int dof = base.jnt_dofadr[joint];
  double fastest = 0;
  for (const auto& p : plateaus) fastest = std::max(fastest, std::isfinite(p.speed) ? std::abs(p.speed) : 0);
  std::size_t unsettled = 0;
  // What still accelerates would count inertia as friction; what stands still says only that the drive is below dry
  // friction.
  std::erase_if(plateaus, [&](const Plateau& p) {
    const bool settled =
        std::isfinite(p.speed) && std::abs(p.acceleration) * (p.to_s - p.from_s) < 0.02 * std::abs(p.speed);
    const bool turns = std::abs(p.speed) > 0.02 * fastest;
    unsettled += turns && !settled ? 1 : 0;
    return !settled || !turns;
  });
  PointTable table{.name = "points", .columns = {"command", "speed_rad_per_s", "drive_n_m"}, .rows = {}};
  Identification result{.method = "steady",
                        .relation = "drive(command, speed) = viscous speed + coulomb sign(speed), settled",
                        .unit = "N m"};
  std::vector<double> drive;
  for (const auto& p : plateaus) {
    ParameterWriter writer(input.model, m.get(), d.get());
    if (!writer.Write(input.values, input.recordings[static_cast<std::size_t>(p.log)].values))
      return Error{.what = "the parameters make no model", .where = input.model.experiment().path};
    mj_resetData(m.get(), d.get());
    d->qvel[dof] = p.speed;
    d->ctrl[input.model.command_actuators().front()] = p.command;
    mj_fwdPosition(m.get(), d.get());
    mj_fwdVelocity(m.get(), d.get());
    mj_fwdActuation(m.get(), d.get());
    drive.push_back(std::isfinite(p.torque) ? p.torque : d->qfrc_actuator[dof]);
    table.rows.push_back({p.command, p.speed, drive.back()});
  }
  std::size_t forward = 0;
  for (const auto& p : plateaus) forward += p.speed > 0 ? 1 : 0;
  if (plateaus.size() < 4 || forward < 2 || plateaus.size() - forward < 2) {
    return Error{.what = "fewer than two settled speeds in each direction",
                 .where = input.recordings.front().log_path,
                 .actual = std::to_string(forward) + " forward, " + std::to_string(plateaus.size() - forward) +
                           " backward, " + std::to_string(unsettled) + " still accelerating",
                 .cure = "hold each command until the speed has settled, 0.3 s or more"};
  }
  // Each settled speed is one reading: ordinary least squares, Student's intervals.
  const bool fixed = options.coulomb_n_m >= 0;
  const Eigen::Index n = static_cast<Eigen::Index>(plateaus.size()), k = fixed ? 1 : 2;
  Eigen::MatrixXd x(n, k);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Plateau& p = plateaus[static_cast<std::size_t>(i)];
    const double sign = p.speed > 0 ? 1 : -1;
    x(i, 0) = p.speed;
    if (!fixed) x(i, 1) = sign;
    y[i] = drive[static_cast<std::size_t>(i)] - (fixed ? options.coulomb_n_m * sign : 0);
  }
  const Eigen::MatrixXd inverse = (x.transpose() * x).ldlt().solve(Eigen::MatrixXd::Identity(k, k));
  const Eigen::VectorXd beta = inverse * x.transpose() * y, residual = y - x * beta;
  const double scatter = residual.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, n - k)),
               t = StudentQuantile(static_cast<double>(n - k));
  const auto estimate = [&](Eigen::Index i, const char* name, const char* unit) {
    const double half = t * std::sqrt(scatter * inverse(i, i));
    result.values.push_back(
        {.name = name, .unit = unit, .value = beta[i], .low = beta[i] - half, .high = beta[i] + half});
  };
  estimate(0, "viscous", "N m s/rad");
  if (!fixed) {
    estimate(1, "coulomb", "N m");
  } else {
    result.values.push_back({.name = "coulomb", .unit = "N m", .value = options.coulomb_n_m, .low = NAN, .high = NAN});
  }
  // Speed per command in each direction: lines through their own points.
  for (const int sign : {1, -1}) {
    double cc = 0, cs = 0, count = 0;
    for (const auto& p : plateaus) {
      if (p.speed * sign > 0) cc += p.command * p.command, cs += p.command * p.speed, count += 1;
    }
    double rest = 0;
    for (const auto& p : plateaus) {
      if (p.speed * sign > 0) rest += std::pow(p.speed - cs / cc * p.command, 2);
    }
    const double half = StudentQuantile(count - 1) * std::sqrt(rest / std::max(1.0, count - 1) / cc);
    result.values.push_back({.name = sign > 0 ? "speed_per_command_positive" : "speed_per_command_negative",
                             .unit = "rad/s per " + input.model.experiment().commands.front().unit,
                             .value = cs / cc,
                             .low = cs / cc - half,
                             .high = cs / cc + half});
  }
  const double spread = (y.array() - y.mean()).square().sum();
  result.r2 = spread > 0 ? 1 - residual.squaredNorm() / spread : 0;
  result.rmse = std::sqrt(residual.squaredNorm() / static_cast<double>(n));
  result.rows = plateaus.size();
  const Estimate &plus = result.values[result.values.size() - 2], &minus = result.values.back();
  if (plus.low > minus.high || minus.low > plus.high)
    result.remarks.push_back("the two directions settle at different speeds");
  if (unsettled > 0)
    result.remarks.push_back(std::to_string(unsettled) + " plateaus still accelerate and are left out");
  result.remarks.push_back(
      "with nominal kt, km and R this damping holds their errors too: it makes the model settle where the rig does");
  result.tables.push_back(std::move(table));
  return result;
}

Result<Identification> IdentifyCable(const IdentifyInput& input, const IdentifyOptions& asked) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, asked.joint));
  const IdentifyOptions options = ForFreeInertia(input, joint, asked);
  GS_ASSIGN(const Slides slides, LoadSlides(input, joint, options));
  std::vector<std::string> columns = {"angle", "constant", "direction", "speed"};
  if (options.free_inertia) columns.insert(columns.end(), {"own inertia", "other links"});
  const auto fit_of = [&](const std::function<bool(const Slide&)>& use) {
    Rows rows(columns);
    for (const auto& s : slides.rows) {
      if (!use(s)) continue;
      std::vector<double> x = {s.angle, 1, s.speed > 0 ? 1.0 : -1.0, s.speed};
      if (options.free_inertia) x.insert(x.end(), {s.demand - s.others, s.others});
      rows.Add(s.log, s.time_s, s.drive - s.demand, x);
    }
    return Regress(rows, slides.dt_s);
  };
  GS_ASSIGN(const Regression fit, fit_of([](const Slide&) { return true; }));
  Identification result{
      .method = "cable",
      .relation =
          "drive - inertia - gravity - springs = stiffness (angle - rest) + coulomb sign(speed) + viscous speed",
      .r2 = fit.r2,
      .rmse = fit.rmse,
      .unit = "N m",
      .rows = fit.rows};
  result.values.push_back(ToEstimate(fit, 0, "stiffness", "N m/rad"));
  // rest = -c / k, by the delta method.
  const auto rest_of = [](const Regression& f) {
    const double rest = -f.value[1] / f.value[0];
    const Eigen::Vector2d gradient(f.value[1] / (f.value[0] * f.value[0]), -1 / f.value[0]);
    const double error =
        f.quantile * std::sqrt(std::max(0.0, gradient.dot(f.covariance.topLeftCorner(2, 2) * gradient)));
    return Estimate{.name = "rest", .unit = "rad", .value = rest, .low = rest - error, .high = rest + error};
  };
  result.values.push_back(rest_of(fit));
  result.values.push_back(ToEstimate(fit, 2, "coulomb", "N m"));
  result.values.push_back(ToEstimate(fit, 3, "viscous", "N m s/rad"));
  // Repeats: logs, or quarters of the only one.
  PointTable repeats{
      .name = "repeats",
      .columns = {"repeat", "stiffness", "stiffness_low", "stiffness_high", "rest", "rest_low", "rest_high"},
      .rows = {}};
  const bool one = input.recordings.size() == 1;
  const int parts = one ? 4 : static_cast<int>(input.recordings.size());
  const double duration = input.recordings.front().duration_s();
  std::vector<double> stiffnesses, rests;
  for (int part = 0; part < parts; ++part) {
    const auto own = fit_of([&](const Slide& s) {
      return one ? s.time_s >= duration * part / parts && s.time_s < duration * (part + 1) / parts : s.log == part;
    });
    if (!own.ok()) continue;
    const Estimate rest = rest_of(own.value());
    repeats.rows.push_back({static_cast<double>(part), own.value().value[0], own.value().low[0], own.value().high[0],
                            rest.value, rest.low, rest.high});
    stiffnesses.push_back(own.value().value[0]);
    rests.push_back(rest.value);
  }
  if (stiffnesses.size() > 1) {
    const auto spread = [](const std::vector<double>& v) {
      double mean = 0, square = 0;
      for (const double x : v) mean += x / static_cast<double>(v.size());
      for (const double x : v) square += (x - mean) * (x - mean);
      return std::sqrt(square / static_cast<double>(v.size() - 1));
    };
    result.values.push_back(
        {.name = "stiffness_spread", .unit = "N m/rad", .value = spread(stiffnesses), .low = NAN, .high = NAN});
    result.values.push_back({.name = "rest_spread", .unit = "rad", .value = spread(rests), .low = NAN, .high = NAN});
    result.remarks.push_back(std::string("spread: standard deviation over ") +
                             (one ? "quarters of the log" : "the logs"));
  }
  if (fit.low[0] <= 0) result.remarks.push_back("no spring is seen: its interval holds zero");
  result.tables.push_back(std::move(repeats));
  CommonRemarks(slides, &result);
  return result;
}

}  // namespace gapscope
