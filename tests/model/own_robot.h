// A driven bar with a sprung tip, to which candidates of an experiment's own are added.
#ifndef GAPSCOPE_TESTS_MODEL_OWN_ROBOT_H_
#define GAPSCOPE_TESTS_MODEL_OWN_ROBOT_H_

namespace gapscope::testing {

inline constexpr const char* kOwnRobot = R"(<mujoco>
  <option timestep="0.001" integrator="RK4"><flag contact="disable"/></option>
  <worldbody>
    <body name="bar"><joint name="hinge" axis="0 1 0" damping="0.05"/>
      <inertial pos="0.1 0 0" mass="0.2" diaginertia="0.001 0.001 0.001"/>
      <body name="tip" pos="0.2 0 0"><joint name="wrist" axis="0 1 0" stiffness="0.3" damping="0.01"/>
        <inertial pos="0.05 0 0" mass="0.02" diaginertia="0.0001 0.0001 0.0001"/></body></body>
  </worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
</mujoco>)";

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_MODEL_OWN_ROBOT_H_
