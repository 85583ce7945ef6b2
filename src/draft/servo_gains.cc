#include "src/draft/servo_gains.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "src/core/mujoco_handles.h"
#include "src/core/statistics.h"

namespace gapscope {
namespace {

constexpr double kHalfWidth_s = 0.03;  // of the parabolas that give speed and acceleration
constexpr double kExplains = 0.8, kKnown = 0.2;
constexpr double kMadeUp_hz = 5, kDroop_rad = 0.1;

// Angle, speed and acceleration of every joint of the pairing at the sampled rows, SI; empty: not measured.
using Motions = std::vector<std::vector<Samples::Motion>>;

Motions MotionsOf(const Samples& samples, const std::vector<Guess>& guesses, const Pairing& p, const Scalings& s) {
  Motions motions(p.joints.size());
  for (std::size_t j = 0; j < p.joints.size(); ++j) {
    if (p.positions[j].column < 0) continue;
    motions[j] = samples.MotionOf(guesses[p.positions[j].column].column, kHalfWidth_s);
    const double factor = s.positions[j].factor;
    for (auto& m : motions[j]) m = {factor * m.value, factor * m.slope, factor * m.curvature};
  }
  return motions;
}

// Torque at each joint that the motion takes, at every sampled row; NaN where the motion is not known. Unmeasured
// joints stand still.
std::vector<std::vector<double>> TorquesOf(const mjModel& model, const Pairing& p, const Motions& motions) {
  const ModelPtr free(mj_copyModel(nullptr, &model));
  free->opt.disableflags |= mjDSBL_CONSTRAINT | mjDSBL_ACTUATION;
  const DataPtr data(mj_makeData(free.get()));
  std::vector<std::vector<double>> torques(p.joints.size());
  std::size_t rows = 0;
  for (const auto& motion : motions) rows = std::max(rows, motion.size());
  for (std::size_t k = 0; k < rows; ++k) {
    mj_resetData(free.get(), data.get());
    bool known = true;
    for (std::size_t j = 0; j < p.joints.size(); ++j) {
      if (motions[j].empty()) continue;
      const auto& [q, v, a] = motions[j][k];
      const int joint = p.joints[j].joint;
      known = known && std::isfinite(q + v + a);
      data->qpos[model.jnt_qposadr[joint]] = q;
      data->qvel[model.jnt_dofadr[joint]] = v;
      data->qacc[model.jnt_dofadr[joint]] = a;
    }
    if (known) mj_inverse(free.get(), data.get());
    for (std::size_t j = 0; j < p.joints.size(); ++j)
      torques[j].push_back(known ? data->qfrc_inverse[model.jnt_dofadr[p.joints[j].joint]] : kNaN);
  }
  return torques;
}

struct Fit {
  double kp = 0, kd = 0, explained = 0, error = 0;  // share of variance; standard error of kp
};

// torque = kp stretch - kd speed + c, and with `rough` less friction sign(speed).
std::optional<Fit> FitLaw(const std::vector<double>& stretch, const std::vector<double>& speed,
                          const std::vector<double>& torque, bool rough, bool damped) {
  std::vector<std::size_t> rows;
  for (std::size_t k = 0; k < torque.size(); ++k) {
    if (std::isfinite(stretch[k] + speed[k] + torque[k])) rows.push_back(k);
  }
  const int terms = 2 + (damped ? 1 : 0) + (rough ? 1 : 0);
  if (rows.size() < 50) return std::nullopt;
  Eigen::MatrixXd x(rows.size(), terms);
  Eigen::VectorXd y(rows.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const std::size_t k = rows[static_cast<std::size_t>(i)];
    int c = 0;
    x(i, c++) = stretch[k];
    x(i, c++) = 1;
    if (damped) x(i, c++) = -speed[k];
    if (rough) x(i, c++) = -std::tanh(speed[k] / 0.05);
    y(i) = torque[k];
  }
  const Eigen::MatrixXd normal = x.transpose() * x;
  const Eigen::VectorXd solution = normal.ldlt().solve(x.transpose() * y);
  const double residual = (y - x * solution).squaredNorm(), total = (y.array() - y.mean()).matrix().squaredNorm();
  if (!(total > 0) || !solution.allFinite()) return std::nullopt;
  const double variance = residual / static_cast<double>(rows.size() - static_cast<std::size_t>(terms));
  const Eigen::MatrixXd covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(terms, terms)) * variance;
  const Fit fit{.kp = solution(0),
                .kd = damped ? solution(2) : 0,
                .explained = 1 - residual / total,
                .error = std::sqrt(std::max(0.0, covariance(0, 0)))};
  if (damped && fit.kd < 0) return FitLaw(stretch, speed, torque, rough, false);
  return fit;
}

bool Counts(const std::optional<Fit>& fit) {
  return fit && fit->kp > 0 && fit->explained > kExplains && fit->error < kKnown * fit->kp;
}

std::string Percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

class Fitter {
 public:
  Fitter(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses, const Pairing& pairing,
         const Scalings& scalings)
      : m_(model), samples_(samples), guesses_(guesses), p_(pairing), s_(scalings) {
    motions_ = MotionsOf(samples, guesses, pairing, scalings);
    torques_ = TorquesOf(model, pairing, motions_);
  }

  ServoGains Gains(std::size_t a) const {
    const ActuatorSlot& slot = p_.actuators[a];
    const bool fits = slot.wants == Quantity::kAngle && p_.commands[a].column >= 0 && !motions_[slot.joint].empty();
    if (fits && p_.torques[a].column >= 0) {
      if (const auto fit = Of(a, InSi(p_.torques[a], s_.torques[a]), false); Counts(fit))
        return {.kp = fit->kp,
                .kd = fit->kd,
                .limit = 0,
                .from = "by regression of the measured torque, which it explains to " + Percent(fit->explained),
                .certain = true};
    }
    if (fits) {
      if (const auto fit = Of(a, torques_[slot.joint], true); Counts(fit))
        return {.kp = fit->kp,
                .kd = fit->kd,
                .limit = 0,
                .from = "by regression of the torque that the motion takes, which it explains to " +
                        Percent(fit->explained),
                .certain = true};
    }
    return MadeUp(slot.joint);
  }

 private:
  std::vector<double> InSi(const Pick& pick, const Scaling& scaling) const {
    std::vector<double> values = samples_.values(guesses_[pick.column].column);
    for (double& v : values) v = scaling.factor * v + scaling.add;
    return values;
  }

  std::optional<Fit> Of(std::size_t a, const std::vector<double>& torque, bool rough) const {
    const auto& motion = motions_[p_.actuators[a].joint];
    std::vector<double> stretch = InSi(p_.commands[a], s_.commands[a]), speed;
    for (std::size_t k = 0; k < stretch.size(); ++k) {
      stretch[k] -= motion[k].value;
      speed.push_back(motion[k].slope);
    }
    return FitLaw(stretch, speed, torque, rough, true);
  }

  ServoGains MadeUp(int slot) const {
    const int dof = m_.jnt_dofadr[p_.joints[slot].joint];
    const double inertia = std::max(m_.dof_M0[dof], 1e-6), w = 2 * std::numbers::pi * kMadeUp_hz;
    const DataPtr data(mj_makeData(&m_));
    mj_forward(&m_, data.get());
    const double kp = std::max(inertia * w * w, std::abs(data->qfrc_bias[dof]) / kDroop_rad);
    return {.kp = kp, .kd = 2 * std::sqrt(kp * inertia), .limit = 0, .from = "made up", .certain = false};
  }

  const mjModel& m_;
  const Samples& samples_;
  const std::vector<Guess>& guesses_;
  const Pairing& p_;
  const Scalings& s_;
  Motions motions_;
  std::vector<std::vector<double>> torques_;  // per joint
};

}  // namespace

std::vector<ServoGains> FitServos(const mjModel& model, const Samples& samples, const std::vector<Guess>& guesses,
                                  const Pairing& pairing, const Scalings& scalings) {
  const Fitter fitter(model, samples, guesses, pairing, scalings);
  std::vector<ServoGains> gains;
  for (std::size_t a = 0; a < pairing.actuators.size(); ++a) gains.push_back(fitter.Gains(a));
  return gains;
}

}  // namespace gapscope
