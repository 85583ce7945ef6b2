// The same MJCF and log replayed by this program and by the stock `mujoco` package: states equal bit for bit.
#include <gtest/gtest.h>

#include <cstdio>
#include <cstdlib>
#include <cstring>

#include "src/experiment/recording.h"
#include "tests/model/synthetic.h"

namespace gapscope::testing {
namespace {

std::string Number(double value) {
  char text[40];
  std::snprintf(text, sizeof text, "%.17g", value);
  return text;
}

// A log with irregular stamps whose columns are named after the actuators, and zeros for what is measured: the motion
// starts at rest.
std::string Csv(const std::vector<std::string>& actuators) {
  std::string text = "time_s";
  for (const auto& name : actuators) text.append(",").append(name);
  text += ",zero\n";
  double t = 12.5;
  for (int k = 0; k < 800; ++k) {
    text += Number(t);
    for (std::size_t c = 0; c < actuators.size(); ++c)
      text.append(",").append(
          Number(c == 0 ? Exciting(t - 12.5, 0.5) - Exciting(0, 0.5) : 0.3 * Exciting(t - 12.4, 0.5, 2, 9)));
    text += ",0\n";
    t += k % 7 == 3 ? 0.0031 : 0.002;
  }
  return text;
}

void ExpectEqualStates(const std::string& which) {
  const std::string python = std::string(GAPSCOPE_BINARY_DIR) + "/venv/bin/python";
  if (access(python.c_str(), X_OK) != 0) GTEST_SKIP() << "no " << python << ": the test python_venv makes it";
  const Scratch scratch;
  std::string model_path;
  std::vector<std::string> joints;
  Experiment rig = ShippedExperiment(which == "qube" ? "qube" : "joint");
  if (which == "joint_with_plugins") {
    // gapscope.motor and gapscope.friction, as the program exports them.
    const auto base = MakeModel(rig);
    const auto uses = ParseEffects(
        {"stribeck_friction@joint", "actuator_lag@motor", "torque_delay@motor", "torque_constant_droop@motor"},
        *base->rig());
    ASSERT_TRUE(uses.ok()) << uses.error().Text();
    const ScaleTable scales = {{"joint",
                                {.torque_n_m = 60,
                                 .angle_rad = 0.5,
                                 .speed_rad_per_s = 5,
                                 .sample_s = 0.002,
                                 .command = 0.5,
                                 .inertia_kg_m2 = 0.159}}};
    const auto model = MakeModel(rig, uses.value(), scales);
    ASSERT_NE(model, nullptr);
    std::map<std::string, double> set;
    for (const auto& use : uses.value()) {
      for (const auto& p : PlacedParameters(use, *model->rig(), scales)) set[p.name] = p.start;
    }
    const auto xml = model->ToXml(ValuesWith(*model, set), {}, scales);
    ASSERT_TRUE(xml.ok()) << xml.error().Text();
    EXPECT_NE(xml.value().find("gapscope.motor"), std::string::npos);
    EXPECT_NE(xml.value().find("gapscope.friction"), std::string::npos);
    model_path = scratch.Write("model.xml", xml.value());
  } else {
    model_path = rig.model_path;
  }
  // An experiment of that MJCF and nothing else.
  std::string yaml = "model: " + model_path + "\ncommands:\n";
  std::vector<std::string> actuators;
  for (const auto& command : rig.commands) {
    actuators.push_back(command.actuator);
    yaml += "  - {actuator: " + command.actuator + ", column: " + command.actuator + "}\n";
  }
  yaml += "measured:\n";
  for (const auto& measured : rig.measured) {
    if (measured.kind == SignalKind::kPosition) joints.push_back(measured.on);
  }
  for (const auto& joint : joints)
    yaml += "  - {signal: " + joint + ", column: zero, joint: " + joint + "}\n  - {signal: " + joint +
            ".speed, kind: velocity, column: zero, joint: " + joint + "}\n";
  const auto experiment = LoadExperiment(scratch.Write("experiment.yaml", yaml));
  ASSERT_TRUE(experiment.ok()) << experiment.error().Text();
  const std::string csv = Csv(actuators);
  const auto recording = LoadRecording(experiment.value(), scratch.Write("log.csv", csv));
  ASSERT_TRUE(recording.ok()) << recording.error().Text();
  const auto model = MakeModel(experiment.value());
  ASSERT_NE(model, nullptr);
  ASSERT_EQ(static_cast<int>(joints.size()), model->compiled().nv) << "every state is compared";
  constexpr double kStep_s = 0.001;
  const auto ours = Predict(*model, recording.value(), {}, nullptr, kStep_s);

  // The script reads the commands' columns only.
  std::string commands;
  for (std::size_t begin = 0; begin < csv.size();) {
    const std::size_t end = csv.find('\n', begin);
    commands.append(csv, begin, csv.rfind(',', end) - begin).append("\n");
    begin = end + 1;
  }
  const std::string log = scratch.Write("commands.csv", commands), out = scratch.Path("states.bin");
  const std::string script = std::string(GAPSCOPE_SOURCE_DIR) + "/tests/replay/replay_in_python.py";
  const std::string line = "'" + python + "' '" + script + "' '" + GAPSCOPE_PLUGIN_LIBRARY + "' '" + model_path +
                           "' '" + log + "' " + Number(kStep_s) + " '" + out + "' > /dev/null";
  ASSERT_EQ(std::system(line.c_str()), 0) << line;
  const std::string bytes = ReadAll(out);
  const std::size_t nv = joints.size(), rows = recording.value().rows();
  ASSERT_EQ(bytes.size(), rows * 2 * nv * sizeof(double));
  std::vector<double> theirs(rows * 2 * nv);
  std::memcpy(theirs.data(), bytes.data(), bytes.size());
  std::size_t different = 0;
  double moved = 0, worst = 0;
  std::size_t first = rows;
  for (std::size_t r = 0; r < rows; ++r) {
    for (std::size_t j = 0; j < nv; ++j) {
      const int joint = model->source(2 * j).joint;
      const double q = theirs[r * 2 * nv + static_cast<std::size_t>(model->compiled().jnt_qposadr[joint])];
      const double v = theirs[r * 2 * nv + nv + static_cast<std::size_t>(model->compiled().jnt_dofadr[joint])];
      different += std::memcmp(&q, &ours[2 * j][r], sizeof q) != 0;
      different += std::memcmp(&v, &ours[2 * j + 1][r], sizeof v) != 0;
      if ((q != ours[2 * j][r] || v != ours[2 * j + 1][r]) && first == rows) first = r;
      worst = std::max({worst, std::abs(q - ours[2 * j][r])});
      moved = std::max(moved, std::abs(q));
    }
  }
  EXPECT_EQ(different, 0u) << "of " << rows * 2 * nv << " numbers, from row " << first << " on, by up to " << worst
                           << " rad";
  EXPECT_GT(moved, 0.05) << "a rig at rest proves nothing";
}

TEST(PythonEqualityTest, Joint) { ExpectEqualStates("joint"); }
TEST(PythonEqualityTest, Qube) { ExpectEqualStates("qube"); }
TEST(PythonEqualityTest, JointWithPlugins) { ExpectEqualStates("joint_with_plugins"); }

}  // namespace
}  // namespace gapscope::testing
