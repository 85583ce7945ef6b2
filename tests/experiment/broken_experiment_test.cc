// Experiment files as users break them: each gives an Error with file:line:column, what was found and what would do.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdlib>
#include <vector>

#include "src/experiment/experiment.h"
#include "tests/experiment/good.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

// The good file with `from` replaced by `to`; `says` are parts of the message. The error stands on the line of the
// change, or on `line` (1-based).
struct Broken {
  const char* from;
  const char* to;
  std::vector<const char*> says;
  int line = 0;
};

// Loads a text; "" when it was accepted, else the message, checked to name file, line and column.
std::string MessageOf(const Scratch& scratch, const std::string& text, int* line = nullptr) {
  const std::string path = scratch.Write("experiment.yaml", text);
  const auto loaded = LoadExperiment(path);
  if (loaded.ok()) return "";
  const std::string message = loaded.error().Text();
  EXPECT_EQ(message.find('\n'), std::string::npos) << message;
  EXPECT_LT(message.size(), 1500u);
  // path:LINE:COLUMN: or path:LINE:
  EXPECT_EQ(message.rfind(path + ":", 0), 0u) << message;
  char* end = nullptr;
  const long found = std::strtol(message.c_str() + path.size() + 1, &end, 10);
  EXPECT_GE(found, 1) << message;
  if (*end == ':' && end[1] != ' ') {
    EXPECT_GE(std::strtol(end + 1, &end, 10), 1) << message;
  }
  EXPECT_EQ(std::string(end, 2), ": ") << message;
  if (line) *line = static_cast<int>(found);
  return message;
}

TEST(BrokenExperimentTest, TheGoodFileIsGood) {
  const Scratch scratch;
  EXPECT_EQ(MessageOf(scratch, kGoodExperiment), "");
}

const std::vector<Broken>& Table() {
  static const std::vector<Broken> table = {
      // Keys.
      {"model: robot.xml", "modle: robot.xml", {"has no 'model'"}, 1},
      {"doc: \"a rig\"", "docs: x", {"unknown key", "'docs'", "did you mean 'doc'?"}},
      {"commands:", "comands:", {"unknown key", "'comands'", "did you mean 'commands'?"}},
      {"format: csv", "fromat: csv", {"'log'", "'fromat'", "did you mean 'format'?"}},
      {"column: time_s, unit: s", "colum: time_s, unit: s", {"'time'", "'colum'", "did you mean 'column'?"}},
      {"missing: hold", "mising: hold", {"'repair'", "did you mean 'missing'?"}},
      {"{column: kp, default: 2}", "{column: kp, defualt: 2}", {"log value 'log.kp'", "did you mean 'default'?"}},
      {"actuator: motor, column: u", "actuator: motor, colunm: u", {"no 'column' is named"}},
      {"actuator: motor, column: u", "actuator: motor, column: u, colour: red", {"a command", "'colour'"}},
      {"resolution: 0.001", "resolutoin: 0.001", {"a measured signal", "did you mean 'resolution'?"}},
      {"resolution: 0.001", "sensor: imu", {"exactly one of 'joint'", "'sensor'"}},
      {"resolution: 0.001", "element: 1", {"'element' counts a sensor's numbers"}},
      {"resolution: 0.001", "columns_of_elements: [a, b]", {"one for each of its numbers"}},
      {"nominal: 0.1", "nominall: 0.1", {"'hinge.damping'", "'nominal'"}},
      {"frozen: true", "frozn: true", {"'motor.gain'"}},
      {"window_s: 0.5", "windows_s: 0.5", {"'replay'", "did you mean 'window_s'?"}},
      {"model: robot.xml", "model: robot.xml\nmodel: other.xml", {"'model' stands twice"}, 4},
      {"unit: N m/V, nominal: 2", "unit: N m/V, nominal: 2, nominal: 3", {"'nominal' stands twice"}},
      {"  hinge.offset:", "  hinge.damping:", {"'hinge.damping' stands twice"}},
      {"  body/bar/inertia:", "  joint/hinge/damping:", {"'joint/hinge/damping' stands twice"}},
      {"model: robot.xml", "model: robot.xml\n? [a, b]\n: c", {"is not a text"}, 4},
      {"model: robot.xml", "model:", {"has no 'model'"}, 1},
      {"model: robot.xml", "model: \"\"", {"'model' is empty"}, 1},
      {"model: robot.xml", "model: [robot.xml]", {"'model'", "not a text"}},
      // Schema and choices.
      {"gapscope.experiment/1", "gapscope.experiment/2", {"unknown schema", "gapscope.experiment/1"}},
      {"format: csv",
       "format: cvs",
       {"'format'", "'cvs'", "auto, npz, bam_json, csv_lists, csv", "did you mean 'csv'?"}},
      {"time_s, unit: s", "time_s, unit: minutes", {"'unit'", "'minutes'"}},
      {"repeated: drop_rows", "repeated: drop", {"'repeated'", "drop_rows, error"}},
      {"kind: velocity", "kind: speed", {"'kind'", "position, velocity, torque"}},
      {"mode: windows", "mode: window", {"'mode'", "did you mean 'windows'?"}},
      {"optional: true, score: false", "optional: yes, score: false", {"'optional'", "false, true"}},
      // Types.
      {"log:\n  format: csv\n  time: {column: time_s, unit: s}\n  repair: {missing: hold, repeated: drop_rows, "
       "reversed: error, gap_factor: 7}\n",
       "log: none\n",
       {"'log' is not a map"},
       4},
      {"time: {column: time_s, unit: s}", "time: time_s", {"'time' is not a map"}},
      {"repair: {missing: hold, repeated: drop_rows, reversed: error, gap_factor: 7}",
       "repair: [hold]",
       {"'repair' is not a map"}},
      {"{column: kp, default: 2}", "7", {"'log.kp'", "is not a map"}},
      {"  - {actuator: motor, column: u, unit: mV, add: 0.5}\n  - {actuator: aux, default: log.kp * 2}\n",
       "  motor: u\n",
       {"'commands' is not a list"},
       11},
      {"commands:\n  - {actuator: motor, column: u, unit: mV, add: 0.5}\n  - {actuator: aux, default: log.kp * 2}\n",
       "commands: motor\n",
       {"'commands' is not a list"}},
      {"  - {actuator: aux, default: log.kp * 2}", "  - aux", {"a command is not a map"}},
      {"  - {signal: w,", "  - [signal]\n  - {signal: w,", {"a measured signal is not a map"}},
      {"repair:", "source: 3\n  repair:", {"'source' is no mapping"}},
      {"repair:", "companions: {find: a}\n  repair:", {"'companions' is not a list"}},
      {"repair:", "companions:\n    - {find: \"\", replace: b}\n  repair:", {"'find' of a companion is empty"}, 8},
      {"{unit: rad, nominal: 0, bounds: [-0.1, 0.1]}", "0.3", {"'hinge.offset'", "is not a map"}},
      {"columns: [speed, w]", "columns: [[speed], w]", {"'columns'", "not a text or a list of texts"}},
      {"joint/hinge/damping: hinge.damping", "joint/hinge/damping:", {"has no expression"}},
      {"joint/hinge/damping: hinge.damping", "joint/hinge/damping: {a: b}", {"joint/hinge/damping"}},
      {"set:\n  joint/hinge/damping: hinge.damping\n  body/bar/inertia: [\"1e-4\", \"2 * hinge.damping\", \"1e-4\"]\n",
       "set: [a]\n",
       {"'set' is not a map"},
       21},
      // Numbers.
      {"nominal: 0.1", "nominal: abc", {"'nominal'", "'hinge.damping'", "not a finite number", "'abc'"}},
      {"nominal: 0.1", "nominal: .nan", {"not a finite number", "'.nan'"}},
      {"nominal: 0.1", "nominal: nan", {"not a finite number"}},
      {"nominal: 0.1", "nominal: .inf", {"not a finite number"}},
      {"nominal: 0.1", "nominal: 1e999", {"not a finite number", "'1e999'"}},
      {"nominal: 0.1", "nominal: 0,1", {"'hinge.damping'"}},
      {"nominal: 0.1", "nominal: \"0,1\"", {"not a finite number", "'0,1'"}},
      {"nominal: 0.1", "nominal: 0x1p3", {"not a finite number"}},
      {"nominal: 0.1", "nominal: +-0.1", {"not a finite number"}},
      {"nominal: 0.1", "nominal:", {"not a finite number"}},
      {"nominal: 0.1", "nominal: [0.1]", {"not a finite number"}},
      {"bounds: [0, 1]", "bounds: [1, 0]", {"outside its bounds"}},
      {"bounds: [0, 1]", "bounds: [0.2, 1]", {"outside its bounds"}},
      {"bounds: [0, 1]", "bounds: [0]", {"list of 2 finite numbers"}},
      {"bounds: [0, 1]", "bounds: [0, 1, 2]", {"list of 2 finite numbers"}},
      {"bounds: [0, 1]", "bounds: [0, .inf]", {"list of 2 finite numbers"}},
      {"bounds: [0, 1]", "bounds: 0..1", {"list of 2 finite numbers"}},
      {", bounds: [0, 1]", "", {"'hinge.damping' has no bounds", "frozen: true"}},
      {"unit: N m s/rad, nominal", "nominal", {"has no 'unit'"}},
      {"gap_factor: 7", "gap_factor: -7", {"'gap_factor'"}},
      {"window_s: 0.5", "window_s: 0", {"'window_s' must be above"}},
      {"start_s: 0.1", "start_s: -1", {"'start_s' not below zero"}},
      {"resolution: 0.001", "resolution: -0.001", {"'resolution' is negative"}},
      {"resolution: 0.001", "filter: {cutoff_rad_per_s: hinge.damping}", {"'filter'", "'damping_ratio'"}},
      {"wrap: 6.283185307179586", "wrap: 0", {"'wrap' is the period"}},
      {"unit: deg, scale: -1", "unit: deg, scale: 0", {"'scale'"}},
      {"unit: mV, add: 0.5", "unit: rev/s, scale: -1.7e308", {"'scale'"}},
      // Units, names, columns.
      {"unit: mV", "unit: mVolt", {"unknown unit", "mVolt"}},
      {"unit: deg", "unit: degg", {"unknown unit", "degg"}},
      {"unit: deg", "unit: V", {"does not fit its kind", "'V'"}},
      {"unit: N m, optional", "unit: rad, optional", {"'tau' does not fit its kind"}},
      {"actuator: aux", "actuator: motor", {"two commands drive the actuator 'motor'"}},
      {"{actuator: aux, ", "{", {"a command has no 'actuator'"}},
      {"signal: w", "signal: q", {"'q' stands twice"}},
      {"{signal: w, ", "{", {"has no 'signal'"}},
      {"kind: velocity, joint: hinge", "kind: velocity", {"'w' needs exactly one of"}},
      {"kind: velocity, joint: hinge", "kind: velocity, joint: hinge, actuator: motor", {"'w' needs exactly one of"}},
      {"kind: torque, actuator: motor", "kind: torque, joint: hinge", {"'tau' needs exactly one of"}},
      {"{column: kp, default: 2}", "{default: 2}", {"needs either 'header' or 'column'"}},
      {"{column: kp, default: 2}", "{column: kp, header: kp}", {"needs either 'header' or 'column'"}},
      {"  motor.gain:", "  \"motor gain\":", {"'motor gain'", "name"}},
      {"  motor.gain:", "  \"\":", {"name"}},
      {"  motor.gain:", "  2gain:", {"'2gain'", "name"}},
      {"  motor.gain:", "  pi:", {"'pi'", "name"}},
      {"  motor.gain:", "  log.kp:", {"'log.kp'", "twice"}},
      {"  log.kp:", "  \"log-kp\":", {"'log-kp'", "name"}},
      // Not YAML.
      {"bounds: [0, 1]", "bounds: [0, 1", {"not valid YAML"}, -1},
      {"doc: \"a rig\"", "doc: \"a rig", {"not valid YAML"}, -1},
      {"  format: csv", "\tformat: csv", {"not valid YAML"}, -1},
      {"doc: \"a rig\"", "doc: *nowhere", {"not valid YAML"}, -1},
      {"doc: \"a rig\"", "doc: \"\\q\"", {"not valid YAML"}, -1},
      {"replay: {", "---\nmodel: other.xml\nreplay: {", {"more than one document"}, -1},
  };
  return table;
}

TEST(BrokenExperimentTest, EveryDefectIsNamedWithItsPlace) {
  const Scratch scratch;
  const std::string good = kGoodExperiment;
  EXPECT_GE(Table().size(), 60u);
  for (const Broken& broken : Table()) {
    SCOPED_TRACE(std::string("'") + broken.from + "' -> '" + broken.to + "'");
    const std::size_t at = good.find(broken.from);
    ASSERT_NE(at, std::string::npos);
    int line = 0;
    const std::string message = MessageOf(scratch, Replaced(good, broken.from, broken.to), &line);
    if (message.empty()) {
      ADD_FAILURE() << "accepted";
      continue;
    }
    for (const char* part : broken.says)
      EXPECT_NE(message.find(part), std::string::npos) << message << "\nlacks: " << part;
    if (broken.line >= 0) {
      int expected = broken.line;
      if (expected == 0) {
        // The line of the first character that differs.
        std::size_t same = 0;
        while (broken.from[same] && broken.from[same] == broken.to[same]) ++same;
        expected =
            1 + static_cast<int>(std::count(good.begin(), good.begin() + static_cast<std::ptrdiff_t>(at + same), '\n'));
      }
      EXPECT_EQ(line, expected) << message;
    }
  }
}

TEST(BrokenExperimentTest, SomethingMustBeMeasured) {
  const Scratch scratch;
  for (const char* measured : {"", "measured:\n", "measured: q\n", "measured: {q: 1}\n", "measured: []\n"}) {
    EXPECT_NE(MessageOf(scratch, std::string("model: robot.xml\n") + measured).find("nothing is measured"),
              std::string::npos)
        << measured;
  }
}

TEST(BrokenExperimentTest, TheColumnIsThatOfTheKeyOrValue) {
  const Scratch scratch;
  // "  hinge.damping: {unit: N m s/rad, nominal: 0.1": the value stands in column 45.
  const std::string text = Replaced(kGoodExperiment, "nominal: 0.1", "nominal: abc");
  EXPECT_NE(MessageOf(scratch, text).find("experiment.yaml:18:45: "), std::string::npos) << MessageOf(scratch, text);
  const std::string key = Replaced(kGoodExperiment, "comm", "com");
  EXPECT_NE(MessageOf(scratch, key).find("experiment.yaml:10:1: "), std::string::npos) << MessageOf(scratch, key);
}

TEST(BrokenExperimentTest, WholeFilesThatAreNoExperiment) {
  const Scratch scratch;
  const std::string good = kGoodExperiment;
  std::string binary =
      "\x7f"
      "ELF\x02\x01\x01";
  binary += std::string(64, '\0');
  std::string noise;
  for (int i = 0; i < 4096; ++i) noise += static_cast<char>(1 + (i * 7919) % 255);
  std::string dashes, marks, brackets;
  for (int i = 0; i < 5000; ++i) dashes += "- ", marks += "? ", brackets += "[\n# ]\n";
  std::string bomb = "a: &a [x, x, x, x, x, x, x, x, x]\n";
  for (char c = 'b'; c < 'k'; ++c) {
    bomb.append(1, c).append(": &").append(1, c).append(" [");
    for (int i = 0; i < 9; ++i) bomb.append(i ? ", *" : "*").append(1, static_cast<char>(c - 1));
    bomb.append("]\n");
  }
  std::string staircase;
  for (int i = 0; i < 1400; ++i) staircase += std::string(static_cast<std::size_t>(i), ' ') + "a:\n";
  const std::vector<std::string> files = {
      "", " \n\n", "# only a comment\n", "---\n", "~\n", "[]\n", "{}\n", "hello\n", "- a\n- b\n", "42\n", binary, noise,
      "\xff\xfe"
      "m\0o\0",
      "time_s,q\n0,1\n", "{\"kp\": 32, \"entries\": []}\n", "<mujoco/>\n", bomb, bomb + good, "a: &a [*a]\n",
      "model: &m\n  x: *m\n", "<<: *x\n", std::string(100000, '['), std::string(100000, '{'),
      "#" + std::string(100000, ']') + "\n" + std::string(100000, '['), std::string(5000, '-') + " a", dashes + "a",
      marks + "a", staircase, brackets, "model: " + std::string(1 << 20, 'x') + "\n",
      "model: robot.xml\n" + std::string(900000, '\n') + "bad key\n", std::string(900000, 'a') + "\n",
      std::string(300000, '!'), std::string(300000, '&'), "%YAML 9.9\n---\nmodel: x\n",
      "%TAG ! !!\n---\n!!binary abc\n", "model: !!int robot.xml\nmeasured: !!set {}\n", "\"\\U00110000\": 1\n", "? \n",
      ": \n", "|\n", "key: |99\n x\n", "&a &b c\n", "*a : b\n",
      // Kept yaml-cpp's LoadAll busy for ever.
      ", a\nb: c\n", std::string(", a\n") + good};
  EXPECT_GE(files.size(), 40u);
  for (const std::string& file : files) {
    SCOPED_TRACE(file.substr(0, 60));
    EXPECT_NE(MessageOf(scratch, file), "") << "accepted";
  }
}

TEST(BrokenExperimentTest, FilesThatAreNotThere) {
  const Scratch scratch;
  for (const std::string& path : {scratch.Path("none.yaml"), scratch.Path(""), std::string(""),
                                  scratch.Path("none/none.yaml"), std::string("/dev/null")}) {
    const auto loaded = LoadExperiment(path);
    ASSERT_FALSE(loaded.ok()) << path;
    EXPECT_EQ(loaded.error().Text().rfind(path, 0), 0u) << loaded.error().Text();
  }
}

TEST(BrokenExperimentTest, ParameterFiles) {
  const Scratch scratch;
  const auto load = [&](const std::string& text) { return LoadParameterValues(scratch.Write("params.yaml", text)); };
  const auto good = load("doc: a fit\nmotor.gain: 2.5\nhinge.damping: +1e-3\n");
  ASSERT_TRUE(good.ok());
  EXPECT_EQ(good.value(), (std::map<std::string, double>{{"motor.gain", 2.5}, {"hinge.damping", 1e-3}}));
  for (const char* text : {"motor.gain: a\n", "motor.gain: .nan\n", "motor.gain: [1]\n",
                           "motor.gain: 1\nmotor.gain: 2\n", "- 1\n", "1\n", "[a]: 1\n", "motor.gain:\n", ""}) {
    const auto bad = load(text);
    ASSERT_FALSE(bad.ok()) << text;
    EXPECT_NE(bad.error().Text().find("params.yaml:"), std::string::npos) << bad.error().Text();
  }
}

}  // namespace
}  // namespace gapscope::testing
