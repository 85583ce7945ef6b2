// One-joint models with gapscope.friction, as the tests of the plugin use them.
#ifndef GAPSCOPE_TESTS_PLUGINS_FRICTION_FIXTURE_H_
#define GAPSCOPE_TESTS_PLUGINS_FRICTION_FIXTURE_H_

#include <gtest/gtest.h>
#include <mujoco/mujoco.h>

#include <cstdio>
#include <string>

#include "src/core/mujoco_handles.h"

namespace gapscope::test {

inline void LoadPlugins() {
  static const bool loaded = [] {
    mj_loadPluginLibrary(GAPSCOPE_PLUGIN_LIBRARY);
    mju_user_warning = [](const char* text) { ADD_FAILURE() << "MuJoCo warning: " << text; };
    return true;
  }();
  (void)loaded;
}

// Compiles MJCF; null with the text in `*error` when it is refused.
inline ModelPtr Compile(const std::string& xml, std::string* error = nullptr) {
  LoadPlugins();
  char text[2000] = "";
  mjSpec* spec = mj_parseXMLString(xml.c_str(), nullptr, text, sizeof text);
  SpecPtr owner(spec);
  ModelPtr model(spec ? mj_compile(spec, nullptr) : nullptr);
  if (!model && spec) std::snprintf(text, sizeof text, "%s", mjs_getError(spec));
  if (error) *error = text;
  if (!model && !error) ADD_FAILURE() << text;
  return model;
}

inline std::string Text(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// The recipe of the plugin's README: rows that stop the joint within the step, whatever the step. The damping is
// divided by the impedance: 1/h would stop it 1e-4 too far, and give back energy.
inline std::string StiffRow(double step_s) {
  return "solimpfriction=\"0.9999 0.9999 0.001 0.5 2\" solreffriction=\"-1 " + Text(-0.9999 / step_s) + "\"";
}

// A wheel of inertia 0.01 kg m2 about y with an off-centre mass: gravity torque -m g l sin(q), hanging at 0.
struct JointModel {
  double step_s = 0.001;
  std::string integrator = "Euler", solver = "Newton", flags = "";
  double inertia = 0.01;
  double mass = 0, length = 0;  // of the off-centre mass
  std::string joint = "";       // more attributes of the joint
  std::string row = "";         // solimpfriction ...; empty: StiffRow
  double frictionloss = 1e-9;
  std::string config = "", numeric = "";  // of the plugin
  bool with_plugin = true;
  bool turn = false;  // gives the plugin its ACTUATOR compute
  std::string actuators = "";

  std::string Xml() const {
    const std::string stiff = row.empty() ? StiffRow(step_s) : row;
    std::string xml = "<mujoco><compiler autolimits=\"true\" angle=\"radian\"/><option timestep=\"" + Text(step_s) +
                      "\" integrator=\"" + integrator + "\" solver=\"" + solver +
                      "\" gravity=\"0 0 -9.81\"><flag contact=\"disable\" " + flags + "/></option>";
    if (with_plugin) {
      xml +=
          "<extension><plugin plugin=\"gapscope.friction\"><instance name=\"f\"><config key=\"joint\" value=\"j\"/>" +
          config + "</instance></plugin></extension>";
    }
    xml += "<custom>" + numeric +
           "</custom><worldbody><body><joint name=\"j\" type=\"hinge\" axis=\"0 -1 0\" frictionloss=\"" +
           Text(frictionloss) + "\" " + stiff + " " + joint + "/><inertial pos=\"0 0 " + Text(-length) + "\" mass=\"" +
           Text(mass > 0 ? mass : 1e-6) + "\" diaginertia=\"" + Text(inertia) + " " + Text(inertia) + " " +
           Text(inertia) + "\"/>";
    if (with_plugin) xml += "<plugin plugin=\"gapscope.friction\" instance=\"f\"/>";
    xml += "</body></worldbody><actuator>" + actuators;
    if (turn && with_plugin) xml += "<plugin joint=\"j\" plugin=\"gapscope.friction\" instance=\"f\"/>";
    return xml + "</actuator></mujoco>";
  }
};

inline std::string Config(const std::string& key, const std::string& value) {
  return "<config key=\"" + key + "\" value=\"" + value + "\"/>";
}
inline std::string Config(const std::string& key, double value) { return Config(key, Text(value)); }
inline std::string Numeric(const std::string& key, double value) {
  return "<numeric name=\"f." + key + "\" data=\"" + Text(value) + "\"/>";
}

// A live number of the model.
inline mjtNum& Live(mjModel* m, const std::string& name) {
  const int id = mj_name2id(m, mjOBJ_NUMERIC, name.c_str());
  EXPECT_GE(id, 0) << name;
  return m->numeric_data[m->numeric_adr[id]];
}

// The force of the joint's friction row.
inline double FrictionForce(const mjData* d, int dof = 0) {
  for (int row = d->ne; row < d->ne + d->nf; ++row) {
    if (d->efc_type[row] == mjCNSTR_FRICTION_DOF && d->efc_id[row] == dof) return d->efc_force[row];
  }
  ADD_FAILURE() << "no friction row";
  return 0;
}

}  // namespace gapscope::test

#endif  // GAPSCOPE_TESTS_PLUGINS_FRICTION_FIXTURE_H_
