// The model of an earlier result: what `replay`, `tune` or `diagnose` wrote to --out, built again for another command.
#ifndef GAPSCOPE_CLI_RESULT_MODEL_H_
#define GAPSCOPE_CLI_RESULT_MODEL_H_

#include <memory>
#include <string>
#include <vector>

#include "src/model/run_model.h"

namespace gapscope::cli {

// `path`: the folder or its result.json. Errors: not such a file; as BuildRunModel.
Result<ResultModel> LoadResultModel(std::shared_ptr<const Rig> rig, const std::string& path, const ScaleTable& scales);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_RESULT_MODEL_H_
