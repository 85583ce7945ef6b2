#include "src/report/closed_loop_report.h"

#include <fmt/format.h>

#include <filesystem>
#include <set>

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

std::string StatisticsTable(const ClosedLoopResult& closed, const std::vector<Recording>& recordings,
                            const ControllerSpec& spec) {
  std::string text = fmt::format("\n{:<37} {:<18} {:>10} {:>10} {:>19} {:>8}\n", "statistics", "", "mean", "deviation",
                                 "95 % between", "turns/s");
  for (std::size_t l = 0; l < closed.result.logs.size(); ++l) {
    const LogReplay& log = closed.result.logs[l];
    std::string name = std::filesystem::path(log.log_path).filename().string();
    const auto line = [&](const std::string& what, const std::vector<double>& values) {
      const MotionStatistics s = StatisticsOf(log.time_s, values);
      text += fmt::format("{:<37} {:<18} {:>10.4g} {:>10.4g} {:>9.4g} {:>9.4g} {:>8.3g}\n", name, what, s.mean,
                          s.deviation, s.low, s.high, s.crossings_hz);
      name.clear();
    };
    for (const auto& signal : log.signals) {
      line(signal.signal, signal.measured);
      line("  in the loop", signal.predicted);
    }
    if (const auto* logged = Logged(recordings[l], spec)) line(spec.actuator + " command", *logged);
    line("  in the loop", closed.sent[l]);
  }
  return text;
}

std::string WithStatistics(const std::string& replay_json, const ClosedLoopResult& closed,
                           const std::vector<Recording>& recordings, const ControllerSpec& spec) {
  ordered_json json = ordered_json::parse(replay_json);
  for (std::size_t l = 0; l < closed.result.logs.size(); ++l) {
    const LogReplay& log = closed.result.logs[l];
    ordered_json statistics = ordered_json::object();
    for (const auto& signal : log.signals)
      statistics[signal.signal] = {{"measured", Json(StatisticsOf(log.time_s, signal.measured))},
                                   {"predicted", Json(StatisticsOf(log.time_s, signal.predicted))}};
    ordered_json command = {{"predicted", Json(StatisticsOf(log.time_s, closed.sent[l]))}};
    if (const auto* logged = Logged(recordings[l], spec)) command["measured"] = Json(StatisticsOf(log.time_s, *logged));
    statistics["command " + spec.actuator] = command;
    json["logs"][l]["statistics"] = statistics;
  }
  return json.dump(2);
}

Status WriteSent(const std::string& folder, const ClosedLoopResult& closed, const std::vector<Recording>& recordings,
                 const ControllerSpec& spec) {
  std::set<std::string> used;
  for (std::size_t l = 0; l < closed.result.logs.size(); ++l) {
    const LogReplay& log = closed.result.logs[l];
    std::string name = std::filesystem::path(log.log_path).stem().string();
    if (!used.insert(name).second) name = std::to_string(l) + "_" + name;
    const auto* logged = Logged(recordings[l], spec);
    std::string text = "__time,logged/" + spec.actuator + ",closed_loop/" + spec.actuator + "\n";
    for (std::size_t k = 0; k < log.time_s.size(); ++k) {
      fmt::format_to(std::back_inserter(text), "{},{},{}\n", log.time_s[k],
                     logged && std::isfinite((*logged)[k]) ? fmt::format("{}", (*logged)[k]) : "",
                     std::isfinite(closed.sent[l][k]) ? fmt::format("{}", closed.sent[l][k]) : "");
    }
    GS_RETURN_IF_ERROR(WriteFile((std::filesystem::path(folder) / (name + ".csv")).string(), text));
  }
  return Ok();
}

}  // namespace gapscope
