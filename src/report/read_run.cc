#include "src/report/read_run.h"

#include <algorithm>
#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/report/read_json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

constexpr int kDeepest = 64;  // of the brackets in a file

double NumberAt(const ordered_json& json, const char* key) { return NumberFrom(json.at(key)); }

SignalScore ScoreFrom(const std::string& signal, const ordered_json& json) {
  return {.signal = signal,
          .rmse = NumberAt(json, "rmse"),
          .mae = NumberAt(json, "mae"),
          .nrmse = NumberAt(json, "nrmse"),
          .max = NumberAt(json, "max"),
          .lag_s = NumberAt(json, "lag_s"),
          .correlation = NumberAt(json, "correlation")};
}

std::vector<TuneRun::Log> LogsFrom(const ordered_json& json) {
  std::vector<TuneRun::Log> logs;
  for (const auto& entry : json) {
    TuneRun::Log log{
        .log = entry.at("log"),
        .outcome = entry.at("outcome") == OutcomeName(Outcome::kDiverged) ? Outcome::kDiverged : Outcome::kCompleted,
        .signals = {}};
    for (const auto& [signal, score] : entry.at("signals").items()) log.signals.push_back(ScoreFrom(signal, score));
    logs.push_back(std::move(log));
  }
  return logs;
}

std::vector<TuneRun::Parameter> ParametersFrom(const ordered_json& json) {
  return Collect(json, [](const ordered_json& p) -> TuneRun::Parameter {
    return {.name = p.at("name"),
            .unit = p.at("unit"),
            .nominal = NumberAt(p, "nominal"),
            .value = NumberAt(p, "value"),
            .low = NumberAt(p, "low"),
            .high = NumberAt(p, "high"),
            .at_bound = p.at("at_bound"),
            .identifiable = p.at("identifiable")};
  });
}

// Empty where an earlier version wrote none.
Spread SpreadFrom(const ordered_json& json) {
  if (!json.contains("spread")) return {};
  const auto& from = json["spread"];
  Spread spread{.logarithmic = from.at("logarithmic").get<std::vector<bool>>(), .covariance = {}};
  const auto& rows = from.at("covariance");
  const std::size_t count = spread.logarithmic.size();
  // Before room is made for a matrix that the file does not hold.
  if (rows.size() != count || std::ranges::any_of(rows, [&](const auto& row) { return row.size() != count; }))
    throw ordered_json::out_of_range::create(401, "a covariance of another size than 'logarithmic'", &from);
  const auto n = static_cast<Eigen::Index>(count);
  spread.covariance = Eigen::MatrixXd::NullaryExpr(n, n, [&](Eigen::Index a, Eigen::Index b) {
    return NumberFrom(rows.at(static_cast<std::size_t>(a)).at(static_cast<std::size_t>(b)));
  });
  return spread;
}

void ReadKnowledge(const ordered_json& json, TuneRun* run) {
  run->parameters = ParametersFrom(json.at("parameters"));
  for (const auto& fit : json.value("per_log", ordered_json::array()))
    run->per_log.push_back(
        {fit.at("log"), fit.at("termination"), ParametersFrom(fit.at("parameters")), SpreadFrom(fit)});
  run->left_frozen = json.value("left_frozen", std::vector<std::string>{});
  for (const auto& entry : json.at("flat")) {
    TuneRun::Flat flat{.direction = {}, .text = entry.at("text")};
    for (const auto& [name, weight] : entry.at("direction").items())
      flat.direction.emplace_back(name, NumberFrom(weight));
    run->flat.push_back(std::move(flat));
  }
  for (const auto& entry : json.at("correlated")) {
    const auto& names = entry.at("parameters");
    run->correlated.push_back({names.at(0), names.at(1), NumberAt(entry, "correlation")});
  }
  run->spread = SpreadFrom(json);
}

TuneRun TuneRunFrom(const ordered_json& json) {
  const auto& error = json.at("error");
  const auto& versions = json.at("versions");
  TuneRun run{
      .info = {.seed = WholeFrom<std::uint64_t>(json.at("seed")),
               .gapscope = versions.at("gapscope"),
               .mujoco = versions.at("mujoco")},
      .optimizer = json.at("optimizer"),
      .termination = json.at("termination"),
      .starts_agree = json.at("starts_agree"),
      .starts = WholeFrom<std::size_t>(json.at("starts")),
      .cost = json.contains("cost") ? NumberAt(json, "cost") : kNaN,
      .evaluations = WholeFrom<std::size_t>(json.at("evaluations")),
      .replays = WholeFrom<std::size_t>(json.at("replays")),
      .wall_s = json.value("wall_s", kNaN),
      .solve_s = json.value("solve_s", kNaN),
      .error_nominal = NumberAt(error, "nominal"),
      .error_train = NumberAt(error, "train"),
      .error_held_out = NumberAt(error, "held_out"),
      .held_out_by = json.at("held_out_by"),
      .train = LogsFrom(json.at("train")),
      .held_out = LogsFrom(json.at("held_out")),
      .model = ResultModelFrom(json),
      .time_step_s = NumberAt(json, "time_step_s"),
      .command_shift_s = NumberAt(json, "command_shift_s"),
      .force_shift_s = json.value("force_shift_s", 0.0),
  };
  ReadKnowledge(json, &run);
  return run;
}

}  // namespace

RunModel RunModelFrom(const ordered_json& json) {
  RunModel model;
  for (const auto& effect : json.at("effects")) model.effects.push_back({effect.at("name"), effect.at("on")});
  for (const auto& [name, value] : json.at("values").items()) model.values.emplace_back(name, NumberFrom(value));
  return model;
}

RunModel ResultModelFrom(const ordered_json& result) {
  RunModel model = RunModelFrom(result.at("model"));
  model.experiment = result.value("experiment", "");
  return model;
}

Result<ordered_json> ReadJson(const std::string& path) {
  std::error_code failure;
  const std::string file =
      std::filesystem::is_directory(path, failure) ? (std::filesystem::path(path) / "result.json").string() : path;
  GS_ASSIGN(const std::string text, ReadFile(file));
  // Copying recurses on what is nested, and an object that grows copies: what is too deep is not even built.
  bool too_deep = false;
  const auto watch = [&](int depth, ordered_json::parse_event_t, const ordered_json&) {
    too_deep = too_deep || depth > kDeepest;
    return depth <= kDeepest;
  };
  ordered_json json = ordered_json::parse(text, watch, false);
  if (json.is_discarded()) return Error{.what = "not JSON", .where = file};
  if (too_deep) return Error{.what = "nested too deep", .where = file, .allowed = std::to_string(kDeepest) + " levels"};
  return json;
}

Result<RunModel> ReadRunModel(const ordered_json& json, const std::string& where) {
  constexpr char kAllowed[] = "a result of gapscope replay, tune or diagnose";
  if (!json.is_object() || !json.contains("model"))
    return Error{.what = "not a result of a model: it has no 'model'", .where = where, .allowed = kAllowed};
  return ReadGuarded([&] { return ResultModelFrom(json); }, where, kAllowed);
}

Result<RunModel> LoadRunModel(const std::string& path) {
  GS_ASSIGN(const auto json, ReadJson(path));
  return ReadRunModel(json, path);
}

Result<TuneRun> ReadTuneRun(const ordered_json& json, const std::string& where) {
  const auto read = [&] { return TuneRunFrom(json); };
  return ReadGuarded(read, where, kTuneSchema);
}

}  // namespace gapscope
