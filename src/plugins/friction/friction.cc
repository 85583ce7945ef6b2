#include "src/plugins/friction/friction.h"

#include <algorithm>
#include <string>

#include "src/plugins/common/refusal.h"
#include "src/plugins/common/register.h"

namespace gapscope::plugins {
namespace {

// The position of `dof` in row `row` of a sparse matrix, or -1.
int FindColumn(const int* row_nonzeros, const int* row_address, const int* column, int row, int dof) {
  for (int i = row_address[row]; i < row_address[row] + row_nonzeros[row]; ++i) {
    if (column[i] == dof) return i;
  }
  return -1;
}

}  // namespace

std::unique_ptr<Friction> Friction::Create(const mjModel* m, int instance) {
  auto friction = std::make_unique<Friction>();
  friction->scratch_ = std::make_unique<mjtNum[]>(2 * static_cast<std::size_t>(m->nv));
  const std::string structure = friction->ResolveStructure(m, instance);
  const std::string values = friction->ResolveValues(m, instance);
  if (!structure.empty()) {
    if (Refuse(m, structure)) return nullptr;
    friction->inert_ = true;
  } else if (!values.empty() && IsCompiling(m)) {  // the live values of a finished model are its host's
    Refuse(m, values);
    return nullptr;
  }
  return friction;
}

std::string Friction::ResolveStructure(const mjModel* m, int instance) {
  state_address_ = m->plugin_stateadr[instance];
  if (std::string fault = ResolveJoint(m, instance, &joint_); !fault.empty()) return fault;
  dof_ = m->jnt_dofadr[joint_];
  angle_address_ = m->jnt_qposadr[joint_];

  const std::string_view load = ConfigText(m, instance, "load");
  if (load == "gearbox") load_ = Load::kGearbox;
  if (!load.empty() && load != "gearbox" && load != "motor") {
    return Fault(m, instance, "load", std::string(load), "motor, gearbox", "leave it out for motor");
  }
  const std::string_view model = ConfigText(m, instance, "model");
  if (model == "lugre") model_ = Model::kLugre;
  if (!model.empty() && model != "lugre" && model != "dry") {
    return Fault(m, instance, "model", std::string(model), "dry, lugre", "leave it out for dry");
  }
  const std::string joint_name(ConfigText(m, instance, "joint"));
  if (m->dof_frictionloss[dof_] <= 0 && model_ == Model::kDry) {
    return "plugin instance '" + InstanceName(m, instance) + "': joint '" + joint_name + "' has frictionloss " +
           std::to_string(m->dof_frictionloss[dof_]) +
           ", allowed above 0: without it the solver has no row to rewrite; set frictionloss=\"1e-9\" on the joint";
  }
  for (int other = 0; other < m->nplugin; ++other) {
    if (other != instance && m->plugin[other] == m->plugin[instance] && ConfigText(m, other, "joint") == joint_name) {
      return Fault(m, instance, "joint", joint_name, "one " + std::string(kName) + " per joint",
                   "the instance '" + InstanceName(m, other) + "' is on it too: put all terms in one");
    }
  }
  return CheckTurn(m, instance);
}

std::string Friction::ResolveValues(const mjModel* m, int instance) {
  if (std::string fault = value_.Resolve(m, instance, kSpecs); !fault.empty()) return fault;
  if (model_ == Model::kLugre && !(value_(m, kSigma0) > 0)) {
    return Fault(m, instance, "sigma0_n_m_per_rad", std::to_string(value_(m, kSigma0)), "above 0 with model lugre",
                 "set it, as a rule to 100-10000 times the friction in N m, or use model dry");
  }
  std::array<const char*, kKeyCount> keys;
  std::transform(kSpecs.begin(), kSpecs.end(), keys.begin(), [](const ParameterSpec& spec) { return spec.key; });
  return UnknownNumeric(m, instance, keys.data(), kKeyCount);
}

// Lists the joint's drives and this instance's own actuator elements. MuJoCo runs actuator plugins in the order of
// their instances, so a motor plugin that comes later has not spoken yet when this one's turn comes.
std::string Friction::CheckTurn(const mjModel* m, int instance) {
  for (int i = 0; i < m->nactuator; ++i) {
    const int end = m->actuator_outadr[i] + m->actuator_outnum[i];
    if (m->actuator_plugin[i] == instance) {
      for (int out = m->actuator_outadr[i]; out < end; ++out) own_outputs_.push_back(out);
      continue;
    }
    const bool on_joint = m->actuator_trntype[i] == mjTRN_JOINT || m->actuator_trntype[i] == mjTRN_JOINTINPARENT;
    if (!on_joint || m->actuator_trnid[2 * i] == joint_) drives_.push_back(i);
  }
  for (const int i : drives_) {
    const int other = m->actuator_plugin[i];
    if (other <= instance || m->plugin[other] == m->plugin[instance]) continue;
    last_in_turn_ = false;
    if (own_outputs_.empty()) continue;
    return "plugin instance '" + InstanceName(m, instance) + "': it stands before the actuator plugin instance '" +
           InstanceName(m, other) + "' that drives its joint, allowed only after it; move its <plugin plugin=\"" +
           kName + "\"> to the end of <extension>";
  }
  return {};
}

DryFriction Friction::Law(const mjModel* m) const {
  return {.coulomb_n_m = value_(m, kFriction),
          .breakaway_n_m = value_(m, kBreakaway),
          .stribeck_speed_rad_per_s = value_(m, kStribeckSpeed),
          .stribeck_exponent = value_(m, kStribeckExponent),
          .positive_n_m = value_(m, kFrictionPositive),
          .negative_n_m = value_(m, kFrictionNegative),
          .load_coefficient = value_(m, kLoadCoefficient),
          .load_quadratic_per_n_m = value_(m, kLoadQuadratic),
          .backdrive_factor = value_(m, kBackdriveFactor)};
}

bool Friction::NeedsDirection(const DryFriction& law) const {
  const bool loaded = law.load_coefficient != 0 || law.load_quadratic_per_n_m != 0;
  return law.positive_n_m != law.negative_n_m || (loaded && law.backdrive_factor != 1);
}

double Friction::ViscousTorque(const mjModel* m, double speed) const {
  const double side = value_(m, speed > 0 ? kViscousPositive : kViscousNegative);
  return -(value_(m, kViscous) + side + value_(m, kQuadratic) * std::abs(speed)) * speed;
}

// What qfrc_actuator will be at the joint: MuJoCo clamps forces only after the last actuator plugin.
double Friction::ActuatorTorque(const mjModel* m, const mjData* d) const {
  double torque = 0;
  for (const int i : drives_) {
    const int end = m->actuator_outadr[i] + m->actuator_outnum[i];
    for (int out = m->actuator_outadr[i]; out < end; ++out) {
      double force = d->actuator_force[out];
      if (force == 0) continue;
      const int at = FindColumn(d->moment_rownnz, d->moment_rowadr, d->moment_colind, out, dof_);
      if (at < 0) continue;
      if (m->actuator_forcelimited[i]) {
        force = std::clamp(force, m->actuator_forcerange[2 * i], m->actuator_forcerange[2 * i + 1]);
      }
      torque += d->actuator_moment[at] * force;
    }
  }
  if (m->jnt_actgravcomp[joint_]) torque += d->qfrc_gravcomp[dof_];
  if (m->jnt_actfrclimited[joint_]) {
    torque = std::clamp(torque, m->jnt_actfrcrange[2 * joint_], m->jnt_actfrcrange[2 * joint_ + 1]);
  }
  return torque;
}

// Gravity, Coriolis, springs and applied forces at the joint; no damping and nothing of this plugin: that is friction.
double Friction::ExternalTorque(mjData* d) const {
  const double passive = d->qfrc_passive[dof_] - d->qfrc_damper[dof_] - StateOf(d).own_n_m;
  return passive - d->qfrc_bias[dof_] + d->qfrc_applied[dof_];
}

// The joint's acceleration without constraints: its sign tells which way the joint starts, other joints' pull included.
double Friction::FreeAcceleration(const mjModel* m, mjData* d) const {
  mjtNum* const force = scratch_.get();
  mjtNum* const acceleration = scratch_.get() + m->nv;
  for (int i = 0; i < m->nv; ++i) force[i] = d->qfrc_passive[i] - d->qfrc_bias[i] + d->qfrc_applied[i];
  for (int i = 0; i < m->nactuator; ++i) {
    const int end = m->actuator_outadr[i] + m->actuator_outnum[i];
    for (int out = m->actuator_outadr[i]; out < end; ++out) {
      double f = d->actuator_force[out];
      if (m->actuator_forcelimited[i]) {
        f = std::clamp(f, m->actuator_forcerange[2 * i], m->actuator_forcerange[2 * i + 1]);
      }
      for (int k = d->moment_rowadr[out]; k < d->moment_rowadr[out] + d->moment_rownnz[out]; ++k) {
        force[d->moment_colind[k]] += d->actuator_moment[k] * f;
      }
    }
  }
  for (int body = 1; body < m->nbody; ++body) {
    const mjtNum* f = d->xfrc_applied + 6 * body;
    if (std::any_of(f, f + 6, [](mjtNum x) { return x != 0; })) {
      mj_applyFT(m, d, f, f + 3, d->xipos + 3 * body, body, force);
    }
  }
  mj_solveM(m, d, acceleration, force, 1);
  return acceleration[dof_];
}

double Friction::Level(const mjModel* m, const DryFriction& law, double speed, double drive, double external,
                       double free_acceleration) const {
  const double next = speed + m->opt.timestep * free_acceleration;
  const int direction = (next > 0) - (next < 0);
  return DryLevel(law, speed, direction, load_ == Load::kMotor ? drive : drive - external, drive);
}

void Friction::WriteRow(const mjModel* m, mjData* d, double level, bool soften) const {
  for (int row = d->ne; row < d->ne + d->nf; ++row) {
    if (d->efc_type[row] != mjCNSTR_FRICTION_DOF || d->efc_id[row] != dof_) continue;
    // Newton and CG read the island's copy.
    const int island_row = d->nisland > 0 ? d->map_efc2iefc[row] : -1;
    d->efc_frictionloss[row] = level;
    if (island_row >= 0) d->iefc_frictionloss[island_row] = level;
    const double softness = soften ? value_(m, kRowSoftness) : 1;
    if (softness == 1) return;
    // MuJoCo's softest part of a row is R = (1 - impedance)/impedance A: less of it, less creep.
    const double impedance = d->efc_KBIP[4 * row + 2];
    const double native = d->efc_diagA[row] * (1 - impedance) / impedance;
    const double r = std::max(softness * native, mjMINVAL);
    if (d->nA > 0) {
      // PGS solves with A + R, projected before this.
      const bool sparse = d->efc_AR_rownnz != nullptr;
      const int at =
          sparse ? FindColumn(d->efc_AR_rownnz, d->efc_AR_rowadr, d->efc_AR_colind, row, row) : row * d->nefc + row;
      if (at >= 0) d->efc_AR[at] += r - d->efc_R[row];
    }
    d->efc_R[row] = r;
    d->efc_D[row] = 1 / r;
    if (island_row >= 0) {
      d->iefc_R[island_row] = r;
      d->iefc_D[island_row] = 1 / r;
    }
    return;
  }
}

void Friction::Compute(const mjModel* m, mjData* d, int capability) const {
  if (capability & mjPLUGIN_PASSIVE) ComputePassive(m, d);
  if (capability & mjPLUGIN_ACTUATOR) ComputeActuator(m, d);
}

void Friction::ComputePassive(const mjModel* m, mjData* d) const {
  if (inert_) return;
  State& state = StateOf(d);
  const DryFriction law = Law(m);
  const double speed = d->qvel[dof_];
  const double level = Level(m, law, speed, state.drive_n_m, state.external_n_m,
                             NeedsDirection(law) ? state.free_acceleration_rad_per_s2 : 0);
  double torque = ViscousTorque(m, speed);
  if (model_ == Model::kDry) {
    WriteRow(m, d, level, true);
  } else {
    WriteRow(m, d, 0, false);
    const double sigma0 = value_(m, kSigma0);
    const double shift = state.bristle.Displacement(d->qpos[angle_address_], d->time, m->opt.timestep);
    const double bend = BendBristle(state.bristle.bend, shift, level / sigma0);
    torque -= level * bend + value_(m, kSigma1) * (speed - std::abs(speed) * bend);
  }
  state.own_n_m = torque;
  d->qfrc_passive[dof_] += torque;
}

void Friction::ComputeActuator(const mjModel* m, mjData* d) const {
  for (const int out : own_outputs_) d->actuator_force[out] = 0;
  if (inert_ || !last_in_turn_ || model_ == Model::kLugre) return;
  const DryFriction law = Law(m);
  const bool loaded = law.load_coefficient != 0 || law.load_quadratic_per_n_m != 0;
  const bool directed = NeedsDirection(law);
  if (!loaded && !directed) return;
  const double drive = loaded ? ActuatorTorque(m, d) : 0;
  const double external = loaded && load_ == Load::kGearbox ? ExternalTorque(d) : 0;
  WriteRow(m, d, Level(m, law, d->qvel[dof_], drive, external, directed ? FreeAcceleration(m, d) : 0), false);
}

void Friction::Advance(const mjModel* m, mjData* d) const {
  if (inert_) return;
  State& state = StateOf(d);
  if (model_ == Model::kLugre) {
    const double q = d->qpos[angle_address_];
    const double shift = q - state.bristle.angle_rad;
    const double level = Level(m, Law(m), shift / m->opt.timestep, state.drive_n_m, state.external_n_m,
                               state.free_acceleration_rad_per_s2);
    state.bristle.Settle(BendBristle(state.bristle.bend, shift, level / value_(m, kSigma0)), q, d->time);
  }
  state.drive_n_m = d->qfrc_actuator[dof_];
  state.external_n_m = ExternalTorque(d);
  state.free_acceleration_rad_per_s2 = d->qacc_smooth[dof_];
}

void RegisterFriction() {
  static const std::vector<const char*> attributes = AttributesOf(Friction::kSpecs, {"joint", "load", "model"});
  const mjpPlugin plugin = PluginOf<Friction>(
      Friction::kName, mjPLUGIN_PASSIVE | mjPLUGIN_ACTUATOR, attributes,
      +[](const mjModel*, int) { return Friction::kStateSize; });
  mjp_registerPlugin(&plugin);
}

}  // namespace gapscope::plugins
