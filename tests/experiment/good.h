// An experiment file that holds every section and most keys, and a log that fits it.
#ifndef GAPSCOPE_TESTS_EXPERIMENT_GOOD_H_
#define GAPSCOPE_TESTS_EXPERIMENT_GOOD_H_

namespace gapscope::testing {

inline constexpr const char* kGoodExperiment = R"(schema: gapscope.experiment/1
doc: "a rig"
model: robot.xml
log:
  format: csv
  time: {column: time_s, unit: s}
  repair: {missing: hold, repeated: drop_rows, reversed: error, gap_factor: 7}
values:
  log.kp: {column: kp, default: 2}
commands:
  - {actuator: motor, column: u, unit: mV, add: 0.5}
  - {actuator: aux, default: log.kp * 2}
measured:
  - {signal: q, column: q, joint: hinge, unit: deg, scale: -1, resolution: 0.001, wrap: 6.283185307179586,)"
                                               R"( offset: hinge.offset}
  - {signal: w, columns: [speed, w], kind: velocity, joint: hinge, optional: true, score: false}
  - {signal: tau, column: tau, kind: torque, actuator: motor, unit: N m, optional: true}
parameters:
  hinge.damping: {unit: N m s/rad, nominal: 0.1, bounds: [0, 1], doc: "guess"}
  hinge.offset: {unit: rad, nominal: 0, bounds: [-0.1, 0.1]}
  motor.gain: {unit: N m/V, nominal: 2, frozen: true}
set:
  joint/hinge/damping: hinge.damping
  body/bar/inertia: ["1e-4", "2 * hinge.damping", "1e-4"]
replay: {mode: windows, window_s: 0.5, start_s: 0.1, while: on}
)";

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_EXPERIMENT_GOOD_H_
