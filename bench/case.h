// A rig of models/ with a recording made here, so that the benchmark needs no data: sine sweeps as commands, sampled as
// the rig's logs are.
#ifndef GAPSCOPE_BENCH_CASE_H_
#define GAPSCOPE_BENCH_CASE_H_

#include <memory>
#include <string>
#include <vector>

#include "replay/replay.h"

namespace gapscope::bench {

struct Case {
  std::string rig;
  std::shared_ptr<const Model> model;
  std::vector<Recording> recordings;  // one
  double time_step_s = 0;             // the model's own
  std::vector<double> values;
};

// The rigs that MakeCase knows.
std::vector<std::string> Rigs();

// `duration_s` of a rig; the measured signals are what the model itself does, so that windows start in states that
// belong to the motion. Errors: those of loading models/RIG.
Result<Case> MakeCase(const std::string& rig, double duration_s);

}  // namespace gapscope::bench

#endif  // GAPSCOPE_BENCH_CASE_H_
