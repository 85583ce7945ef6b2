// An experiment file on an MJCF that stays: fields, effects of its own, added actuators, and a replay of some rows.
#include "replay/simulator.h"
#include "tests/fuzz/bound_log.h"

namespace {

constexpr const char* kRobot = R"(<mujoco>
  <option timestep="0.004"><flag contact="disable"/></option>
  <worldbody>
    <body name="bar"><joint name="hinge" axis="0 1 0" damping="0.1"/>
      <inertial pos="0.1 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body>
    <body name="ball" pos="1 0 0"><freejoint name="free"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/></body>
  </worldbody>
  <actuator><motor name="motor" joint="hinge"/></actuator>
  <sensor><subtreecom name="centre" body="bar"/><framequat name="turn" objtype="body" objname="ball"/></sensor>
</mujoco>)";

}  // namespace

FUZZ_TARGET(model) {
  using namespace gapscope;
  static const std::string robot = [] {
    const int file = memfd_create("robot", 0);
    if (write(file, kRobot, std::char_traits<char>::length(kRobot)) < 0) fuzz::Complain("no file in memory");
    return "/proc/self/fd/" + std::to_string(file);
  }();
  auto experiment = LoadExperiment(fuzz::FileOf(fuzz::Text(data, size)));
  if (!experiment.ok()) return 0;
  experiment.value().model_path = robot;
  const auto model = Model::Load(experiment.value());
  if (!model.ok()) {
    fuzz::CheckRefusal(model.error(), "/proc/self/fd/");
    return 0;
  }
  const auto recording = BindLog(model.value()->experiment(), fuzz::BoundLog());
  if (!recording.ok()) return 0;
  Simulator simulator(*model.value(), 0);
  if (!simulator.SetParameters(model.value()->Nominal(), recording.value())) return 0;
  const Window window{0, recording.value().rows()};
  std::vector<double> predicted(window.rows() * recording.value().measured.size());
  simulator.Run(recording.value(), window, AtRest(*model.value()), predicted);
  fuzz::whole = true;
  return 0;
}
