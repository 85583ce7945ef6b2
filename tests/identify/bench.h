// A rig with logs in memory, ready to be identified.
#ifndef GAPSCOPE_TESTS_IDENTIFY_BENCH_H_
#define GAPSCOPE_TESTS_IDENTIFY_BENCH_H_

#include <gtest/gtest.h>

#include <string>
#include <vector>

#include "src/identify/identification.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {

struct Bench {
  std::shared_ptr<const Model> model;
  std::vector<double> values;
  std::vector<Recording> recordings;
  IdentifyInput input() const { return {.model = *model, .values = values, .recordings = recordings}; }
};

inline Bench LoadBench(const std::string& rig, const std::vector<std::string>& logs,
                       const std::string& file = "experiment.yaml") {
  Bench bench;
  const auto experiment = LoadExperiment(std::string(GAPSCOPE_SOURCE_DIR) + "/models/" + rig + "/" + file);
  EXPECT_TRUE(experiment.ok()) << experiment.error().Text();
  const auto model = Model::Load(experiment.value());
  EXPECT_TRUE(model.ok()) << model.error().Text();
  bench.model = model.value();
  bench.values = bench.model->Nominal();
  for (const auto& log : logs) {
    auto recording = LoadRecording(experiment.value(), log);
    EXPECT_TRUE(recording.ok()) << recording.error().Text();
    if (recording.ok()) bench.recordings.push_back(std::move(recording).value());
  }
  return bench;
}

// The truth lies in the interval, and the interval is narrower than `share` of the truth: an interval that holds
// everything says nothing.
inline void ExpectRecovered(const Identification& result, const std::string& name, double truth, double share) {
  const Estimate* e = result.Find(name);
  ASSERT_NE(e, nullptr) << name;
  EXPECT_LE(e->low, truth) << name << " " << e->value;
  EXPECT_GE(e->high, truth) << name << " " << e->value;
  EXPECT_LT(e->high - e->low, share * std::abs(truth)) << name << ": " << e->low << " .. " << e->high;
}

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_IDENTIFY_BENCH_H_
