// The model of an earlier result: what `replay`, `tune` or `diagnose` wrote to --out, built again for another command.
#ifndef GAPSCOPE_CLI_RESULT_MODEL_H_
#define GAPSCOPE_CLI_RESULT_MODEL_H_

#include <memory>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/model/run_model.h"

namespace gapscope::cli {

// `path`: the folder or its result.json. Errors: not such a file; as BuildRunModel.
Result<ResultModel> LoadResultModel(std::shared_ptr<const Rig> rig, const std::string& path, const ScaleTable& scales);

// A result that stands alone: its model on the experiment that it names, or that is given.
struct ResultSource {
  std::string path;          // the folder or its result.json
  std::string experiment;    // empty: the one that the result names
  std::string while_column;  // over the experiment's own
};
// What is given, else what the result `held` names itself. Errors: it is not there, or none is named.
Result<Experiment> ExperimentOf(const ResultSource& source, const RunModel& held);
// `json`: what source.path holds. Errors: not a result of diagnose, tune or replay; its experiment is not there; as
// Rig::Load and BuildRunModel.
Result<ResultModel> LoadWholeResult(const nlohmann::ordered_json& json, const ResultSource& source);

// The logs that a result was judged by; of a replay all of its logs.
std::vector<std::string> JudgedBy(const nlohmann::ordered_json& json);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_RESULT_MODEL_H_
