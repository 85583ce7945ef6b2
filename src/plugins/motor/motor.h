// gapscope.motor: a drive between command and joint torque, as an actuator plugin.
//
// command -> delay -> [dead zone] -> [asymmetry] -> law -> delay in the servo's loop -> lag(s) -> [dead zone] -> limits
// (torque, power, torque-speed curve, all sagging) -> the drive's own estimate -> droop -> asymmetry -> gear efficiency
// -> gear friction -> joint. Every stage is neutral at its default and skipped by one branch when it can only be
// neutral. Equations, sources and attributes: README.md.
#ifndef GAPSCOPE_PLUGINS_MOTOR_MOTOR_H_
#define GAPSCOPE_PLUGINS_MOTOR_MOTOR_H_

#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <string>

#include "src/plugins/motor/history.h"
#include "src/plugins/motor/motor_config.h"

namespace gapscope::plugins {

// What one instance keeps beside its state: resolved once, the same for all steps, no state of its own.
class Motor {
 public:
  // Null when `init` must fail (see refusal.h); an instance that was refused on a finished model is inert: no torque.
  static std::unique_ptr<Motor> Create(const mjModel* m, int instance);

  // Writes the first actuator's force and its activations' derivatives. Once a step, RK4: four times.
  void Compute(const mjModel* m, mjData* d, int capability) const;
  // The step is over: its start joins the history.
  void Advance(const mjModel* m, mjData* d) const;

 private:
  // Limits on the torque at the present speed, before sag.
  struct Limits {
    double low, high;
  };

  // One evaluation of the forces.
  struct Stage {
    const mjModel* m;
    mjData* d;
    double* slots;  // of plugin_state
    bool staged;    // the integrator evaluates forces within a step
    bool later;     // and this one is not the step's first
    bool prime;     // the first one after a reset
  };

  Stage Open(const mjModel* m, mjData* d) const;
  double Parameter(const mjModel* m, MotorParameter p) const { return config_.live(m, p); }
  double Input(const double* inputs, MotorRole role, double otherwise) const {
    return config_.input_of[role] >= 0 ? inputs[config_.input_of[role]] : otherwise;
  }
  void ReadCommands(const mjModel* m, const mjData* d, double* command) const;
  // What the servo's computer knows, delays behind: of the motion, and in `late` of the commands.
  Motion Late(const Stage& at, Motion present, const double* command, double* late) const;
  // The law. `inputs` and `seen` are what the servo's computer has, maybe late; `speed` and `supply` are there now.
  double Request(const mjModel* m, const double* inputs, Motion seen, double speed, double supply) const;
  double Winding(const mjModel* m, double voltage, double speed) const;
  // Limits of the torque in the direction of `torque` at `speed`.
  Limits LimitsAt(const mjModel* m, double torque, double speed) const;
  // |torque| as a share of the drive's ceiling, 0..1.
  double Load(const mjModel* m, double torque, const Limits& limits, double supply) const;

  // The torque within the limits, which sag to `ceiling` of theirs; the sag's derivative is written.
  double Limited(const Stage& at, double torque, double speed, double supply, double ceiling) const;
  // What of an estimated torque reaches the joint.
  double Delivered(const mjModel* m, double torque, double speed) const;

  MotorConfig config_;
  bool inert_ = false;
  int state_ = 0;                              // address in plugin_state
  int capacity_ = 0;                           // of the history
  int output_ = 0;                             // address in actuator_force
  int first_ = 0;                              // the actuator that carries the torque
  std::array<int, kRoles> actuator_{};         // of each input
  int lag_ = -1, second_lag_ = -1, sag_ = -1;  // addresses in act; -1: stage neutral
  // Stages that may not be neutral.
  bool history_, dead_zone_, limits_, trapeze_, forcerange_, droop_, asymmetry_, command_asymmetry_, softness_,
      efficiency_, friction_, supply_, enable_;
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_MOTOR_MOTOR_H_
