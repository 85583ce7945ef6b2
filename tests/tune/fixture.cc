#include "tests/tune/fixture.h"

#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <random>

#include "src/core/file.h"

namespace gapscope::testing {
namespace {

const char kCartXml[] = R"(<mujoco>
  <option timestep="0.004" integrator="RK4" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody><body>
    <joint name="cart" type="slide" axis="1 0 0" stiffness="8"/>
    <inertial pos="0 0 0" mass="2" diaginertia="1 1 1"/>
  </body></worldbody>
  <actuator><general name="motor" joint="cart"/></actuator>
</mujoco>)";

Rig Build(const std::string& path, const std::vector<std::string>& effects) {
  auto experiment = LoadExperiment(path);
  Rig rig{.experiment = std::move(experiment).value()};
  rig.model = Model::Load(rig.experiment).value();
  if (!effects.empty()) {
    const auto uses = ParseEffects(effects, *rig.model->rig());
    rig.model = Model::Build(rig.model->rig(), uses.value(), {}).value();
  }
  return rig;
}

}  // namespace

std::vector<double> Rig::Values(const std::map<std::string, double>& changed) const {
  std::vector<double> values = model->Nominal();
  for (const auto& [name, value] : changed) values[static_cast<std::size_t>(Index(name))] = value;
  return values;
}

int Rig::Index(const std::string& parameter) const { return model->Find(parameter, "test").value(); }

Rig LoadRig(const std::string& rig, const std::vector<std::string>& effects) {
  return Build(std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + rig + "/experiment.yaml", effects);
}

Rig LoadCubicCable() {
  Rig rig = LoadRig("qube");
  rig.model = Model::Build(rig.model->rig(), {{"cable_spring", "arm"}}, {{"arm", {.torque_n_m = 5e-3}}}).value();
  return rig;
}

// The model is read again by whoever builds a variant, so the files stay until the end.
struct Folder {
  static inline int made = 0;
  std::filesystem::path path = std::filesystem::temp_directory_path() /
                               ("gapscope_cart_" + std::to_string(getpid()) + "_" + std::to_string(++made));
  Folder() { std::filesystem::create_directories(path); }
  ~Folder() { std::filesystem::remove_all(path); }
};

Rig LoadCart(double low, double high, bool force) {
  static const Folder owner;
  const auto& folder = owner.path;
  const std::string bounds = "[" + std::to_string(low) + ", " + std::to_string(high) + "]";
  const std::string yaml =
      "schema: gapscope.experiment/1\nmodel: cart.xml\nlog: {time: {column: t, unit: s}}\n"
      "commands: [{actuator: motor, column: u, unit: N}]\n"
      "measured:\n  - {signal: cart_m, column: x, joint: cart, unit: m}\n" +
      (force ? "  - {signal: force_n, kind: torque, column: f, actuator: motor, unit: N}\n" : std::string()) +
      "parameters:\n"
      "  cart.gain: {unit: \"1\", nominal: 1.5, bounds: " +
      bounds +
      "}\n"
      "  cart.damping: {unit: N s/m, nominal: 0, bounds: [0, 4], frozen: true}\n"
      "set:\n  actuator/motor/gain: cart.gain\n  joint/cart/damping: cart.damping\n";
  WriteFile((folder / "cart.xml").string(), kCartXml).value();
  WriteFile((folder / "experiment.yaml").string(), yaml).value();
  return Build((folder / "experiment.yaml").string(), {});
}

Rig LoadLink() {
  static const Folder owner;
  WriteFile((owner.path / "link.xml").string(),
            "<mujoco><option timestep='0.002' integrator='RK4'><flag contact='disable'/></option><worldbody>"
            "<body name='link'><joint name='hinge' axis='0 1 0' damping='0.05'/><inertial pos='0.02 0 -0.2' mass='1' "
            "diaginertia='0.02 0.021 0.002'/></body></worldbody>"
            "<actuator><motor name='motor' joint='hinge'/></actuator></mujoco>")
      .value();
  const std::string path = (owner.path / "experiment.yaml").string();
  WriteFile(path,
            "model: link.xml\nlog: {time: {column: t, unit: s}}\ninertia: [link]\n"
            "commands: [{actuator: motor, column: u, unit: N m}]\n"
            "measured: [{signal: angle, column: q, joint: hinge, unit: rad}]\n")
      .value();
  return Build(path, {});
}

Rig LoadThreeCarts(bool linked, bool speed) {
  static const Folder owner;
  const std::string name = std::string(linked ? "linked" : "apart") + (speed ? "_speed" : "");
  std::string bodies, motors, yaml = "schema: gapscope.experiment/1\nmodel: " + name + ".xml\n";
  std::string commands = "commands:\n", measured = "measured:\n", parameters = "parameters:\n", set = "set:\n";
  const std::string inertia = "<inertial pos='0 0 0' mass='2' diaginertia='1 1 1'/>";
  for (const std::string cart : {"a", "b", "c"}) {
    const std::string body =
        "<body><joint name='" + cart + "' type='slide' axis='1 0 0' stiffness='8' damping='1'/>" + inertia;
    // A linked cart stands on the one before.
    const bool on_top = linked && cart == "c";
    if (on_top) bodies.erase(bodies.size() - std::string("</body>").size());
    bodies += body + "</body>" + (on_top ? "</body>" : "");
    motors += "<general name='" + cart + "' joint='" + cart + "'/>";
    commands += "  - {actuator: " + cart + ", column: u" + cart + ", unit: N}\n";
    measured += "  - {signal: " + cart + "_m, column: " + cart + ", joint: " + cart + ", unit: m}\n";
    parameters += "  " + cart + ".gain: {unit: \"1\", nominal: 1.5, bounds: [0.1, 10]}\n  " + cart +
                  ".damping: {unit: N s/m, nominal: 1, bounds: [0, 4]}\n";
    set += "  actuator/" + cart + "/gain: " + cart + ".gain\n  joint/" + cart + "/damping: " + cart + ".damping\n";
  }
  if (speed) measured += "  - {signal: b_m_per_s, column: vb, kind: velocity, joint: b, unit: m/s, score: false}\n";
  yaml += "log: {time: {column: t, unit: s}}\n" + commands + measured + parameters + set;
  const std::string path = (owner.path / name).string();
  WriteFile(path + ".xml",
            "<mujoco><option timestep='0.004' integrator='RK4' gravity='0 0 0'>"
            "<flag contact='disable'/></option><worldbody>" +
                bodies + "</worldbody><actuator>" + motors + "</actuator></mujoco>")
      .value();
  WriteFile(path + ".yaml", yaml).value();
  return Build(path + ".yaml", {});
}

std::vector<double> CartMotion(double gain, double q0, double v0, const std::vector<double>& command) {
  const double rate = std::sqrt(kCartStiffness_n_per_m / kCartMass_kg), sine = std::sin(rate * kCartStep_s),
               cosine = std::cos(rate * kCartStep_s);
  std::vector<double> q = {q0};
  double v = v0;
  for (std::size_t k = 0; k + 1 < command.size(); ++k) {
    const double rest = gain * command[k] / kCartStiffness_n_per_m, beside = q.back() - rest;
    q.push_back(rest + beside * cosine + v / rate * sine);
    v = v * cosine - beside * rate * sine;
  }
  return q;
}

Recording MakeRecording(const Rig& rig, std::vector<double> command, std::vector<double> measured, double period_s) {
  Recording recording{.log_path = "made"};
  for (std::size_t k = 0; k < command.size(); ++k) recording.time_s.push_back(static_cast<double>(k) * period_s);
  recording.commands.push_back(
      {.actuator = rig.experiment.commands.front().actuator, .column = "u", .values = std::move(command)});
  for (std::size_t c = 1; c < rig.experiment.commands.size(); ++c) {
    recording.commands.push_back(
        {.actuator = rig.experiment.commands[c].actuator, .values = std::vector<double>(recording.rows(), 0.0)});
  }
  for (std::size_t s = 0; s < rig.experiment.measured.size(); ++s) {
    if (rig.experiment.measured[s].kind != SignalKind::kPosition) continue;
    recording.measured.push_back({.spec = rig.experiment.measured[s],
                                  .index = s,
                                  .column = "x",
                                  .values = std::vector<double>(recording.rows(), 0.0)});
  }
  if (!measured.empty()) recording.measured.front().values = std::move(measured);
  recording.timeline.median_step_s = period_s;
  return recording;
}

Recording MakeLog(const Rig& rig, const std::vector<double>& values, const std::function<double(double)>& command,
                  double duration_s, double period_s, double noise_deviation, unsigned long seed, double time_step_s) {
  const auto rows = static_cast<std::size_t>(std::lround(duration_s / period_s)) + 1;
  std::vector<double> commands(rows);
  for (std::size_t k = 0; k < rows; ++k) commands[k] = command(static_cast<double>(k) * period_s);
  Recording recording = MakeRecording(rig, std::move(commands), {}, period_s);
  Simulator simulator(*rig.model, time_step_s);
  const mjModel& m = rig.model->compiled();
  const InitialState rest{.qpos = {m.qpos0, m.qpos0 + m.nq},
                          .qvel = std::vector<double>(static_cast<std::size_t>(m.nv), 0.0)};
  const std::size_t signals = recording.measured.size();
  std::vector<double> predicted(rows * signals);
  GS_CHECK(simulator.SetParameters(values, recording));
  GS_CHECK(simulator.Run(recording, {0, rows}, rest, predicted).outcome == Outcome::kCompleted);
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0, 1);
  for (std::size_t k = 0; k < rows; ++k) {
    for (std::size_t s = 0; s < signals; ++s) {
      const double count = recording.measured[s].spec.resolution,
                   y = predicted[k * signals + s] + noise_deviation * noise(random);
      recording.measured[s].values[k] = count > 0 ? count * std::round(y / count) : y;
    }
  }
  return recording;
}

}  // namespace gapscope::testing
