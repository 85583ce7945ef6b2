#include "src/draft/servo_gains.h"

#include <Eigen/Dense>
#include <algorithm>
#include <cmath>
#include <numbers>
#include <optional>

#include "src/core/mujoco_handles.h"
#include "src/core/statistics.h"
#include "src/draft/motion.h"

namespace gapscope {
namespace {

constexpr double kExplains = 0.8, kKnown = 0.2;
constexpr double kMadeUp_hz = 5, kDroop_rad = 0.1;

struct Fit {
  double kp = 0, kd = 0, armature = 0, explained = 0, error = 0;  // share of variance; standard error of kp
  bool damped = false;                                            // kd did not come out below zero
  int late = 0;                                                   // rows
};

// What the torque may hold beside kp stretch + c. Of the torque that a motion takes the servo bears friction and the
// armature too.
enum Term { kDamping, kArmature, kFriction };
const std::vector<Term> kServo = {kDamping, kArmature, kFriction};

struct Rows {
  std::vector<double> stretch, speed, acceleration, torque;
};

constexpr double kStill = 0.05;  // rad/s, below which friction has no clear sign
constexpr std::size_t kFewestRows = 50;

double TermAt(const Rows& rows, Term term, std::size_t k) {
  return term == kDamping    ? -rows.speed[k]
         : term == kArmature ? -rows.acceleration[k]
                             : -std::tanh(rows.speed[k] / kStill);
}

enum class Signs { kRight, kAny };  // terms with the wrong sign are left out, or not

// Rows that a fit can use. A joint that rubs bears any load while it stands still: where enough rows move, only those.
std::vector<std::size_t> UsedRows(const Rows& rows, bool rubs) {
  std::vector<std::size_t> all, moving;
  for (std::size_t k = 0; k < rows.torque.size(); ++k) {
    if (!std::isfinite(rows.stretch[k] + rows.speed[k] + rows.acceleration[k] + rows.torque[k])) continue;
    all.push_back(k);
    if (std::abs(rows.speed[k]) > kStill) moving.push_back(k);
  }
  return rubs && moving.size() >= kFewestRows ? moving : all;
}

// By least squares.
std::optional<Fit> FitLaw(const Rows& rows, std::vector<Term> terms, Signs signs = Signs::kRight) {
  const std::vector<std::size_t> used = UsedRows(rows, std::ranges::find(terms, kFriction) != terms.end());
  const auto columns = static_cast<Eigen::Index>(2 + terms.size());
  if (used.size() < kFewestRows) return std::nullopt;
  Eigen::MatrixXd x(used.size(), columns);
  Eigen::VectorXd y(used.size());
  for (Eigen::Index i = 0; i < y.size(); ++i) {
    const std::size_t k = used[static_cast<std::size_t>(i)];
    x(i, 0) = rows.stretch[k];
    x(i, 1) = 1;
    for (std::size_t t = 0; t < terms.size(); ++t) x(i, static_cast<Eigen::Index>(2 + t)) = TermAt(rows, terms[t], k);
    y(i) = rows.torque[k];
  }
  const Eigen::MatrixXd normal = x.transpose() * x;
  const Eigen::VectorXd solution = normal.ldlt().solve(x.transpose() * y);
  const double residual = (y - x * solution).squaredNorm(), total = (y.array() - y.mean()).matrix().squaredNorm();
  if (!(total > 0) || !solution.allFinite()) return std::nullopt;
  for (std::size_t t = 0; t < terms.size(); ++t) {
    if (signs == Signs::kAny || solution(static_cast<Eigen::Index>(2 + t)) >= 0) continue;
    terms.erase(terms.begin() + static_cast<std::ptrdiff_t>(t));
    return FitLaw(rows, terms);
  }
  const double variance = residual / static_cast<double>(y.size() - columns);
  const Eigen::MatrixXd covariance = normal.ldlt().solve(Eigen::MatrixXd::Identity(columns, columns)) * variance;
  Fit fit{.kp = solution(0), .explained = 1 - residual / total, .error = std::sqrt(std::max(0.0, covariance(0, 0)))};
  for (std::size_t t = 0; t < terms.size(); ++t) {
    const double size = solution(static_cast<Eigen::Index>(2 + t));
    if (terms[t] == kDamping) fit.kd = size, fit.damped = true;
    if (terms[t] == kArmature) fit.armature = size;
  }
  return fit;
}

bool Counts(const Fit& fit) { return fit.kp > 0 && fit.explained > kExplains && fit.error < kKnown * fit.kp; }

std::string Percent(double share) { return std::to_string(std::lround(100 * share)) + " %"; }

class Fitter {
 public:
  Fitter(const mjModel& model, const std::vector<const Samples*>& logs, const std::vector<Guess>& guesses,
         const Pairing& pairing, const Scalings& scalings)
      : m_(model), logs_(logs), guesses_(guesses), p_(pairing), s_(scalings) {
    motions_ = MotionsOf(logs, guesses, pairing, scalings);
    torques_ = TorquesOf(model, pairing, motions_);
  }

  ServoGains Gains(std::size_t a) const {
    const ActuatorSlot& slot = p_.actuators[a];
    const bool fits = slot.wants == Quantity::kAngle && p_.commands[a].column >= 0 && !motions_[slot.joint].empty();
    if (fits && p_.torques[a].column >= 0) {
      if (const auto fit = Best(a, InSi(p_.torques[a], s_.torques[a]), {kDamping}); fit && Counts(*fit))
        return Fitted(a, *fit, Armature(a), "by regression of the measured torque, which it explains to ");
    }
    if (fits) {
      if (const auto fit = Best(a, torques_[slot.joint], kServo); fit && Counts(*fit)) {
        ServoGains gains =
            Fitted(a, *fit, fit->armature, "by regression of the torque that the motion takes, which it explains to ");
        if (gains.certain && !ScaleIsKnown(a, *fit)) {
          gains.certain = false;
          gains.doubt = "gains by the MJCF's inertia alone: a rotor that it lacks would make them larger";
        }
        return gains;
      }
    }
    return MadeUp(slot.joint);
  }

 private:
  // `late`: as it was so many rows earlier.
  std::vector<double> InSi(const Pick& pick, const Scaling& scaling, int late = 0) const {
    std::vector<double> values;
    for (const Samples* log : logs_) {
      for (const double v : log->values_before(guesses_[pick.column].column, late))
        values.push_back(scaling.factor * v + scaling.add);
    }
    return values;
  }

  // A target that is a guess itself leaves the gains one.
  ServoGains Fitted(std::size_t a, const Fit& fit, double armature, const std::string& from) const {
    const bool is_angle = s_.commands[a].certain || s_.commands[a].is_unit;
    const std::string doubt = !is_angle ? "gains by regression rest on a target whose scale is a guess itself"
                              : !fit.damped
                                  ? "kd of a regression came out below zero and is taken as 0: its kp may be off"
                                  : "";
    return {.kp = fit.kp,
            .kd = fit.kd,
            .limit = 0,
            .armature = armature,
            .from = from + Percent(fit.explained),
            .doubt = doubt,
            .certain = doubt.empty()};
  }

  // What the measured torque moves beside the model: a rotor. 0: it does not show.
  double Armature(std::size_t a) const {
    Rows rows = Of(a, InSi(p_.torques[a], s_.torques[a]), 0);
    const std::vector<double>& needed = torques_[p_.actuators[a].joint];
    for (std::size_t k = 0; k < needed.size(); ++k) {
      rows.torque[k] = needed[k] - rows.torque[k];
      rows.stretch[k] = -rows.acceleration[k];
    }
    const auto fit = FitLaw(rows, {kDamping, kFriction});
    return fit && fit->kp > 0 && fit->error < kKnown * fit->kp ? fit->kp : 0;
  }

  // A command may act late; the lateness that explains most is taken.
  std::optional<Fit> Best(std::size_t a, const std::vector<double>& torque, const std::vector<Term>& terms) const {
    std::optional<Fit> best;
    for (const int late : logs_.front()->Lags(kLatest_s, kLagStep_s)) {
      const auto fit = FitLaw(Of(a, torque, late), terms);
      if (!fit || (best && fit->explained <= best->explained)) continue;
      best = fit;
      best->late = late;
    }
    return best;
  }

  // Where nothing but inertia resists, gains and rotor are known up to one factor: a rotor that may take away from the
  // link's inertia takes the gains with it. Gravity, or a rotor without which the fit is worse, says how large they
  // are.
  bool ScaleIsKnown(std::size_t a, const Fit& fit) const {
    constexpr double kAsWell = 2;  // of what the fit leaves: noise of the acceleration is on both sides of it
    const Rows rows = Of(a, torques_[p_.actuators[a].joint], fit.late);
    const auto free = FitLaw(rows, kServo, Signs::kAny), bare = FitLaw(rows, {kDamping, kFriction});
    const auto agrees = [&](const std::optional<Fit>& other) {
      return other && std::abs(other->kp - fit.kp) < kKnown * fit.kp;
    };
    const bool as_well = bare && 1 - bare->explained <= kAsWell * (1 - fit.explained);
    return agrees(free) && (!as_well || agrees(bare));
  }

  Rows Of(std::size_t a, const std::vector<double>& torque, int late) const {
    Rows rows{.stretch = InSi(p_.commands[a], s_.commands[a], late), .speed = {}, .acceleration = {}, .torque = torque};
    const auto& motion = motions_[p_.actuators[a].joint];
    for (std::size_t k = 0; k < motion.size(); ++k) {
      rows.stretch[k] -= motion[k].value;
      rows.speed.push_back(motion[k].slope);
      rows.acceleration.push_back(motion[k].curvature);
    }
    return rows;
  }

  ServoGains MadeUp(int slot) const {
    const int dof = m_.jnt_dofadr[p_.joints[slot].joint];
    const double inertia = std::max(m_.dof_M0[dof], 1e-6), w = 2 * std::numbers::pi * kMadeUp_hz;
    const DataPtr data(mj_makeData(&m_));
    mj_forward(&m_, data.get());
    const double kp = std::max(inertia * w * w, std::abs(data->qfrc_bias[dof]) / kDroop_rad);
    return {.kp = kp,
            .kd = 2 * std::sqrt(kp * inertia),
            .limit = 0,
            .armature = 0,
            .from = "made up",
            .doubt =
                "the log does not tell the gains of every servo: some are made up; say them by --servo "
                "kp=K,kd=D[,limit=T][,armature=A]"};
  }

  const mjModel& m_;
  const std::vector<const Samples*>& logs_;
  const std::vector<Guess>& guesses_;
  const Pairing& p_;
  const Scalings& s_;
  Motions motions_;
  std::vector<std::vector<double>> torques_;  // per joint
};

}  // namespace

std::vector<ServoGains> FitServos(const mjModel& model, const std::vector<const Samples*>& logs,
                                  const std::vector<Guess>& guesses, const Pairing& pairing, const Scalings& scalings) {
  const Fitter fitter(model, logs, guesses, pairing, scalings);
  std::vector<ServoGains> gains;
  gains.reserve(pairing.actuators.size());
  for (std::size_t a = 0; a < pairing.actuators.size(); ++a) gains.push_back(fitter.Gains(a));
  return gains;
}

void AddArmature(const mjModel& model, const Pairing& pairing, std::vector<ServoGains>* gains) {
  constexpr double kStiffest = 0.06, kDampest = 0.5;  // of kp h^2 and kd h in inertias
  const DataPtr data(mj_makeData(&model));
  mj_forward(&model, data.get());
  std::vector<double> unit(static_cast<std::size_t>(model.nv)), moved(unit.size());
  for (std::size_t a = 0; a < gains->size(); ++a) {
    ServoGains& g = (*gains)[a];
    const int dof = model.jnt_dofadr[pairing.joints[pairing.actuators[a].joint].joint];
    if (g.armature > 0 || model.dof_armature[dof] > 0) continue;
    // What the joint feels while the others are free to give way.
    std::ranges::fill(unit, 0);
    unit[static_cast<std::size_t>(dof)] = 1;
    mj_solveM(&model, data.get(), moved.data(), unit.data(), 1);
    const double inertia = 1 / moved[static_cast<std::size_t>(dof)], h = model.opt.timestep;
    const double needed = std::max(g.kp * h * h / kStiffest, g.kd * h / kDampest);
    if (needed <= inertia) continue;
    g.armature = needed - inertia;
    g.armature_made_up = true;
  }
}

}  // namespace gapscope
