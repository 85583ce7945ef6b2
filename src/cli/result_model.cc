#include "src/cli/result_model.h"

#include <nlohmann/json.hpp>

#include "src/report/read_run.h"

namespace gapscope::cli {

Result<ResultModel> LoadResultModel(std::shared_ptr<const Rig> rig, const std::string& path, const ScaleTable& scales) {
  GS_ASSIGN(const auto json, ReadJson(path));
  GS_ASSIGN(const RunModel named, ReadRunModel(json, path));
  return BuildRunModel(std::move(rig), named, path, scales);
}

}  // namespace gapscope::cli
