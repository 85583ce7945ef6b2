#include "src/cli/result_model.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/core/file.h"

namespace gapscope::cli {

Result<ResultModel> LoadResultModel(const Experiment& experiment, const std::string& path, const ScaleTable& scales) {
  std::error_code failure;
  const std::string file =
      std::filesystem::is_directory(path, failure) ? (std::filesystem::path(path) / "result.json").string() : path;
  GS_ASSIGN(const std::string text, ReadFile(file));
  const auto json = nlohmann::json::parse(text, nullptr, false);
  const auto refused = [&](const std::string& what) {
    return Error{.what = what, .where = file, .allowed = "a result of gapscope replay, tune or diagnose"};
  };
  if (json.is_discarded()) return refused("not JSON");
  if (!json.is_object() || !json.contains("model") || !json["model"].is_object()) return refused("no 'model' in it");
  const auto& held = json["model"];
  if (!held.contains("effects") || !held["effects"].is_array() || !held.contains("values") ||
      !held["values"].is_object())
    return refused("its 'model' has no 'effects' or no 'values'");
  std::vector<std::string> texts;
  for (const auto& effect : held["effects"]) {
    if (!effect.is_object() || !effect.contains("name") || !effect["name"].is_string() || !effect.contains("on") ||
        !effect["on"].is_string())
      return refused("an effect without 'name' and 'on'");
    texts.push_back(effect["name"].get<std::string>() + "@" + effect["on"].get<std::string>());
  }
  ResultModel result;
  GS_ASSIGN(result.model, Model::Build(experiment));
  GS_ASSIGN(const auto uses, result.model->ParseEffects(texts));
  GS_ASSIGN(result.model, Model::Build(experiment, uses, scales));
  result.values = result.model->Nominal();
  for (const auto& [name, value] : held["values"].items()) {
    if (!value.is_number()) return refused("the value of '" + name + "' is no number");
    GS_ASSIGN(const int index, result.model->Find(name, file));
    result.values[index] = value.get<double>();
  }
  return result;
}

}  // namespace gapscope::cli
