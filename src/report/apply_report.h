// What `apply` changes in an MJCF, for people and programs: console lines, JSON (gapscope.apply/1), and the comments
// that say in the MJCF why.
#ifndef GAPSCOPE_REPORT_APPLY_REPORT_H_
#define GAPSCOPE_REPORT_APPLY_REPORT_H_

#include <map>
#include <nlohmann/json_fwd.hpp>
#include <span>
#include <string>
#include <vector>

#include "src/model/apply.h"
#include "src/report/run.h"

namespace gapscope {

struct ApplyRun {
  RunInfo info;
  std::string model, result, out;  // paths: the MJCF as it was, the result, the changed MJCF
  std::string setter;              // the experiment file, where it sets fields itself; else empty
  std::vector<AppliedChange> changes;
  bool needs_plugins = false;
  double time_step_s = 0, model_time_step_s = 0;  // of the result's errors, NaN: not said; the MJCF's own
  std::vector<EffectUse> of_signals;              // effects of the log's columns, which no mechanism holds
  std::vector<std::string> left_out;              // fields that each log sets anew
};

nlohmann::ordered_json ToJson(const ApplyRun& run);
std::string ToTable(const ApplyRun& run);

// By parameter, what a comment says of it. An effect's parameters are said together: "coulomb_friction@arm: 0.0006 N m
// (0.0003 .. 0.0011), P 0.80"; one of the experiment's with its nominal value, if it left that. `result`: of replay,
// tune or diagnose, whose intervals and probabilities are taken where it has them.
std::map<std::string, std::string> NotesOf(const nlohmann::ordered_json& result, const Model& model,
                                           std::span<const double> values);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_APPLY_REPORT_H_
