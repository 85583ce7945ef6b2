// Each experiment file against its MJCF: every field of `set` exists and, at the nominal values, is what the MJCF
// already holds, so that the bare MJCF and the experiment describe the same rig; bounds, units and signals as
// users of the rigs rely on.
#include <gtest/gtest.h>
#include <muParser.h>
#include <yaml-cpp/yaml.h>

#include <filesystem>
#include <optional>
#include <sstream>

#include "src/core/units.h"
#include "tests/models/rig.h"

namespace gapscope::testing {
namespace {

std::string Folder(const std::string& rig) { return std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + rig; }
YAML::Node Experiment(const std::string& rig) { return YAML::LoadFile(Folder(rig) + "/experiment.yaml"); }

double Evaluate(const std::string& rig, const YAML::Node& experiment, const std::string& text) {
  mu::Parser parser;
  parser.DefineNameChars("0123456789_.abcdefghijklmnopqrstuvwxyzABCDEFGHIJKLMNOPQRSTUVWXYZ");
  parser.DefineConst("pi", 3.14159265358979323846);
  for (const auto& p : experiment["parameters"])
    parser.DefineConst(p.first.as<std::string>(), p.second["nominal"].as<double>());
  for (const auto& [name, value] : FactsOfRig(rig).log_values) parser.DefineConst(name, value);
  try {
    parser.SetExpr(text);
    return parser.Eval();
  } catch (const mu::Parser::exception_type& e) {
    ADD_FAILURE() << rig << ": '" << text << "': " << e.GetMsg();
    return NAN;
  }
}

// The values of a field of the compiled model; nothing when the name or the attribute is unknown.
std::optional<std::vector<double>> ModelField(const mjModel& m, const std::string& field) {
  std::vector<std::string> parts;
  std::stringstream stream(field);
  for (std::string part; std::getline(stream, part, '/');) parts.push_back(part);
  const auto some = [](const mjtNum* p, int n) { return std::vector<double>(p, p + n); };
  if (field == "option/gravity") return some(m.opt.gravity, 3);
  if (parts.size() == 2 && parts[0] == "numeric") {
    const int id = mj_name2id(&m, mjOBJ_NUMERIC, parts[1].c_str());
    return id < 0 ? std::nullopt : std::optional(some(m.numeric_data + m.numeric_adr[id], m.numeric_size[id]));
  }
  if (parts.size() != 3) return std::nullopt;
  if (parts[0] == "joint") {
    const int id = mj_name2id(&m, mjOBJ_JOINT, parts[1].c_str());
    if (id < 0) return std::nullopt;
    const int dof = m.jnt_dofadr[id];
    if (parts[2] == "damping") return some(m.dof_damping + dof, 1);
    if (parts[2] == "frictionloss") return some(m.dof_frictionloss + dof, 1);
    if (parts[2] == "armature") return some(m.dof_armature + dof, 1);
    if (parts[2] == "stiffness") return some(m.jnt_stiffness + id, 1);
  }
  if (parts[0] == "body") {
    const int id = mj_name2id(&m, mjOBJ_BODY, parts[1].c_str());
    if (id < 0) return std::nullopt;
    if (parts[2] == "mass") return some(m.body_mass + id, 1);
    if (parts[2] == "inertia") return some(m.body_inertia + 3 * id, 3);
    if (parts[2] == "ipos") return some(m.body_ipos + 3 * id, 3);
    if (parts[2] == "pos") return some(m.body_pos + 3 * id, 3);
  }
  if (parts[0] == "actuator") {
    const int id = mj_name2id(&m, mjOBJ_ACTUATOR, parts[1].c_str());
    if (id < 0) return std::nullopt;
    if (m.actuator_plugin[id] >=
        0) {  // a motor plugin's live parameter is the numeric INSTANCE.KEY; the instances bear their motors' names
      const int numeric = mj_name2id(&m, mjOBJ_NUMERIC, (parts[1] + "." + parts[2]).c_str());
      return numeric < 0 ? std::nullopt
                         : std::optional(some(m.numeric_data + m.numeric_adr[numeric], m.numeric_size[numeric]));
    }
    if (parts[2] == "kp" || parts[2] == "gain") return some(m.actuator_gainprm + id * mjNGAIN, 1);
    if (parts[2] == "kv") return std::vector<double>{-m.actuator_biasprm[id * mjNBIAS + 2]};
    if (parts[2] == "bias2") return some(m.actuator_biasprm + id * mjNBIAS + 2, 1);
    if (parts[2] == "ctrlrange") return some(m.actuator_ctrlrange + 2 * id, 2);
  }
  return std::nullopt;
}

std::vector<std::string> Texts(const YAML::Node& node) {
  std::vector<std::string> texts;
  if (node.IsScalar()) return {node.as<std::string>()};
  for (const auto& item : node) texts.push_back(item.as<std::string>());
  return texts;
}

// These rigs give another rig's mechanism their own values, or tilt gravity by the published offset.
bool DiffersFromItsMjcf(const std::string& rig, const std::string& field) {
  return FactsOfRig(rig).own_values || field == "option/gravity";
}

TEST(ExperimentFilesTest, SetReproducesTheMjcfAtTheNominalValues) {
  constexpr double kRelative = 2e-4;  // the MJCFs of the servos hold rounded gains
  for (const auto& rig : RigNames()) {
    const ModelPtr m = LoadRig(rig);
    ASSERT_NE(m, nullptr);
    const YAML::Node experiment = Experiment(rig);
    EXPECT_EQ(experiment["schema"].as<std::string>(), "gapscope.experiment/1");
    EXPECT_TRUE(std::filesystem::exists(Folder(rig) + "/" + experiment["model"].as<std::string>()));
    for (const auto& entry : experiment["set"]) {
      const std::string field = entry.first.as<std::string>();
      const auto actual = ModelField(*m, field);
      ASSERT_TRUE(actual.has_value()) << rig << ": no field " << field;
      const auto texts = Texts(entry.second);
      ASSERT_EQ(texts.size(), actual->size()) << rig << ": " << field;
      for (std::size_t i = 0; i < texts.size(); ++i) {
        const double value = Evaluate(rig, experiment, texts[i]);
        EXPECT_TRUE(std::isfinite(value)) << rig << ": " << field;
        if (DiffersFromItsMjcf(rig, field)) continue;
        EXPECT_NEAR(value, (*actual)[i], kRelative * std::abs((*actual)[i]) + 1e-12)
            << rig << ": " << field << "[" << i << "]";
      }
    }
  }
}

// A body's principal inertias must stay possible, or a tuned model could not be written out.
TEST(ExperimentFilesTest, InertiasObeyTheTriangleInequality) {
  for (const auto& rig : RigNames()) {
    const YAML::Node experiment = Experiment(rig);
    for (const auto& entry : experiment["set"]) {
      if (!entry.first.as<std::string>().ends_with("/inertia")) continue;
      std::vector<double> inertia;
      for (const auto& text : Texts(entry.second)) inertia.push_back(Evaluate(rig, experiment, text));
      ASSERT_EQ(inertia.size(), 3u);
      std::sort(inertia.begin(), inertia.end());
      EXPECT_GE(inertia[0] + inertia[1], inertia[2]) << rig << ": " << entry.first.as<std::string>();
    }
  }
}

TEST(ExperimentFilesTest, ParametersHaveUnitsBoundsAndSources) {
  for (const auto& rig : RigNames()) {
    for (const auto& p : Experiment(rig)["parameters"]) {
      const std::string name = rig + ": " + p.first.as<std::string>();
      EXPECT_TRUE(p.second["unit"]) << name;
      EXPECT_FALSE(p.second["doc"].as<std::string>("").empty()) << name;
      const double nominal = p.second["nominal"].as<double>();
      if (!p.second["bounds"]) {
        EXPECT_TRUE(p.second["frozen"].as<bool>(false)) << name;
        continue;
      }
      EXPECT_LE(p.second["bounds"][0].as<double>(), nominal) << name;
      EXPECT_GE(p.second["bounds"][1].as<double>(), nominal) << name;
    }
  }
}

TEST(ExperimentFilesTest, Signals) {
  for (const auto& rig : RigNames()) {
    std::vector<std::string> found;
    for (const auto& item : Experiment(rig)["measured"]) {
      found.push_back(item["signal"].as<std::string>());
      EXPECT_TRUE(ParseUnit(item["unit"].as<std::string>()).ok()) << rig;
    }
    EXPECT_EQ(found, FactsOfRig(rig).signals) << rig;
  }
}

TEST(ExperimentFilesTest, ColumnsOfTheContract) {
  int rigs = 0;
  for (const auto& rig : RigNames()) {
    const std::string& column = FactsOfRig(rig).command;
    if (column.empty()) continue;
    ++rigs;
    const YAML::Node experiment = Experiment(rig);
    EXPECT_EQ(experiment["commands"][0]["actuator"].as<std::string>(), "motor");
    EXPECT_EQ(experiment["commands"][0]["column"].as<std::string>(), column);
    EXPECT_EQ(experiment["log"]["time"]["column"].as<std::string>(), "time_s");
    for (const auto& item : experiment["measured"])
      EXPECT_EQ(item["column"].as<std::string>(), item["signal"].as<std::string>());
  }
  EXPECT_GE(rigs, 4);
}

TEST(ExperimentFilesTest, PublishedParametersNameParameters) {
  for (const auto& rig : RigNames()) {
    if (!std::filesystem::exists(Folder(rig) + "/published_m1.yaml")) continue;
    const YAML::Node published = YAML::LoadFile(Folder(rig) + "/published_m1.yaml"),
                     parameters = Experiment(rig)["parameters"];
    EXPECT_GE(published.size(), 6u);
    for (const auto& p : published) {
      const YAML::Node parameter = parameters[p.first.as<std::string>()];
      ASSERT_TRUE(parameter) << rig << ": " << p.first.as<std::string>();
      EXPECT_NEAR(p.second.as<double>(), parameter["nominal"].as<double>(),
                  1e-3 * std::abs(p.second.as<double>()) + 1e-5);
    }
  }
}

}  // namespace
}  // namespace gapscope::testing
