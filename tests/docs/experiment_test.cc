// docs/reference/experiment.md names every key and every field that the program knows, and its example loads. What the
// program knows is asked from its own error messages, which list what is allowed.
#include "src/experiment/experiment.h"

#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <sstream>

#include "src/core/file.h"
#include "src/core/mujoco_handles.h"
#include "src/model/fields.h"

namespace gapscope {
namespace {

std::string Doc() {
  const auto file = ReadFile(std::string(GAPSCOPE_SOURCE_DIR) + "/docs/reference/experiment.md");
  return file.ok() ? file.value() : "";
}

// Each item of "a, b, c" stands in the document as `a`.
void ExpectDocumented(const std::string& list, const std::string& what) {
  const std::string doc = Doc();
  std::stringstream items(list);
  for (std::string item; std::getline(items, item, ',');) {
    item.erase(0, item.find_first_not_of(' '));
    EXPECT_NE(doc.find("`" + item + "`"), std::string::npos) << what << ": " << item;
  }
}

std::string AllowedKeys(const std::string& yaml) {
  const std::string path =
      std::filesystem::temp_directory_path() / ("gapscope_docs_" + std::to_string(::getpid()) + ".yaml");
  EXPECT_TRUE(WriteFile(path, yaml).ok());
  const auto experiment = LoadExperiment(path);
  std::filesystem::remove(path);
  EXPECT_FALSE(experiment.ok()) << yaml;
  if (experiment.ok()) return "";
  EXPECT_EQ(experiment.error().what.rfind("unknown key", 0), 0u) << experiment.error().Text();
  return experiment.error().allowed;
}

TEST(ExperimentDocTest, NamesEveryKey) {
  const std::string measured = "measured: [{signal: a, joint: a}]\n";
  const std::pair<const char*, std::string> maps[] = {
      {"top", "model: m.xml\nzzz: 1\n" + measured},
      {"log", "model: m.xml\nlog: {zzz: 1}\n" + measured},
      {"time", "model: m.xml\nlog: {time: {zzz: 1}}\n" + measured},
      {"companion", "model: m.xml\nlog: {companions: [{find: a, replace: b, zzz: 1}]}\n" + measured},
      {"repair", "model: m.xml\nlog: {repair: {zzz: 1}}\n" + measured},
      {"value", "model: m.xml\nvalues: {v: {header: h, zzz: 1}}\n" + measured},
      {"command", "model: m.xml\ncommands: [{actuator: a, column: c, zzz: 1}]\n" + measured},
      {"actuator", "model: m.xml\nactuators: [{name: a, joint: j, kp: 1, zzz: 1}]\n" + measured},
      {"measured", "model: m.xml\nmeasured: [{signal: a, joint: a, zzz: 1}]\n"},
      {"parameter", "model: m.xml\nparameters: {p: {unit: s, nominal: 1, frozen: true, zzz: 1}}\n" + measured},
      {"candidate",
       "model: m.xml\ncandidates: [{name: n, joint: j, torque: k, parameters: {k: {unit: 1, bounds: [0, 1]}}, "
       "zzz: 1}]\n" +
           measured},
      {"parameter of a candidate",
       "model: m.xml\ncandidates: [{name: n, joint: j, torque: k, parameters: {k: {unit: 1, "
       "bounds: [0, 1], zzz: 1}}}]\n" +
           measured},
      {"limit", "model: m.xml\nlimits: [{joint: a, zzz: 1}]\n" + measured},
      {"replay", "model: m.xml\nreplay: {zzz: 1}\n" + measured},
  };
  for (const auto& [what, yaml] : maps) ExpectDocumented(AllowedKeys(yaml), what);
}

TEST(ExperimentDocTest, NamesEveryLogFormatAndKindOfSignal) {
  for (const LogReader& reader : LogReaders()) ExpectDocumented(reader.name, "log format");
  for (const SignalTraits& traits : AllSignalTraits()) ExpectDocumented(traits.name, "kind of signal");
}

TEST(ExperimentDocTest, NamesEveryField) {
  char error[500] = "";
  SpecPtr spec(
      mj_parseXMLString("<mujoco><worldbody><body name='b'><joint name='j'/><geom size='1'/></body></worldbody>"
                        "<tendon><fixed name='t'><joint joint='j' coef='1'/></fixed></tendon><actuator><motor name='a' "
                        "joint='j'/></actuator></mujoco>",
                        nullptr, error, sizeof error));
  ASSERT_TRUE(spec) << error;
  ModelPtr model(mj_compile(spec.get(), nullptr));
  ASSERT_TRUE(model);
  for (const char* field : {"zzz/j/x", "joint/j/zzz", "body/b/zzz", "tendon/t/zzz", "actuator/a/zzz"}) {
    const auto resolved = ResolveField(*model, field, "");
    ASSERT_FALSE(resolved.ok());
    ExpectDocumented(resolved.error().allowed, field);
  }
}

TEST(ExperimentDocTest, ExampleLoads) {
  const std::string doc = Doc(), begin = "```yaml\n";
  const std::size_t from = doc.find(begin), to = doc.find("```", from + begin.size());
  ASSERT_NE(from, std::string::npos);
  ASSERT_NE(to, std::string::npos);
  const std::string path =
      std::filesystem::temp_directory_path() / ("gapscope_docs_example_" + std::to_string(::getpid()) + ".yaml");
  ASSERT_TRUE(WriteFile(path, doc.substr(from + begin.size(), to - from - begin.size())).ok());
  const auto experiment = LoadExperiment(path);
  std::filesystem::remove(path);
  EXPECT_TRUE(experiment.ok()) << experiment.error().Text();
}

}  // namespace
}  // namespace gapscope
