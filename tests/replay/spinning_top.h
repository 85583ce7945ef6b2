// A free symmetric top without gravity, whose motion has a closed form (Landau and Lifshitz, Mechanics, sec. 33): with
// moments I, I, I3 and the angular momentum L, R(t) = exp(t L / I) R(0) exp(t w3 (1 - I3 / I) e3).
#ifndef GAPSCOPE_TESTS_REPLAY_SPINNING_TOP_H_
#define GAPSCOPE_TESTS_REPLAY_SPINNING_TOP_H_

#include <Eigen/Geometry>

namespace gapscope::testing {

// A marker sits on it off its centre, turned.
struct SpinningTop {
  static constexpr const char* kMjcf = R"(<mujoco>
  <option timestep="0.001" integrator="RK4" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody>
    <body name="top" pos="0.5 -0.2 1"><freejoint name="free"/>
      <inertial pos="0 0 0" mass="2" diaginertia="0.02 0.02 0.035"/>
      <body name="plate" pos="0.1 0 0.05"><geom type="sphere" size="0.01" mass="0"/>
        <site name="marker" pos="0 0.08 0" quat="0.8 0 0.6 0"/></body></body>
    <body name="arm"><joint name="hinge" axis="0 0 1"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/><site name="tip" pos="0.2 0 0"/></body>
  </worldbody>
  <sensor><framepos name="place" objtype="site" objname="marker"/>
    <framequat name="turn" objtype="site" objname="marker"/>
    <framepos name="tip" objtype="site" objname="tip"/><framequat name="arm_turn" objtype="site" objname="tip"/>
    <gyro name="gyro" site="marker"/></sensor>
</mujoco>)";

  Eigen::Vector3d place{0.3, 0.1, 0.8}, velocity{0.2, -0.1, 0.3}, rate{2.0, -1.0, 3.0};  // rate in the body's frame
  Eigen::Quaterniond turn{Eigen::AngleAxisd(2.2, Eigen::Vector3d(1, -2, 0.5).normalized())};

  static Eigen::Quaterniond Exp(const Eigen::Vector3d& v) {
    return v.norm() > 0 ? Eigen::Quaterniond(Eigen::AngleAxisd(v.norm(), v.normalized()))
                        : Eigen::Quaterniond::Identity();
  }
  Eigen::Quaterniond Turn(double t) const {
    constexpr double kI = 0.02, kI3 = 0.035;
    const Eigen::Vector3d momentum = turn * Eigen::Vector3d(kI * rate[0], kI * rate[1], kI3 * rate[2]);
    return Exp(t / kI * momentum) * turn * Exp(t * rate[2] * (1 - kI3 / kI) * Eigen::Vector3d::UnitZ());
  }
  Eigen::Vector3d Place(double t) const { return place + t * velocity; }
  // In the body's frame: it turns about the third axis.
  Eigen::Vector3d Rate(double t) const {
    constexpr double kI = 0.02, kI3 = 0.035;
    return Eigen::AngleAxisd(t * rate[2] * (kI3 / kI - 1), Eigen::Vector3d::UnitZ()) * rate;
  }
  Eigen::Vector3d Marker(double t) const { return Place(t) + Turn(t) * Eigen::Vector3d(0.1, 0.08, 0.05); }
  Eigen::Quaterniond MarkerTurn(double t) const { return Turn(t) * Eigen::Quaterniond(0.8, 0, 0.6, 0); }
};

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_REPLAY_SPINNING_TOP_H_
