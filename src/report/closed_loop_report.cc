#include "src/report/closed_loop_report.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/report/json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

const std::vector<double>* Logged(const Recording& recording, const ControllerSpec& spec) {
  for (const auto& command : recording.commands) {
    if (command.actuator == spec.actuator) return &command.values;
  }
  return nullptr;
}

ordered_json Json(const MotionStatistics& s) {
  return {{"mean", JsonNumber(s.mean)},
          {"deviation", JsonNumber(s.deviation)},
          {"low", JsonNumber(s.low)},
          {"high", JsonNumber(s.high)},
          {"crossings_hz", JsonNumber(s.crossings_hz)}};
}

}  // namespace

LoopStatistics LoopStatisticsOf(const ClosedLoopResult& closed, const std::vector<Recording>& recordings,
                                const ControllerSpec& spec) {
  LoopStatistics loop{.actuator = spec.actuator, .logs = {}};
  for (std::size_t l = 0; l < closed.result.logs.size(); ++l) {
    const LogReplay& replay = closed.result.logs[l];
    LoopStatistics::Log log{.signals = {}, .logged = {}, .sent = StatisticsOf(replay.time_s, closed.sent[l])};
    for (const auto& trace : replay.signals) {
      log.signals.push_back({.signal = trace.signal,
                             .measured = StatisticsOf(replay.time_s, trace.measured),
                             .predicted = StatisticsOf(replay.time_s, trace.predicted)});
    }
    if (const auto* logged = Logged(recordings[l], spec)) log.logged = StatisticsOf(replay.time_s, *logged);
    loop.logs.push_back(std::move(log));
  }
  return loop;
}

ordered_json ToJson(const LoopStatistics::Log& log, const std::string& actuator) {
  ordered_json statistics = ordered_json::object();
  for (const auto& signal : log.signals)
    statistics[signal.signal] = {{"measured", Json(signal.measured)}, {"predicted", Json(signal.predicted)}};
  ordered_json command = {{"predicted", Json(log.sent)}};
  if (log.logged) command["measured"] = Json(*log.logged);
  statistics["command " + actuator] = std::move(command);
  return statistics;
}

std::string ToTable(const LoopStatistics& loop, const std::vector<std::string>& log_paths) {
  std::string text = fmt::format("\n{:<37} {:<18} {:>10} {:>10} {:>19} {:>8}\n", "statistics", "", "mean", "deviation",
                                 "95 % between", "turns/s");
  std::vector<std::string> names = ShortPaths(log_paths);
  for (std::size_t l = 0; l < loop.logs.size(); ++l) {
    const LoopStatistics::Log& log = loop.logs[l];
    std::string& name = names[l];
    const auto line = [&](const std::string& what, const MotionStatistics& s) {
      text += fmt::format("{:<37} {:<18} {:>10.4g} {:>10.4g} {:>9.4g} {:>9.4g} {:>8.3g}\n", name, what, s.mean,
                          s.deviation, s.low, s.high, s.crossings_hz);
      name.clear();
    };
    for (const auto& signal : log.signals) {
      line(signal.signal, signal.measured);
      line("  in the loop", signal.predicted);
    }
    if (log.logged) line(loop.actuator + " command", *log.logged);
    line("  in the loop", log.sent);
  }
  return text;
}

std::vector<RunTable> SentTables(const std::vector<LogReplay>& logs, const std::vector<std::vector<double>>& sent,
                                 const std::vector<Recording>& recordings, const ControllerSpec& spec) {
  const std::vector<std::string> names = CsvNames(Collect(logs, &LogReplay::log_path));
  std::vector<RunTable> tables;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const auto* logged = Logged(recordings[l], spec);
    tables.push_back(
        {.path = "closed_loop/" + names[l],
         .columns = {{"__time", logs[l].time_s},
                     {"logged/" + spec.actuator, logged ? std::span<const double>(*logged) : std::span<const double>()},
                     {"closed_loop/" + spec.actuator, sent[l]}}});
  }
  return tables;
}

}  // namespace gapscope
