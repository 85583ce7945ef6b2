// What every run's result begins and ends with: seed and versions; the models that it speaks of are by names. A run
// (ReplayRun, TuneRun, ...) is the typed value behind a command's result: JSON, console table and page are made of it.
#ifndef GAPSCOPE_REPORT_RUN_H_
#define GAPSCOPE_REPORT_RUN_H_

#include <cstdint>
#include <string>

#include "src/model/run_model.h"
#include "src/report/version.h"

namespace gapscope {

struct RunInfo {
  std::uint64_t seed = 0;
  std::string gapscope = GapscopeVersion(), mujoco = MujocoVersion();
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_RUN_H_
