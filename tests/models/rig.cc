#include "tests/models/rig.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <fstream>
#include <numbers>
#include <sstream>

namespace gapscope::testing {
namespace {

// Replaces from `begin` to `end`, both included; nothing when absent.
void ReplaceBlock(std::string* text, const std::string& begin, const std::string& end, const std::string& with) {
  const auto first = text->find(begin), last = text->find(end);
  if (first == std::string::npos || last == std::string::npos) return;
  text->replace(first, last + end.size() - first, with);
}

void LoadPluginsOnce() {
  static const bool loaded = [] {
    mj_loadPluginLibrary(GAPSCOPE_PLUGIN_LIBRARY);
    return true;
  }();
  (void)loaded;
}

}  // namespace

std::string RigPath(const std::string& rig) {
  return std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + rig + "/" + rig + ".xml";
}

bool HasMotorPlugin() {
  LoadPluginsOnce();
  int slot = -1;
  return mjp_getPlugin("gapscope.motor", &slot) != nullptr;
}

ModelPtr LoadRig(const std::string& rig, const std::string& native_actuator) {
  LoadPluginsOnce();
  char error[1000] = "";
  mjModel* m = nullptr;
  if (native_actuator.empty()) {
    m = mj_loadXML(RigPath(rig).c_str(), nullptr, error, sizeof(error));
  } else {
    // The scene is found relative to the model's folder: hand both to the compiler as virtual files.
    std::ifstream in(RigPath(rig));
    std::stringstream buffer;
    buffer << in.rdbuf();
    std::string text = buffer.str();
    ReplaceBlock(&text, "<include", "/>", "");
    ReplaceBlock(&text, "<extension>", "</extension>", "<default><default class=\"visual\"/></default>");
    ReplaceBlock(&text, "<actuator>", "</actuator>", "<actuator>" + native_actuator + "</actuator>");
    // Without the scene there are no materials.
    for (auto at = text.find(" material=\""); at != std::string::npos; at = text.find(" material=\"")) {
      text.erase(at, text.find('"', at + 11) + 1 - at);
    }
    mjVFS vfs;
    mj_defaultVFS(&vfs);
    mj_addBufferVFS(&vfs, "rig.xml", text.data(), static_cast<int>(text.size()));
    m = mj_loadXML("rig.xml", &vfs, error, sizeof(error));
    mj_deleteVFS(&vfs);
  }
  EXPECT_NE(m, nullptr) << rig << ": " << error;
  EXPECT_STREQ(error, "") << rig;
  return ModelPtr(m);
}

int JointDof(const mjModel& m, const char* joint) {
  const int id = mj_name2id(&m, mjOBJ_JOINT, joint);
  EXPECT_GE(id, 0) << "no joint " << joint;
  return id < 0 ? 0 : m.jnt_dofadr[id];
}

int Actuator(const mjModel& m, const char* actuator) {
  const int id = mj_name2id(&m, mjOBJ_ACTUATOR, actuator);
  EXPECT_GE(id, 0) << "no actuator " << actuator;
  return std::max(id, 0);
}

Motion Drive(const mjModel& m, const std::vector<double>& q0, int steps,
             const std::function<std::vector<double>(int)>& command) {
  DataPtr d(mj_makeData(&m));
  std::copy(q0.begin(), q0.end(), d->qpos);
  Motion motion;
  for (int k = 0; k < steps; ++k) {
    const std::vector<double> u = command(k);
    std::copy(u.begin(), u.end(), d->ctrl);
    mj_step(&m, d.get());
    motion.q.emplace_back(d->qpos, d->qpos + m.nq);
    motion.v.emplace_back(d->qvel, d->qvel + m.nv);
  }
  for (int w = 0; w < mjNWARNING; ++w) EXPECT_EQ(d->warning[w].number, 0) << "warning " << w;
  return motion;
}

double ChirpAndSteps(double t_s, double amplitude, double f0_hz, double f1_hz, double duration_s) {
  const double phase = 2 * std::numbers::pi * (f0_hz * t_s + (f1_hz - f0_hz) / (2 * duration_s) * t_s * t_s);
  return amplitude * (0.6 * std::sin(phase) + 0.4 * (std::fmod(t_s, 0.63) < 0.315 ? 1 : -1));
}

Linear Linearise(const mjModel& m, const std::vector<double>& q0) {
  DataPtr d(mj_makeData(&m));
  const int nv = m.nv, n = 2 * nv, nu = m.nu;
  Linear linear{std::vector<double>(static_cast<std::size_t>(n) * n),
                std::vector<double>(static_cast<std::size_t>(n) * nu)};
  auto derivative = [&](int column, double step) {
    mj_resetData(&m, d.get());
    std::copy(q0.begin(), q0.end(), d->qpos);
    if (column < nv) {
      d->qpos[column] += step;
    } else if (column < n) {
      d->qvel[column - nv] += step;
    } else {
      d->ctrl[column - n] += step;
    }
    mj_forward(&m, d.get());
    std::vector<double> x(d->qvel, d->qvel + nv);
    x.insert(x.end(), d->qacc, d->qacc + nv);
    return x;
  };
  constexpr double kStep = 1e-4;
  for (int column = 0; column < n + nu; ++column) {
    const auto up = derivative(column, kStep), down = derivative(column, -kStep);
    for (int row = 0; row < n; ++row) {
      const double slope = (up[row] - down[row]) / (2 * kStep);
      if (column < n) {
        linear.a[static_cast<std::size_t>(row) * n + column] = slope;
      } else {
        linear.b[static_cast<std::size_t>(row) * nu + column - n] = slope;
      }
    }
  }
  return linear;
}

}  // namespace gapscope::testing
