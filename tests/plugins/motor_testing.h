// A joint with a gapscope.motor on inline MJCF, for the plugin's tests. Any MuJoCo warning fails the test that runs.
#ifndef GAPSCOPE_TESTS_PLUGINS_MOTOR_TESTING_H_
#define GAPSCOPE_TESTS_PLUGINS_MOTOR_TESTING_H_

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <map>
#include <string>
#include <vector>

#include "src/core/mujoco_handles.h"
#include "src/plugins/motor/history.h"

namespace gapscope::testing {

inline constexpr double kInertia = 0.16;  // kg m2 about the joint, exactly

inline void LoadPlugins() {
  static const bool loaded = [] {
    mj_loadPluginLibrary(GAPSCOPE_PLUGIN_LIBRARY);
    mju_user_warning = +[](const char* text) { ADD_FAILURE() << "MuJoCo warning: " << text; };
    return true;
  }();
  (void)loaded;
}

using Attributes = std::map<std::string, std::string>;

// One hinge about z, no gravity, inertia kInertia. Attributes go to `<config>`; `live` to `<numeric name="motor.KEY">`.
struct Rig {
  Attributes config = {}, live = {};
  std::string option = "timestep='0.001'";
  std::string first = {};  // attributes of the first actuator: "actdim='1'"
  int actuators = 1;
  double damping = 0;
  std::string native = {};  // replaces the plugin's actuators
  std::string sensors = {};

  std::string Xml() const {
    std::string text = "<mujoco><option gravity='0 0 0' " + option + "><flag contact='disable'/></option><extension>";
    if (native.empty()) {
      text += "<plugin plugin='gapscope.motor'><instance name='motor'>";
      for (const auto& [key, value] : config) text += "<config key='" + key + "' value='" + value + "'/>";
      text += "</instance></plugin>";
    }
    text += "</extension><worldbody><body><joint name='joint' axis='0 0 1' armature='" + std::to_string(kInertia) +
            "' damping='" + std::to_string(damping) +
            "'/><inertial pos='0 0 0' mass='1e-12' diaginertia='1e-15 1e-15 1e-15'/></body></worldbody><custom>";
    for (const auto& [key, value] : live) text += "<numeric name='motor." + key + "' data='" + value + "'/>";
    text += "</custom><actuator>" + native;
    for (int i = 0; native.empty() && i < actuators; ++i) {
      text += "<plugin joint='joint' plugin='gapscope.motor' instance='motor' " + (i == 0 ? first : "") + "/>";
    }
    return text + "</actuator><sensor>" + sensors + "</sensor></mujoco>";
  }

  // The compiled model; null with `message` filled when it is refused.
  ModelPtr TryCompile(std::string* message) const {
    LoadPlugins();
    char error[2000] = "";
    SpecPtr spec(mj_parseXMLString(Xml().c_str(), nullptr, error, sizeof error));
    if (!spec) {
      *message = error;
      return nullptr;
    }
    ModelPtr model(mj_compile(spec.get(), nullptr));
    if (!model) *message = mjs_getError(spec.get());
    return model;
  }
  ModelPtr Compile() const {
    std::string message;
    ModelPtr model = TryCompile(&message);
    EXPECT_TRUE(model) << message << "\n" << Xml();
    return model;
  }
};

inline double& Live(mjModel* m, const std::string& key) {
  const int id = mj_name2id(m, mjOBJ_NUMERIC, ("motor." + key).c_str());
  if (id < 0) ADD_FAILURE() << "no numeric motor." << key;
  return m->numeric_data[m->numeric_adr[id]];
}

// The torque on the joint in one state, after a reset.
inline double TorqueAt(const mjModel* m, mjData* d, double q, double qdot, const std::vector<double>& ctrl) {
  mj_resetData(m, d);
  d->qpos[0] = q;
  d->qvel[0] = qdot;
  std::copy(ctrl.begin(), ctrl.end(), d->ctrl);
  mj_forward(m, d);
  return d->qfrc_actuator[0];
}

inline plugins::MotorState StateOf(const mjModel* m, mjData* d) {
  return plugins::FindMotorState(m, d, mj_name2id(m, mjOBJ_PLUGIN, "motor"));
}

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_PLUGINS_MOTOR_TESTING_H_
