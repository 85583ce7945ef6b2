// gapscope.spring: torque of one hinge or slide joint that depends on where the joint is, and a little on where it was.
//
//   torque = -k e - k3 e^3 - H s - G sin(q - q_g) + B + A sin(P q + a) + A2 sin(2 P q + a2) - ks p,   e = q - rest
//
// with s in -1 .. 1 the bend of a Dahl bristle (../common/bristle.h), which makes a loop of half-height H that turns
// over within a few `hysteresis_rad`, and p how far the joint is beyond a stop: above it where the stop lies above the
// middle of the joint's range (zero without a range), else below. Stands for a cable, a spring that hardens, an
// unbalanced mass, a bias, cogging, a stop. MuJoCo's own `stiffness` and `springref` do for k and k3 alone. Attributes:
// README.md in this folder.
#ifndef GAPSCOPE_PLUGINS_SPRING_SPRING_H_
#define GAPSCOPE_PLUGINS_SPRING_SPRING_H_

#include <mujoco/mujoco.h>

#include <array>
#include <memory>

#include "src/plugins/common/bristle.h"
#include "src/plugins/common/parameters.h"

namespace gapscope::plugins {

class Spring {
 public:
  enum Key {
    kStiffness,
    kRest,
    kHysteresis,
    kHysteresisAngle,
    kCubic,
    kGravity,
    kGravityRest,
    kBias,
    kCogging,
    kCoggingPeriods,
    kCoggingPhase,
    kCoggingSecond,
    kCoggingSecondPhase,
    kStop,
    kStopAngle,
    kKeyCount
  };
  static constexpr const char* kName = "gapscope.spring";
  static constexpr std::array<ParameterSpec, kKeyCount> kSpecs = {{
      {"stiffness_n_m_per_rad", "N m/rad", 0, 0, kUnlimited, Combine::kSum, Needs::kNothing, "stiffness"},
      {"rest_rad", "rad", 0, -kUnlimited, kUnlimited, Combine::kSum, Needs::kNothing, "springref"},
      {"hysteresis_n_m", "N m", 0, 0, kUnlimited},
      {"hysteresis_rad", "rad", 0.05, 0, kUnlimited},
      {"cubic_n_m_per_rad3", "N m/rad^3", 0, -kUnlimited, kUnlimited, Combine::kSum, Needs::kNothing,
       "stiffness_cubic"},
      {"gravity_n_m", "N m", 0, -kUnlimited, kUnlimited},
      {"gravity_rest_rad", "rad", 0, -kUnlimited, kUnlimited},
      {"bias_n_m", "N m", 0, -kUnlimited, kUnlimited},
      {"cogging_n_m", "N m", 0, -kUnlimited, kUnlimited},
      {"cogging_periods_per_rev", "1", 12, 0, kUnlimited},
      {"cogging_phase_rad", "rad", 0, -kUnlimited, kUnlimited},
      {"cogging_second_n_m", "N m", 0, -kUnlimited, kUnlimited},
      {"cogging_second_phase_rad", "rad", 0, -kUnlimited, kUnlimited},
      {"stop_n_m_per_rad", "N m/rad", 0, 0, kUnlimited},
      {"stop_rad", "rad", 0, -kUnlimited, kUnlimited},
  }};
  static constexpr int kStateSize = sizeof(BristleState) / sizeof(mjtNum);

  // Null when `init` must fail (see refusal.h); an instance that was refused on a finished model does nothing.
  static std::unique_ptr<Spring> Create(const mjModel* m, int instance);

  void Compute(const mjModel* m, mjData* d, int capability) const;
  // Settles the bristle once per step, whatever the integrator.
  void Advance(const mjModel* m, mjData* d) const;

 private:
  std::string ResolveStructure(const mjModel* m, int instance);
  std::string ResolveValues(const mjModel* m, int instance);
  BristleState& StateOf(mjData* d) const { return *reinterpret_cast<BristleState*>(d->plugin_state + state_address_); }
  double Torque(const mjModel* m, double q) const;

  LiveParameters<kKeyCount> value_;
  int joint_ = -1, dof_ = -1, angle_address_ = -1, state_address_ = -1;
  double middle_ = 0;  // of the joint's range
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_SPRING_SPRING_H_
