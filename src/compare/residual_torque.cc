#include "src/compare/residual_torque.h"

#include <algorithm>
#include <cmath>

#include "replay/initial_state.h"
#include "replay/simulator.h"
#include "src/core/statistics.h"
#include "src/experiment/local_fit.h"

namespace gapscope {
namespace {

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

struct MeasuredJoint {
  const Recording::Measured* measured;
  const SignalSource* source;
};

// All of a short log; of a long one even stretches, evenly spread, of so many rows together.
std::vector<Window> Stretches(std::size_t rows, std::size_t most_rows) {
  constexpr std::size_t kStretches = 16;
  if (rows <= most_rows) return {{0, rows}};
  std::vector<Window> stretches;
  for (std::size_t i = 0; i < kStretches; ++i) {
    const std::size_t begin = i * rows / kStretches;
    stretches.push_back({begin, begin + most_rows / kStretches});
  }
  return stretches;
}

// Of one stretch; all by its rows, and in each by joint.
class Stretch {
 public:
  Stretch(const std::vector<MeasuredJoint>& joints, const Recording& recording, Window window)
      : joints_(joints), recording_(recording), window_(window), count_(joints.size()) {
    const double step_s = std::max(recording.timeline.median_step_s, 1e-6);
    reach_ = std::max<std::size_t>(1, static_cast<std::size_t>(kInitialFitHalfWidth_s / step_s));
  }

  void Estimate(Simulator& simulator, std::vector<ResidualTorque>* residuals) {
    if (window_.rows() <= 2 * reach_) return;
    FindAccelerations();
    Follow(simulator);
    if (rest_.empty()) return;
    for (std::size_t j = 0; j < count_; ++j) AddTo(j, (*residuals)[j]);
  }

 private:
  std::size_t At(std::size_t row, std::size_t joint) const { return row * count_ + joint; }

  // What passed between two speeds, over the time between them.
  void FindAccelerations() {
    std::vector<double> speeds;
    for (std::size_t row = window_.begin; row < window_.end; ++row) {
      for (const MeasuredJoint& joint : joints_)
        speeds.push_back(FitLocally(recording_, *joint.measured, row, kInitialFitHalfWidth_s).slope);
    }
    accelerations_.assign(speeds.size(), 0);
    for (std::size_t k = reach_; k + reach_ < window_.rows(); ++k) {
      const auto stamp = recording_.time_s.begin() + static_cast<std::ptrdiff_t>(window_.begin + k);
      const auto reach = static_cast<std::ptrdiff_t>(reach_);
      for (std::size_t j = 0; j < count_; ++j)
        accelerations_[At(k, j)] =
            (speeds[At(k + reach_, j)] - speeds[At(k - reach_, j)]) / (stamp[reach] - stamp[-reach]);
    }
  }

  void Follow(Simulator& simulator) {
    const mjModel* m = &simulator.mujoco_model();
    mjData* d = &simulator.data();
    std::vector<mjtNum> inertia(static_cast<std::size_t>(m->nv));
    simulator.Drag(recording_, window_, [&](std::size_t row) {
      for (std::size_t j = 0; j < count_; ++j)
        d->qacc[joints_[j].source->dof] = accelerations_[At(row - window_.begin, j)];
      mj_inverse(m, d);
      mj_fwdActuation(m, d);
      mj_mulM(m, d, inertia.data(), d->qacc);
      for (const MeasuredJoint& joint : joints_) {
        const int dof = joint.source->dof;
        angles_.push_back(d->qpos[joint.source->qpos]);
        speeds_.push_back(d->qvel[dof]);
        inertia_.push_back(inertia[static_cast<std::size_t>(dof)]);
        rest_.push_back(d->qfrc_inverse[dof] - d->qfrc_actuator[dof] - inertia_.back());
      }
    });
  }

  bool IsKnown(std::size_t k) const {
    return std::ranges::all_of(
        joints_, [&](const MeasuredJoint& joint) { return std::isfinite(joint.measured->values[window_.begin + k]); });
  }

  // All other torques are means over the same time as the acceleration, which at 10 Hz is a quarter too small.
  void AddTo(std::size_t j, ResidualTorque& residual) const {
    double sum = 0;
    for (std::size_t k = 0; k < 2 * reach_; ++k) sum += rest_[At(k, j)];
    for (std::size_t k = reach_; k + reach_ < window_.rows(); ++k) {
      sum += rest_[At(k + reach_, j)];
      if (IsKnown(k)) {
        residual.angle_rad.push_back(angles_[At(k, j)]);
        residual.speed_rad_per_s.push_back(speeds_[At(k, j)]);
        residual.torque_n_m.push_back(inertia_[At(k, j)] + sum / static_cast<double>(2 * reach_ + 1));
      }
      sum -= rest_[At(k - reach_, j)];
    }
  }

  const std::vector<MeasuredJoint>& joints_;
  const Recording& recording_;
  Window window_;
  std::size_t count_ = 0, reach_ = 1;
  std::vector<double> accelerations_, angles_, speeds_;
  std::vector<double> inertia_, rest_;  // mass matrix times acceleration; all other torques
};

}  // namespace

std::vector<ResidualTorque> EstimateResidualTorque(const Model& model, std::span<const double> values,
                                                   const Recording& recording, std::size_t most_rows) {
  const mjModel& m = model.compiled();
  std::vector<MeasuredJoint> joints;
  double late_s = kInfinity;
  for (const auto& measured : recording.measured) {
    const SignalSource& source = model.source(measured.index);
    if (!TraitsOf(source.kind).gives_angle) continue;
    joints.push_back({&measured, &source});
    late_s = std::min(late_s, source.delay >= 0 ? values[static_cast<std::size_t>(source.delay)] : 0);
  }
  if (joints.size() != static_cast<std::size_t>(m.njnt) || m.nv != m.njnt || recording.rows() < 8) return {};
  Simulator simulator(model, 0);
  simulator.set_stamps({.commands_s = late_s});  // what is logged late was moved by a command as much before
  if (!simulator.SetParameters(values, recording)) return {};
  std::vector<ResidualTorque> residuals(joints.size());
  for (std::size_t j = 0; j < joints.size(); ++j) residuals[j].joint = joints[j].measured->spec.on;
  for (const Window& window : Stretches(recording.rows(), most_rows))
    Stretch(joints, recording, window).Estimate(simulator, &residuals);
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
