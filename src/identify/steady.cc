// Equivalent viscous damping from speeds that have settled: the drive's torque at each, against the speed. Source:
// "Quanser Qube 2 - Report", 2.2 (equivalent viscous damping).
#include <algorithm>
#include <cmath>

#include "replay/initial_state.h"
#include "src/core/statistics.h"
#include "src/identify/filter.h"
#include "src/identify/plateaus.h"
#include "src/identify/regression.h"
#include "src/model/parameter_writer.h"

namespace gapscope {
namespace {

// What still accelerates would count inertia as friction; what stands still says only that the drive is below dry
// friction. Returns how many turn but have not settled.
std::size_t KeepSettled(std::vector<Plateau>* plateaus) {
  double fastest = 0;
  for (const auto& p : *plateaus) fastest = std::max(fastest, std::isfinite(p.speed) ? std::abs(p.speed) : 0);
  std::size_t unsettled = 0;
  std::erase_if(*plateaus, [&](const Plateau& p) {
    const bool settled =
        std::isfinite(p.speed) && std::abs(p.acceleration) * (p.to_s - p.from_s) < 0.02 * std::abs(p.speed);
    const bool turns = std::abs(p.speed) > 0.02 * fastest;
    unsettled += turns && !settled ? 1 : 0;
    return !settled || !turns;
  });
  return unsettled;
}

// The drive's torque at each plateau: logged, or the model's at its command and speed.
Result<std::vector<double>> DriveTorques(const IdentifyInput& input, int joint, const std::vector<Plateau>& plateaus) {
  const mjModel& base = input.model.compiled();
  const ModelPtr m(mj_copyModel(nullptr, &base));
  const DataPtr d(mj_makeData(m.get()));
  const int dof = base.jnt_dofadr[joint];
  std::vector<double> drive;
  for (const auto& p : plateaus) {
    const Recording& recording = input.recordings[static_cast<std::size_t>(p.log)];
    StandHeldBodies(input.model, recording, input.values, m.get());
    ParameterWriter writer(input.model, m.get(), d.get());
    if (!writer.Write(input.values, recording.values))
      return Error{.what = "the parameters make no model", .where = input.model.experiment().path};
    mj_resetData(m.get(), d.get());
    d->qvel[dof] = p.speed;
    d->ctrl[input.model.command_actuators().front()] = p.command;
    mj_fwdPosition(m.get(), d.get());
    mj_fwdVelocity(m.get(), d.get());
    mj_fwdActuation(m.get(), d.get());
    drive.push_back(std::isfinite(p.torque) ? p.torque : d->qfrc_actuator[dof]);
  }
  return drive;
}

Status NeedsBothDirections(const std::vector<Plateau>& plateaus, std::size_t unsettled, const std::string& log_path) {
  std::size_t forward = 0;
  for (const auto& p : plateaus) forward += p.speed > 0 ? 1 : 0;
  if (plateaus.size() >= 4 && forward >= 2 && plateaus.size() - forward >= 2) return Ok();
  return Error{.what = "fewer than two settled speeds in each direction",
               .where = log_path,
               .actual = std::to_string(forward) + " forward, " + std::to_string(plateaus.size() - forward) +
                         " backward, " + std::to_string(unsettled) + " still accelerating",
               .cure = "hold each command until the speed has settled, 0.3 s or more"};
}

// Damping and dry friction, the latter held where `coulomb_n_m` is not below zero. Each settled speed is one reading:
// ordinary least squares, Student's intervals.
void AddFriction(const std::vector<Plateau>& plateaus, const std::vector<double>& drive, double coulomb_n_m,
                 Identification* result) {
  const bool fixed = coulomb_n_m >= 0;
  const Eigen::Index n = static_cast<Eigen::Index>(plateaus.size()), k = fixed ? 1 : 2;
  Eigen::MatrixXd x(n, k);
  Eigen::VectorXd y(n);
  for (Eigen::Index i = 0; i < n; ++i) {
    const Plateau& p = plateaus[static_cast<std::size_t>(i)];
    const double sign = p.speed > 0 ? 1 : -1;
    x(i, 0) = p.speed;
    if (!fixed) x(i, 1) = sign;
    y[i] = drive[static_cast<std::size_t>(i)] - (fixed ? coulomb_n_m * sign : 0);
  }
  const Eigen::MatrixXd inverse = (x.transpose() * x).ldlt().solve(Eigen::MatrixXd::Identity(k, k));
  const Eigen::VectorXd beta = inverse * x.transpose() * y, residual = y - x * beta;
  const double scatter = residual.squaredNorm() / static_cast<double>(std::max<Eigen::Index>(1, n - k)),
               t = StudentQuantile(static_cast<double>(n - k));
  const auto estimate = [&](Eigen::Index i, const char* name, const char* unit) {
    const double half = t * std::sqrt(scatter * inverse(i, i));
    result->values.push_back(
        {.name = name, .unit = unit, .value = beta[i], .low = beta[i] - half, .high = beta[i] + half});
  };
  estimate(0, "viscous", "N m s/rad");
  if (!fixed) {
    estimate(1, "coulomb", "N m");
  } else {
    result->values.push_back({.name = "coulomb", .unit = "N m", .value = coulomb_n_m, .low = kNaN, .high = kNaN});
  }
  const double spread = (y.array() - y.mean()).square().sum();
  result->r2 = spread > 0 ? 1 - residual.squaredNorm() / spread : 0;
  result->rmse = std::sqrt(residual.squaredNorm() / static_cast<double>(n));
  result->rows = plateaus.size();
}

// Speed per command in one direction: a line through its own points.
Estimate SpeedPerCommand(const std::vector<Plateau>& plateaus, int sign, const std::string& command_unit) {
  double cc = 0, cs = 0, count = 0;
  for (const auto& p : plateaus) {
    if (p.speed * sign > 0) cc += p.command * p.command, cs += p.command * p.speed, count += 1;
  }
  double rest = 0;
  for (const auto& p : plateaus) {
    if (p.speed * sign > 0) rest += std::pow(p.speed - cs / cc * p.command, 2);
  }
  const double half = StudentQuantile(count - 1) * std::sqrt(rest / std::max(1.0, count - 1) / cc);
  return {.name = sign > 0 ? "speed_per_command_positive" : "speed_per_command_negative",
          .unit = "rad/s per " + command_unit,
          .value = cs / cc,
          .low = cs / cc - half,
          .high = cs / cc + half};
}

}  // namespace

Result<Identification> IdentifySteady(const IdentifyInput& input, const IdentifyOptions& options) {
  GS_ASSIGN(const int joint, DrivenJoint(input.model, options.joint));
  std::vector<Plateau> plateaus = FindPlateaus(input, joint, {}, options, 0.3);
  const std::size_t unsettled = KeepSettled(&plateaus);
  GS_ASSIGN(const std::vector<double> drive, DriveTorques(input, joint, plateaus));
  GS_RETURN_IF_ERROR(NeedsBothDirections(plateaus, unsettled, input.recordings.front().log_path));
  Identification result{.method = "steady",
                        .relation = "drive(command, speed) = viscous speed + coulomb sign(speed), settled",
                        .unit = "N m"};
  AddFriction(plateaus, drive, options.coulomb_n_m, &result);
  const std::string& unit = input.model.experiment().commands.front().unit;
  const Estimate plus = SpeedPerCommand(plateaus, 1, unit), minus = SpeedPerCommand(plateaus, -1, unit);
  result.values.insert(result.values.end(), {plus, minus});
  if (plus.low > minus.high || minus.low > plus.high)
    result.remarks.push_back("the two directions settle at different speeds");
  if (unsettled > 0)
    result.remarks.push_back(std::to_string(unsettled) + " plateaus still accelerate and are left out");
  result.remarks.push_back(
      "with nominal kt, km and R this damping holds their errors too: it makes the model settle where the rig does");
  PointTable table{.name = "points", .columns = {"command", "speed_rad_per_s", "drive_n_m"}, .rows = {}};
  for (std::size_t i = 0; i < plateaus.size(); ++i)
    table.rows.push_back({plateaus[i].command, plateaus[i].speed, drive[i]});
  result.tables.push_back(std::move(table));
  return result;
}

}  // namespace gapscope
