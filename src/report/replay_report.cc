#include "src/report/replay_report.h"

#include <fmt/core.h>

#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>

#include "src/core/file.h"
#include "src/report/json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

const char* ModeName(ReplayMode mode) {
  switch (mode) {
    case ReplayMode::kFreeRun:
      return "free_run";
    case ReplayMode::kWindows:
      return "windows";
    case ReplayMode::kClosedLoop:
      return "closed_loop";
  }
  return "";
}

const char* OutcomeName(Outcome outcome) { return outcome == Outcome::kCompleted ? "completed" : "diverged"; }

// Of an error over the motion's own spread: from where it is marked as good, and as bad.
constexpr double kClose = 0.05, kFarOff = 0.6;
constexpr std::size_t kSparks = 12;

// The end of a path that fits `width`.
std::string Shorten(const std::string& path, std::size_t width) {
  return path.size() <= width ? path : "..." + path.substr(path.size() - width + 3);
}

void AppendNumber(std::string& text, double value) {
  if (!std::isfinite(value)) return;  // an empty field
  char buffer[32];
  const auto end = std::to_chars(buffer, buffer + sizeof buffer, value).ptr;
  text.append(buffer, end);
}

}  // namespace

std::string ReplayTable(const ReplayReport& report, const Console& console) {
  const auto& [result, comparison, model, values, seed, other_error, nominal_error] = report;
  std::string text = console.Bold(fmt::format("{:<24} {:<18} {:>9} {:>9} {:>7} {:>8} {:>6} {}", "log", "signal", "RMSE",
                                              "MAE", "nRMSE", "lag ms", "corr", "over time")) +
                     "\n";
  for (std::size_t l = 0; l < comparison.logs.size(); ++l) {
    const LogComparison& log = comparison.logs[l];
    bool first = true;
    for (std::size_t k = 0; k < log.signals.size(); ++k) {
      const SignalScore& s = log.signals[k];
      const SignalTrace& trace = result.logs[l].signals[k];
      const std::string nrmse = fmt::format("{:>7.4g}", s.nrmse);
      text += fmt::format("{:<24} {:<18} {:>9.4g} {:>9.4g} {} {:>8.2f} {:>6.3f} {}\n",
                          first ? Shorten(log.log_path, 24) : "", s.signal, s.rmse, s.mae,
                          s.nrmse < kClose    ? console.Good(nrmse)
                          : s.nrmse > kFarOff ? console.Bad(nrmse)
                                              : nrmse,
                          1e3 * s.lag_s, s.correlation,
                          Sparkline(ErrorOverTime(result.logs[l].time_s, trace.measured, trace.predicted, kSparks)));
      first = false;
    }
    if (const LogReplay& replay = result.logs[l]; replay.outcome == Outcome::kDiverged) {
      text +=
          console.Bad(replay.windows > 1 ? fmt::format("{:<24} {} of {} windows diverged, the first at {:.3f} s", "",
                                                       replay.diverged_windows, replay.windows, replay.diverged_at_s)
                                         : fmt::format("{:<24} diverged at {:.3f} s", "", replay.diverged_at_s)) +
          "\n";
    }
  }
  text += fmt::format("\nerror {:.4g} (RMSE over standard deviation, {}, {} log{})\n", comparison.error,
                      ModeName(result.mode), comparison.logs.size(), comparison.logs.size() == 1 ? "" : "s");
  if (std::isfinite(nominal_error)) text += fmt::format("the nominal model: error {:.4g}\n", nominal_error);
  const char* other = result.mode == ReplayMode::kWindows ? "a free run" : "windows, each started from the log";
  text += std::isfinite(other_error) ? fmt::format("in {}: error {:.4g}\n", other, other_error)
                                     : fmt::format("in {}: diverges\n", other);
  text += std::isfinite(result.time_step_error)
              ? fmt::format("time step {:.4g} ms; halving it changes the error by {:.2g}\n", 1e3 * result.time_step_s,
                            result.time_step_error)
              : fmt::format("time step {:.4g} ms, as asked\n", 1e3 * result.time_step_s);
  const std::vector<ConditionShare> telling = comparison.logs.empty()
                                                  ? std::vector<ConditionShare>{}
                                                  : MostTelling(comparison.logs.front().where, {.limit = 5});
  if (!telling.empty()) {
    text += fmt::format("\nwhere the error lies in the first log {:<24} {:>9} {:>9}   90 % interval\n", "", "of error",
                        "of time");
    for (const auto& share : telling) {
      text += fmt::format("  {:<16} {:<42} {:>8.0f}% {:>8.0f}%   {:.0f}..{:.0f} %\n", share.signal, share.condition,
                          100 * share.share_of_error, 100 * share.share_of_time, 100 * share.low, 100 * share.high);
    }
  }
  return text;
}

std::string ReplayJson(const ReplayReport& report) {
  const auto& [result, comparison, model, values, seed, other_error, nominal_error] = report;
  ordered_json json = {
      {"schema", "gapscope.replay/1"},
      {"mode", ModeName(result.mode)},
      {"error", JsonNumber(comparison.error)},
      {result.mode == ReplayMode::kWindows ? "error_free_run" : "error_windows", JsonNumber(other_error)},
      {"time_step_s", result.time_step_s},
      {"time_step_error", JsonNumber(result.time_step_error)},
      {"logs", ordered_json::array()}};
  if (std::isfinite(nominal_error)) json["error_nominal"] = nominal_error;
  for (std::size_t l = 0; l < comparison.logs.size(); ++l) {
    const LogComparison& log = comparison.logs[l];
    const LogReplay& replay = result.logs[l];
    ordered_json entry = {{"log", log.log_path},
                          {"outcome", OutcomeName(replay.outcome)},
                          {"error", JsonNumber(log.error)},
                          {"samples", replay.time_s.size()},
                          {"windows", replay.windows}};
    if (replay.outcome == Outcome::kDiverged) entry["diverged_at_s"] = replay.diverged_at_s;
    entry["signals"] = ordered_json::object();
    for (const SignalScore& s : log.signals) {
      entry["signals"][s.signal] = JsonScore(s);
    }
    entry["where"] = JsonConditions(log.where);
    json["logs"].push_back(std::move(entry));
  }
  json["effects"] = ordered_json::array();
  for (const auto& use : model.effects()) json["effects"].push_back({{"name", use.effect}, {"on", use.on}});
  json["parameters"] = ordered_json::object();
  for (std::size_t i = 0; i < values.size(); ++i) {
    if (!model.parameters()[i].name.starts_with("scale@")) json["parameters"][model.parameters()[i].name] = values[i];
  }
  json["model"] = JsonModel(model, values);
  json["cost"] = {{"wall_s", result.wall_s}, {"simulated_s", result.simulated_s}, {"steps", result.steps}};
  json["seed"] = seed;
  json["versions"] = JsonVersions();
  return json.dump(2);
}

Status WriteTraces(const std::string& folder, const ReplayResult& result, const std::vector<Recording>& recordings) {
  std::set<std::string> used;
  for (std::size_t l = 0; l < result.logs.size(); ++l) {
    const LogReplay& log = result.logs[l];
    std::string name = std::filesystem::path(log.log_path).stem().string();
    if (!used.insert(name).second) name = std::to_string(l) + "_" + name;
    std::string text = "__time";
    for (const auto& command : recordings[l].commands) text += ",command/" + command.actuator;
    for (const auto& signal : log.signals) text += ",measured/" + signal.signal + ",predicted/" + signal.signal;
    text += '\n';
    for (std::size_t k = 0; k < log.time_s.size(); ++k) {
      AppendNumber(text, log.time_s[k]);
      for (const auto& command : recordings[l].commands) AppendNumber(text += ',', command.values[k]);
      for (const auto& signal : log.signals) {
        AppendNumber(text += ',', signal.measured[k]);
        AppendNumber(text += ',', signal.predicted[k]);
      }
      text += '\n';
    }
    GS_RETURN_IF_ERROR(WriteFile((std::filesystem::path(folder) / (name + ".csv")).string(), text));
  }
  return Ok();
}

}  // namespace gapscope
