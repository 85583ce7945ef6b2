// A good experiment file becomes exactly what it says; every shipped one loads; mutated ones never crash.
#include "src/experiment/experiment.h"

#include <gtest/gtest.h>

#include <chrono>
#include <cstdlib>
#include <numbers>
#include <random>

#include "src/experiment/recording.h"
#include "tests/experiment/good.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {
namespace {

constexpr double kDegree = std::numbers::pi / 180;

TEST(ExperimentTest, WhatToTakeOfAForeignFileIsHandedOnAsItStands) {
  const Scratch scratch;
  const std::string text =
      Replaced(kGoodExperiment, "repair:", "source: {topics: [/arm, 7], variable: \"a: 'b\"}\n  repair:");
  const auto loaded = LoadExperiment(scratch.Write("experiment.yaml", text));
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  EXPECT_EQ(loaded.value().read.source, R"({"topics":["/arm","7"],"variable":"a: 'b"})");
}

TEST(ExperimentTest, EveryKeyArrives) {
  const Scratch scratch;
  const std::string path = scratch.Write("rig/experiment.yaml", kGoodExperiment);
  const auto loaded = LoadExperiment(path);
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  const Experiment& e = loaded.value();
  EXPECT_EQ(e.path, path);
  EXPECT_EQ(e.model_path, scratch.Path("rig/robot.xml"));
  ASSERT_NE(e.read.format, nullptr);
  EXPECT_STREQ(e.read.format->name, "csv");
  EXPECT_EQ(e.timeline.time_column, "time_s");
  EXPECT_EQ(e.timeline.time_unit, "s");
  EXPECT_EQ(e.read.source, "");
  EXPECT_EQ(e.timeline.missing, MissingRepair::kHold);
  EXPECT_TRUE(e.timeline.missing_stated);
  EXPECT_EQ(e.timeline.repeated, TimeRepair::kDropRows);
  EXPECT_EQ(e.timeline.reversed, TimeRepair::kError);
  EXPECT_EQ(e.timeline.gap_factor, 7);

  ASSERT_EQ(e.values.size(), 1u);
  EXPECT_EQ(e.values[0].name, "log.kp");
  EXPECT_EQ(e.values[0].column, "kp");
  EXPECT_EQ(e.values[0].fallback, 2.0);

  ASSERT_EQ(e.commands.size(), 2u);
  EXPECT_EQ(e.commands[0].actuator, "motor");
  EXPECT_EQ(e.commands[0].columns, std::vector<std::string>{"u"});
  EXPECT_EQ(e.commands[0].unit, "V");
  EXPECT_DOUBLE_EQ(e.commands[0].factor, 1e-3);
  EXPECT_EQ(e.commands[0].offset, 0.5);
  EXPECT_FALSE(e.commands[0].optional);
  EXPECT_TRUE(e.commands[1].optional);
  EXPECT_TRUE(e.commands[1].columns.empty());
  EXPECT_EQ(e.commands[1].fallback, "log.kp * 2");

  ASSERT_EQ(e.measured.size(), 3u);
  EXPECT_EQ(e.measured[0].signal, "q");
  EXPECT_EQ(e.measured[0].kind, SignalKind::kPosition);
  EXPECT_EQ(e.measured[0].on, "hinge");
  EXPECT_DOUBLE_EQ(e.measured[0].factor, -kDegree);
  EXPECT_EQ(e.measured[0].resolution, 0.001);
  EXPECT_EQ(e.measured[0].wrap, WrapRepair::kUnwrap);
  EXPECT_DOUBLE_EQ(e.measured[0].wrap_period, 2 * std::numbers::pi);
  EXPECT_EQ(e.measured[0].offset_parameter, "hinge.offset");
  EXPECT_TRUE(e.measured[0].scored);
  EXPECT_FALSE(e.measured[0].optional);
  EXPECT_EQ(e.measured[1].columns, (std::vector<std::string>{"speed", "w"}));
  EXPECT_EQ(e.measured[1].kind, SignalKind::kVelocity);
  EXPECT_TRUE(e.measured[1].optional);
  EXPECT_FALSE(e.measured[1].scored);
  EXPECT_EQ(e.measured[2].kind, SignalKind::kTorque);
  EXPECT_EQ(e.measured[2].on, "motor");

  ASSERT_EQ(e.parameters.size(), 3u);
  EXPECT_EQ(e.parameters[0].name, "hinge.damping");
  EXPECT_EQ(e.parameters[0].unit, "N m s/rad");
  EXPECT_EQ(e.parameters[0].doc, "guess");
  EXPECT_EQ(e.parameters[0].nominal, 0.1);
  EXPECT_EQ(e.parameters[0].low, 0);
  EXPECT_EQ(e.parameters[0].high, 1);
  EXPECT_FALSE(e.parameters[0].frozen);
  EXPECT_TRUE(e.parameters[2].frozen);
  EXPECT_EQ(e.parameters[2].low, 2);
  EXPECT_EQ(e.parameters[2].high, 2);

  ASSERT_EQ(e.settings.size(), 2u);
  EXPECT_EQ(e.settings[0].field, "joint/hinge/damping");
  EXPECT_EQ(e.settings[0].expressions, std::vector<std::string>{"hinge.damping"});
  EXPECT_EQ(e.settings[0].where, path + ":22:3");
  EXPECT_EQ(e.settings[1].expressions.size(), 3u);

  EXPECT_EQ(e.replay.mode, ReplayMode::kWindows);
  EXPECT_EQ(e.replay.window_s, 0.5);
  EXPECT_EQ(e.replay.start_s, 0.1);
  EXPECT_EQ(e.replay.while_column, "on");
}

TEST(ExperimentTest, TheShortestFileTakesTheDefaults) {
  const Scratch scratch;
  const auto loaded =
      LoadExperiment(scratch.Write("e.yaml", "model: /rigs/robot.xml\nmeasured:\n  - {signal: q, joint: hinge}\n"));
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  const Experiment& e = loaded.value();
  EXPECT_EQ(e.model_path, "/rigs/robot.xml");
  EXPECT_EQ(e.read.format, nullptr);
  EXPECT_EQ(e.measured[0].columns, std::vector<std::string>{"q"});
  EXPECT_EQ(e.measured[0].factor, 1);
  EXPECT_TRUE(e.commands.empty() && e.parameters.empty() && e.settings.empty() && e.values.empty());
  EXPECT_EQ(e.replay.mode, ReplayMode::kFreeRun);
  EXPECT_EQ(e.replay.window_s, 1.0);
}

TEST(ExperimentTest, WindowsLineEndsAndAByteOrderMarkAreRead) {
  const Scratch scratch;
  std::string text = "\xef\xbb\xbf";
  for (const char c : std::string(kGoodExperiment)) {
    if (c == '\n') text += '\r';
    text += c;
  }
  const auto loaded = LoadExperiment(scratch.Write("e.yaml", text));
  ASSERT_TRUE(loaded.ok()) << loaded.error().Text();
  EXPECT_EQ(loaded.value().replay.while_column, "on");
}

TEST(ExperimentTest, EveryShippedFileLoads) {
  int files = 0;
  for (const auto& rig : std::filesystem::directory_iterator(std::string(GAPSCOPE_SOURCE_DIR) + "/models")) {
    const auto path = rig.path() / "experiment.yaml";
    if (!std::filesystem::exists(path)) continue;
    const auto loaded = LoadExperiment(path.string());
    EXPECT_TRUE(loaded.ok()) << loaded.error().Text();
    if (!loaded.ok()) continue;
    EXPECT_TRUE(std::filesystem::exists(loaded.value().model_path)) << loaded.value().model_path;
    ++files;
  }
  EXPECT_GE(files, 11);
}

// Seeded: the same mutants in every run. GAPSCOPE_MUTATION_SECONDS makes it a longer hunt.
TEST(ExperimentTest, MutatedFilesNeverCrash) {
  const Scratch scratch;
  const std::string csv =
      scratch.Write("log.csv", "time_s,u,q,w,on\n0,1,2,3,1\n0.1,1,2,3,1\n0.2,1,2,3,1\n0.3,1,2,3,1\n");
  const char* seconds = std::getenv("GAPSCOPE_MUTATION_SECONDS");
  const auto deadline =
      std::chrono::steady_clock::now() + std::chrono::duration<double>(seconds ? std::atof(seconds) : 0);
  constexpr int kMutants = 1500;
  const std::vector<std::string> seeds = {kGoodExperiment,
                                          ReadAll(std::string(GAPSCOPE_SOURCE_DIR) + "/models/qube/experiment.yaml"),
                                          ReadAll(std::string(GAPSCOPE_SOURCE_DIR) + "/models/ak80/experiment.yaml")};
  const std::vector<std::string> tokens = {"{",         "}",           "[",    "]",    ":",     ",",      "-",
                                           "- ",        "\n",          "  ",   "\t",   "#",     "&a ",    "*a",
                                           "!!",        "|\n",         ">\n",  "? ",   "---\n", "...\n",  "\"",
                                           "'",         "~",           "null", ".nan", "1e999", "-1e308", "0",
                                           "true",      "<<: ",        "%",    "\\",   "\xff",  "\xc3",   "model: x\n",
                                           "unit: rpm", "wrap: 1e-300"};
  std::mt19937 random(20240601);
  const auto below = [&](std::size_t n) { return static_cast<std::size_t>(random() % n); };
  int accepted = 0, mutants = 0;
  for (; mutants < kMutants || std::chrono::steady_clock::now() < deadline; ++mutants) {
    std::string text = seeds[below(seeds.size())];
    for (std::size_t edits = 1 + below(4); edits > 0; --edits) {
      const std::size_t at = below(text.size());
      switch (below(6)) {
        case 0:
          text[at] = static_cast<char>(below(256));
          break;
        case 1:
          text.erase(at, 1 + below(20));
          break;
        case 2:
          text.insert(at, tokens[below(tokens.size())]);
          break;
        case 3:
          text.insert(at, text.substr(below(text.size()), 1 + below(80)));
          break;
        case 4:
          text.resize(std::max<std::size_t>(at, 1));
          break;
        case 5:
          text.replace(at, 1, tokens[below(tokens.size())]);
          break;
      }
      if (text.empty()) text = " ";
    }
    const std::string path = scratch.Write("mutant.yaml", text);
    const auto loaded = LoadExperiment(path);
    if (!loaded.ok()) {
      ASSERT_EQ(loaded.error().Text().rfind(path + ":", 0), 0u) << loaded.error().Text() << "\n" << text;
      continue;
    }
    ++accepted;
    const auto recording = LoadRecording(loaded.value(), csv);
    EXPECT_TRUE(recording.ok() || !recording.error().Text().empty());
  }
  EXPECT_GT(accepted, mutants / 100);
  EXPECT_LT(accepted, mutants);
}

}  // namespace
}  // namespace gapscope::testing
