// gapscope.friction: dry, viscous and quadratic friction of one hinge or slide joint, with true stick.
//
// A friction torque that is a steep function of speed creeps under load and needs tiny steps. MuJoCo's constraint
// solver sticks: a joint with `frictionloss` gets a row whose force is whatever stops the joint, up to a level. This
// plugin rewrites that level on every compute, from speed, direction and transmitted torque (law.h), and adds viscous
// and quadratic drag as passive torque. Alternatively the LuGre model, whose bristle gives presliding motion:
//   dz/dt = w - sigma0 |w| z / level,  torque = -(sigma0 z + sigma1 dz/dt)
// Attributes, recipe and limits: README.md in this folder.
#ifndef GAPSCOPE_PLUGINS_FRICTION_FRICTION_H_
#define GAPSCOPE_PLUGINS_FRICTION_FRICTION_H_

#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <vector>

#include "src/plugins/common/bristle.h"
#include "src/plugins/common/parameters.h"
#include "src/plugins/friction/law.h"

namespace gapscope::plugins {

class Friction {
 public:
  enum Key {
    kFriction,
    kBreakaway,
    kStribeckSpeed,
    kStribeckExponent,
    kViscous,
    kQuadratic,
    kLoadCoefficient,
    kLoadQuadratic,
    kFrictionPositive,
    kFrictionNegative,
    kViscousPositive,
    kViscousNegative,
    kBackdriveFactor,
    kRowSoftness,
    kSigma0,
    kSigma1,
    kKeyCount
  };
  static constexpr const char* kName = "gapscope.friction";
  static constexpr std::array<ParameterSpec, kKeyCount> kSpecs = {{
      {"friction_n_m", "N m", 0, 0, kUnlimited, Combine::kSum, Needs::kNothing, "frictionloss"},
      {"breakaway_n_m", "N m", 0, 0, kUnlimited},
      {"stribeck_speed_rad_per_s", "rad/s", 0.05, 0, kUnlimited},
      {"stribeck_exponent", "1", 2, 0.1, 20},
      {"viscous_n_m_s_per_rad", "N m s/rad", 0, 0, kUnlimited},
      {"quadratic_n_m_s2_per_rad2", "N m s^2/rad^2", 0, 0, kUnlimited, Combine::kSum, Needs::kNothing,
       "damping_quadratic"},
      {"load_coefficient", "1", 0, 0, kUnlimited, Combine::kSum, Needs::kTurn},
      {"load_quadratic", "1/(N m)", 0, 0, kUnlimited, Combine::kSum, Needs::kTurn},
      {"friction_positive_n_m", "N m", 0, 0, kUnlimited},
      {"friction_negative_n_m", "N m", 0, 0, kUnlimited},
      {"viscous_positive_n_m_s_per_rad", "N m s/rad", 0, 0, kUnlimited},
      {"viscous_negative_n_m_s_per_rad", "N m s/rad", 0, 0, kUnlimited},
      {"backdrive_factor", "1", 1, 0, kUnlimited},
      {"row_softness", "1", 1, 0.01, 1},
      {"sigma0_n_m_per_rad", "N m/rad", 0, 0, kUnlimited},
      {"sigma1_n_m_s_per_rad", "N m s/rad", 0, 0, kUnlimited},
  }};

  // The torque that counts as transmitted: of the motor, or BAM's gearbox torque |motor - external|.
  enum class Load { kMotor, kGearbox };
  enum class Model { kDry, kLugre };

  // What the next step needs of the last one; stands in mjData.plugin_state.
  struct State {
    double drive_n_m;                     // torque of the joint's actuators in the last step
    double external_n_m;                  // torque of gravity, springs and applied forces in the last step
    double free_acceleration_rad_per_s2;  // of the last step, without constraints
    double own_n_m;                       // passive torque of this plugin in the last compute
    BristleState bristle;                 // LuGre
  };
  static constexpr int kStateSize = sizeof(State) / sizeof(mjtNum);

  // Null when `init` must fail (see refusal.h); an instance that was refused on a finished model does nothing.
  static std::unique_ptr<Friction> Create(const mjModel* m, int instance);

  void Compute(const mjModel* m, mjData* d, int capability) const;
  // Remembers the step's torques and settles the bristle.
  void Advance(const mjModel* m, mjData* d) const;

 private:
  // Rewrites the joint's row with what PASSIVE knows and adds viscous and quadratic drag, or LuGre's torque.
  void ComputePassive(const mjModel* m, mjData* d) const;
  // Rewrites it again, with this step's actuator torque.
  void ComputeActuator(const mjModel* m, mjData* d) const;
  // The faults of what stands in <config> and the model, and of numbers; empty when there is none.
  std::string ResolveStructure(const mjModel* m, int instance);
  std::string ResolveValues(const mjModel* m, int instance);
  std::string CheckTurn(const mjModel* m, int instance);

  State& StateOf(mjData* d) const { return *reinterpret_cast<State*>(d->plugin_state + state_address_); }
  DryFriction Law(const mjModel* m) const;
  bool NeedsDirection(const DryFriction& law) const;
  double ViscousTorque(const mjModel* m, double speed) const;
  double ActuatorTorque(const mjModel* m, const mjData* d) const;
  double ExternalTorque(mjData* d) const;
  double FreeAcceleration(const mjModel* m, mjData* d) const;
  double Level(const mjModel* m, const DryFriction& law, double speed, double drive, double external,
               double free_acceleration) const;
  void WriteRow(const mjModel* m, mjData* d, double level, bool soften) const;

  LiveParameters<kKeyCount> value_;
  int joint_ = -1, dof_ = -1, angle_address_ = -1, state_address_ = -1;
  Load load_ = Load::kMotor;
  Model model_ = Model::kDry;
  bool last_in_turn_ = true;  // its ACTUATOR compute comes after those of the joint's drives
  bool inert_ = false;
  std::vector<int> drives_;  // actuators that may act on the joint
  // Two vectors of nv: an instance belongs to one mjData, and MuJoCo's stack calls do not link under AddressSanitizer.
  std::unique_ptr<mjtNum[]> scratch_;
  std::vector<int> own_outputs_;  // force outputs of its own actuator elements
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_FRICTION_FRICTION_H_
