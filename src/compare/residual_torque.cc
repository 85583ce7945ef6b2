#include "src/compare/residual_torque.h"

#include <algorithm>
#include <cmath>

#include "replay/simulator.h"
#include "src/core/statistics.h"
#include "src/experiment/local_fit.h"

namespace gapscope {
namespace {

constexpr double kHalfWidth_s = 0.02;

// Limits that hold the middle 99 % of the values, so that one outlier does not squeeze the map.
std::vector<double> Edges(std::vector<double> values, std::size_t count) {
  std::sort(values.begin(), values.end());
  const auto at = [&](double share) {
    return values[static_cast<std::size_t>(share * static_cast<double>(values.size() - 1))];
  };
  double low = at(0.005), high = at(0.995);
  if (!(high > low)) low -= 0.5, high += 0.5;
  std::vector<double> edges(count + 1);
  for (std::size_t i = 0; i <= count; ++i)
    edges[i] = low + (high - low) * static_cast<double>(i) / static_cast<double>(count);
  return edges;
}

}  // namespace

std::vector<ResidualTorque> EstimateResidualTorque(const Model& model, std::span<const double> values,
                                                   const Recording& recording, std::size_t most_rows) {
  const mjModel& m = model.compiled();
  struct Joint {
    const Recording::Measured* measured;
    const SignalSource* source;
  };
  std::vector<Joint> joints;
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model.source(measured.index);
    if (TraitsOf(source.kind).gives_angle) joints.push_back({&measured, &source});
  }
  if (joints.size() != static_cast<std::size_t>(m.njnt) || m.nv != m.njnt || recording.rows() < 8) return {};
  Simulator simulator(model, 0);
  if (!simulator.SetParameters(values, recording)) return {};
  mjData* d = &simulator.data();
  const mjModel* written = &simulator.mujoco_model();

  // Speeds at all rows first: accelerations are their slopes.
  const std::size_t rows = recording.rows();
  const std::size_t stride = std::max<std::size_t>(1, rows / most_rows);
  const std::size_t reach = std::max<std::size_t>(
      1, static_cast<std::size_t>(kHalfWidth_s / std::max(recording.timeline.median_step_s, 1e-6)));
  std::vector<ResidualTorque> residuals(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) residuals[j].joint = joints[j].measured->spec.on;
  mj_resetData(written, d);
  for (std::size_t row = reach; row + reach < rows; row += stride) {
    bool known = true;
    for (const Joint& joint : joints) {
      const auto speed_at = [&](std::size_t r) {
        return FitLocally(recording, *joint.measured, r, kHalfWidth_s).slope;
      };
      const double offset = joint.source->offset >= 0 ? values[joint.source->offset] : 0;
      d->qpos[joint.source->qpos] = joint.measured->values[row] - offset;
      d->qvel[joint.source->dof] = speed_at(row);
      d->qacc[joint.source->dof] = (speed_at(row + reach) - speed_at(row - reach)) /
                                   (recording.time_s[row + reach] - recording.time_s[row - reach]);
      known = known && std::isfinite(d->qpos[joint.source->qpos]) && std::isfinite(d->qacc[joint.source->dof]);
    }
    if (!known) continue;
    for (std::size_t c = 0; c < recording.commands.size(); ++c)
      d->ctrl[model.command_actuators()[c]] = recording.commands[c].values[row];
    mj_inverse(written, d);
    mj_fwdActuation(written, d);
    for (std::size_t j = 0; j < joints.size(); ++j) {
      const int dof = joints[j].source->dof;
      residuals[j].angle_rad.push_back(d->qpos[joints[j].source->qpos]);
      residuals[j].speed_rad_per_s.push_back(d->qvel[dof]);
      residuals[j].torque_n_m.push_back(d->qfrc_inverse[dof] - d->qfrc_actuator[dof]);
    }
  }
  return residuals;
}

TorqueMap MapTorque(const ResidualTorque& residual, std::size_t angles, std::size_t speeds, std::size_t least) {
  TorqueMap map{
      .joint = residual.joint, .angle_edges_rad = {}, .speed_edges_rad_per_s = {}, .mean_n_m = {}, .rows = {}};
  if (residual.torque_n_m.empty()) return map;
  map.angle_edges_rad = Edges(residual.angle_rad, angles);
  map.speed_edges_rad_per_s = Edges(residual.speed_rad_per_s, speeds);
  map.mean_n_m.assign(angles * speeds, 0);
  map.rows.assign(angles * speeds, 0);
  const auto cell = [](const std::vector<double>& edges, double value) {
    const double share = (value - edges.front()) / (edges.back() - edges.front());
    return static_cast<long>(std::floor(share * static_cast<double>(edges.size() - 1)));
  };
  for (std::size_t r = 0; r < residual.torque_n_m.size(); ++r) {
    const long x = cell(map.angle_edges_rad, residual.angle_rad[r]),
               y = cell(map.speed_edges_rad_per_s, residual.speed_rad_per_s[r]);
    if (x < 0 || y < 0 || x >= static_cast<long>(angles) || y >= static_cast<long>(speeds)) continue;
    const std::size_t at = static_cast<std::size_t>(y) * angles + static_cast<std::size_t>(x);
    map.mean_n_m[at] += residual.torque_n_m[r];
    ++map.rows[at];
  }
  for (std::size_t i = 0; i < map.rows.size(); ++i)
    map.mean_n_m[i] = map.rows[i] >= least ? map.mean_n_m[i] / static_cast<double>(map.rows[i]) : kNaN;
  return map;
}

}  // namespace gapscope
