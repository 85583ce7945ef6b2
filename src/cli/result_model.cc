#include "src/cli/result_model.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/core/names.h"
#include "src/report/diagnose_report.h"
#include "src/report/read_json.h"
#include "src/report/read_run.h"
#include "src/report/replay_report.h"
#include "src/report/tune_report.h"

namespace gapscope::cli {
namespace {

Status CheckSchema(const nlohmann::ordered_json& json, const std::string& where) {
  const std::vector<std::string> schemas = {kDiagnosisSchema, kTuneSchema, kReplaySchema};
  const std::string schema = json.is_object() && json.contains("schema") ? json["schema"].dump() : "none";
  const bool known =
      std::any_of(schemas.begin(), schemas.end(), [&](const std::string& one) { return schema == '"' + one + '"'; });
  if (known) return Ok();
  return Error{.what = "not a result that holds a model",
               .where = where,
               .actual = "schema " + schema,
               .allowed = "a result of diagnose, tune or replay: " + Join(schemas)};
}

}  // namespace

Result<Experiment> ExperimentOf(const ResultSource& source, const RunModel& held) {
  if (!source.experiment.empty()) return LoadExperiment(source.experiment);
  constexpr char kCure[] = "give it: --experiment FILE";
  if (held.experiment.empty())
    return Error{.what = "the result does not name its experiment", .where = source.path, .cure = kCure};
  std::error_code failed;
  if (!std::filesystem::exists(held.experiment, failed)) {
    return Error{.what = "the result's experiment is not there",
                 .where = source.path,
                 .actual = held.experiment,
                 .cure = "go to the folder where the result was made, or " + std::string(kCure)};
  }
  return LoadExperiment(held.experiment);
}

Result<ResultModel> LoadResultModel(std::shared_ptr<const Rig> rig, const std::string& path, const ScaleTable& scales) {
  GS_ASSIGN(const RunModel named, LoadRunModel(path));
  return BuildRunModel(std::move(rig), named, path, scales);
}

Result<ResultModel> LoadWholeResult(const nlohmann::ordered_json& json, const ResultSource& source) {
  GS_RETURN_IF_ERROR(CheckSchema(json, source.path));
  GS_ASSIGN(const RunModel held, ReadRunModel(json, source.path));
  GS_ASSIGN(Experiment experiment, ExperimentOf(source, held));
  if (!source.while_column.empty()) experiment.replay.while_column = source.while_column;
  GS_ASSIGN(std::shared_ptr<const Rig> rig, Rig::Load(experiment));
  // Scales bound effects; they do not make their values.
  return BuildRunModel(std::move(rig), held, source.path, {});
}

std::vector<std::string> JudgedBy(const nlohmann::ordered_json& json) {
  std::vector<std::string> paths;
  const auto add = [&](const nlohmann::ordered_json& logs) {
    if (!logs.is_array()) return;
    for (const auto& log : logs) {
      if (log.is_string()) paths.push_back(log.get<std::string>());
      if (const std::string path = TextIn(log, "log"); !path.empty()) paths.push_back(path);
    }
  };
  if (json.contains("logs") && json["logs"].is_object()) add(json["logs"].value("held_out", nlohmann::ordered_json()));
  if (json.contains("held_out")) add(json["held_out"]);
  if (paths.empty() && json.contains("logs")) add(json["logs"]);
  return paths;
}

}  // namespace gapscope::cli
