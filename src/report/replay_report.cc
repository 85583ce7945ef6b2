#include "src/report/replay_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/report/signal_table.h"
#include "src/report/words.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kSparks = 12;

// The end of a path that fits `width`.
std::string Shorten(const std::string& path, std::size_t width) {
  return path.size() <= width ? path : "..." + path.substr(path.size() - width + 3);
}

// A log's lines: one a signal, of many the worst, and where it diverged.
std::string LogLines(const LogComparison& log, const LogReplay& replay, std::size_t name_width,
                     const Console& console) {
  std::string text;
  for (const std::size_t k : SignalsInTable(log.signals)) {
    const SignalScore& s = log.signals[k];
    const SignalTrace& trace = replay.signals[k];
    const std::string nrmse = fmt::format("{:>7.4g}", s.nrmse);
    text += fmt::format("{:<24} {:<{}} {:>9.4g} {:>9.4g} {} {:>8.2f} {:>6.3f} {}\n",
                        text.empty() ? Shorten(log.log_path, 24) : "", s.signal, name_width, s.rmse, s.mae,
                        s.nrmse < kFollowsClosely ? console.Good(nrmse)
                        : s.nrmse > kClearlyOff   ? console.Bad(nrmse)
                                                  : nrmse,
                        1e3 * s.lag_s, s.correlation,
                        Sparkline(ErrorOverTime(replay.time_s, trace.measured, trace.predicted, kSparks)));
  }
  if (const std::string rest = SignalsNotInTable(log.signals); !rest.empty())
    text += fmt::format("{:<24} {}\n", "", rest);
  if (replay.outcome == Outcome::kDiverged) {
    text += console.Bad(replay.windows > 1 ? fmt::format("{:<24} {} of {} windows diverged, the first at {:.3f} s", "",
                                                         replay.diverged_windows, replay.windows, replay.diverged_at_s)
                                           : fmt::format("{:<24} diverged at {:.3f} s", "", replay.diverged_at_s)) +
            "\n";
  }
  return text;
}

std::string ConditionLines(const std::vector<ConditionShare>& telling) {
  if (telling.empty()) return "";
  std::size_t width = 16;
  for (const auto& share : telling) width = std::max(width, share.signal.size());
  std::string text = fmt::format("\nwhere the error lies in the first log {:<{}} {:>9} {:>9}   90 % interval\n", "",
                                 width + 8, "of error", "of time");
  for (const auto& share : telling) {
    text +=
        fmt::format("  {:<{}} {:<42} {:>8.0f}% {:>8.0f}%   {:.0f}..{:.0f} %\n", share.signal, width, share.condition,
                    100 * share.share_of_error, 100 * share.share_of_time, 100 * share.low, 100 * share.high);
  }
  return text;
}

ordered_json LogJson(const LogComparison& log, const LogReplay& replay) {
  ordered_json entry = {{"log", log.log_path},
                        {"outcome", OutcomeName(replay.outcome)},
                        {"error", JsonNumber(log.error)},
                        {"samples", replay.time_s.size()},
                        {"windows", replay.windows}};
  if (replay.outcome == Outcome::kDiverged) entry["diverged_at_s"] = replay.diverged_at_s;
  entry["signals"] = ordered_json::object();
  for (const SignalScore& s : log.signals) entry["signals"][s.signal] = JsonScore(s);
  entry["where"] = JsonConditions(log.where);
  return entry;
}

}  // namespace

ReplayRun ReplayRunOf(const Model& model, std::span<const double> values, ReplayResult result, Comparison comparison) {
  ReplayRun run{.result = std::move(result), .comparison = std::move(comparison), .model = RunModelOf(model, values)};
  for (std::size_t i = 0; i < values.size(); ++i) {
    const Parameter& p = model.parameters()[i];
    if (p.owner != Parameter::Owner::kScale) run.parameters.emplace_back(p.name, values[i]);
  }
  return run;
}

ordered_json ToJson(const ReplayRun& run, Timing timing) {
  const ReplayResult& result = run.result;
  ordered_json json = {
      {"schema", kReplaySchema},
      {"mode", NameOf(result.mode)},
      {"error", JsonNumber(run.comparison.error)},
      {result.mode == ReplayMode::kWindows ? "error_free_run" : "error_windows", JsonNumber(run.other_error)},
      {"time_step_s", result.time_step_s},
      {"time_step_error", JsonNumber(result.time_step_error)},
      {"logs", ordered_json::array()}};
  if (std::isfinite(run.nominal_error)) json["error_nominal"] = run.nominal_error;
  for (std::size_t l = 0; l < run.comparison.logs.size(); ++l) {
    ordered_json entry = LogJson(run.comparison.logs[l], result.logs[l]);
    if (run.loop) entry["statistics"] = ToJson(run.loop->logs[l], run.loop->actuator);
    json["logs"].push_back(std::move(entry));
  }
  json["experiment"] = run.model.experiment;
  json["effects"] = JsonEffects(run.model.effects);
  json["parameters"] = ordered_json::object();
  for (const auto& [name, value] : run.parameters) json["parameters"][name] = value;
  json["model"] = JsonModel(run.model);
  json["cost"] = ordered_json::object();
  if (timing == Timing::kInclude) json["cost"]["wall_s"] = result.wall_s;
  json["cost"]["simulated_s"] = result.simulated_s;
  json["cost"]["steps"] = result.steps;
  json["seed"] = run.info.seed;
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::string ToTable(const ReplayRun& run, const Console& console) {
  const ReplayResult& result = run.result;
  const Comparison& comparison = run.comparison;
  std::size_t name_width = 18;
  for (const auto& log : comparison.logs) name_width = std::max(name_width, WidestSignal(log.signals));
  std::string text = console.Bold(fmt::format("{:<24} {:<{}} {:>9} {:>9} {:>7} {:>8} {:>6} {}", "log", "signal",
                                              name_width, "RMSE", "MAE", "nRMSE", "lag ms", "corr", "over time")) +
                     "\n";
  std::vector<std::string> paths;
  for (std::size_t l = 0; l < comparison.logs.size(); ++l) {
    text += LogLines(comparison.logs[l], result.logs[l], name_width, console);
    paths.push_back(comparison.logs[l].log_path);
  }
  text += fmt::format("\nerror {:.4g} (RMSE over standard deviation, {}, {} log{})\n", comparison.error,
                      NameOf(result.mode), comparison.logs.size(), comparison.logs.size() == 1 ? "" : "s");
  if (std::isfinite(run.nominal_error)) text += fmt::format("the nominal model: error {:.4g}\n", run.nominal_error);
  const char* other = result.mode == ReplayMode::kWindows ? "a free run" : "windows, each started from the log";
  text += std::isfinite(run.other_error) ? fmt::format("in {}: error {:.4g}\n", other, run.other_error)
                                         : fmt::format("in {}: diverges\n", other);
  text += std::isfinite(result.time_step_error)
              ? fmt::format("time step {:.4g} ms; halving it changes the error by {:.2g}\n", 1e3 * result.time_step_s,
                            result.time_step_error)
              : fmt::format("time step {:.4g} ms, as asked\n", 1e3 * result.time_step_s);
  if (!comparison.logs.empty()) text += ConditionLines(TellOfWorst(comparison.logs.front(), {.limit = 5}));
  if (run.loop) text += ToTable(*run.loop, paths);
  return text;
}

}  // namespace gapscope
