#include "src/report/tune_report.h"

#include <fmt/core.h>

#include <set>

#include "src/report/json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

ordered_json Logs(const std::vector<LogReplay>& logs) {
  ordered_json list = ordered_json::array();
  for (const auto& log : logs) {
    ordered_json entry = {{"log", log.log_path},
                          {"outcome", log.outcome == Outcome::kCompleted ? "completed" : "diverged"},
                          {"signals", ordered_json::object()}};
    for (const auto& s : log.signals)
      entry["signals"][s.signal] = JsonScore(ScoreSignal(s.signal, log.time_s, s.measured, s.predicted, s.resolution));
    list.push_back(std::move(entry));
  }
  return list;
}

}  // namespace

std::string FlatText(const FlatDirection& flat, const Model& model) {
  // Two that grow alike, both on logarithmic scales: their ratio stays, and is what is known.
  if (flat.parts.size() == 2 && std::abs(std::abs(flat.parts[1].second) - 1) < 0.1) {
    const Parameter &a = model.parameters()[flat.parts[0].first], &b = model.parameters()[flat.parts[1].first];
    if (a.low > 0 && b.low > 0)
      return fmt::format("only {} {} {} is known from these logs, neither alone", a.name,
                         flat.parts[1].second > 0 ? "/" : "*", b.name);
  }
  std::string names;
  for (const auto& [index, weight] : flat.parts)
    names += fmt::format("{}{}{}",
                         names.empty() ? ""
                         : weight > 0  ? " + "
                                       : " - ",
                         std::abs(std::abs(weight) - 1) < 0.05 ? "" : fmt::format("{:.2f} ", std::abs(weight)),
                         model.parameters()[index].name);
  return flat.parts.size() == 1 ? names + " is not known from these logs"
                                : "only together: these logs leave the direction " + names +
                                      " (logarithms where the bounds are positive) open";
}

std::string TuneTable(const TuneSummary& summary, const Model& model, const Console& console) {
  std::string text = console.Bold(fmt::format("{:<44} {:>11} {:>11}   {:<24} {}", "parameter", "nominal", "value",
                                              "95 % interval", "unit")) +
                     "\n";
  for (const auto& t : summary.tuned) {
    const Parameter& p = model.parameters()[t.index];
    text += fmt::format("{:<44} {:>11.4g} {:>11.4g}   {:<24} {}{}\n", p.name, p.nominal, t.value,
                        t.identifiable ? fmt::format("{:.4g} .. {:.4g}", t.low, t.high) : "not known", p.unit,
                        t.at_bound ? console.Warn("  at its bound") : "");
  }
  std::set<std::string> said;  // two directions may lead with the same parameter
  for (const auto& flat : summary.flat) {
    if (const std::string line = FlatText(flat, model); said.insert(line).second) text += "flat: " + line + "\n";
  }
  for (const auto& [a, b, r] : summary.correlated)
    text += fmt::format("{} and {} go together (correlation {:.3f})\n", model.parameters()[a].name,
                        model.parameters()[b].name, r);
  text.append("\n")
      .append(console.Bold(
          fmt::format("{:<44} {:<18} {:>10} {:>10} {:>8}", "held-out log", "signal", "RMSE", "MAE", "nRMSE")))
      .append("\n");
  for (const auto& log : summary.held_out) {
    for (const auto& s : log.signals) {
      const SignalScore score = ScoreSignal(s.signal, log.time_s, s.measured, s.predicted, s.resolution);
      const std::string name =
          log.log_path.size() > 44 ? "..." + log.log_path.substr(log.log_path.size() - 41) : log.log_path;
      text += fmt::format("{:<44} {:<18} {:>10.4g} {:>10.4g} {:>8.4g}\n", &s == &log.signals.front() ? name : "",
                          s.signal, score.rmse, score.mae, score.nrmse);
    }
  }
  text += fmt::format("\nerror: nominal {:.4g}, train {:.4g}, held out {:.4g} ({})\n", summary.error_nominal,
                      summary.error_train, summary.error_held_out, summary.split);
  text += fmt::format(
      "{}: {}; {} evaluations, {} replays of all logs, {:.2f} s; time step {:.3g} ms; commands {:+.3f} ms late\n",
      summary.optimizer, TerminationText(summary.termination), summary.evaluations, summary.replays, summary.wall_s,
      1e3 * summary.time_step_s, 1e3 * summary.shift_s);
  if (summary.start_costs.size() > 1) {
    text += fmt::format("{} starts {}\n", summary.start_costs.size(),
                        summary.starts_agree ? "agree"
                                             : "end in different places: the best is shown; more starts (--starts) or "
                                               "a global search (--optimizer crs2) may find better");
  }
  return text;
}

std::string TuneJson(const TuneSummary& summary, const Model& model, std::uint64_t seed) {
  ordered_json json = {{"schema", "gapscope.tune/1"},
                       {"optimizer", summary.optimizer},
                       {"termination", TerminationText(summary.termination)},
                       {"starts_agree", summary.starts_agree},
                       {"starts", summary.start_costs.size()},
                       {"evaluations", summary.evaluations},
                       {"replays", summary.replays},
                       {"wall_s", summary.wall_s},
                       {"solve_s", summary.solve_s}};
  json["parameters"] = ordered_json::array();
  for (const auto& t : summary.tuned) {
    const Parameter& p = model.parameters()[t.index];
    json["parameters"].push_back({{"name", p.name},
                                  {"unit", p.unit},
                                  {"nominal", p.nominal},
                                  {"value", t.value},
                                  {"low", t.low},
                                  {"high", t.high},
                                  {"at_bound", t.at_bound},
                                  {"identifiable", t.identifiable}});
  }
  json["flat"] = ordered_json::array();
  for (const auto& flat : summary.flat) {
    ordered_json parts = ordered_json::object();
    for (const auto& [index, weight] : flat.parts) parts[model.parameters()[index].name] = weight;
    json["flat"].push_back({{"direction", parts}, {"text", FlatText(flat, model)}});
  }
  json["correlated"] = ordered_json::array();
  for (const auto& [a, b, r] : summary.correlated)
    json["correlated"].push_back(
        {{"parameters", {model.parameters()[a].name, model.parameters()[b].name}}, {"correlation", r}});
  json["error"] = {{"nominal", JsonNumber(summary.error_nominal)},
                   {"train", JsonNumber(summary.error_train)},
                   {"held_out", JsonNumber(summary.error_held_out)}};
  json["held_out_by"] = summary.split;
  json["train"] = Logs(summary.train);
  json["held_out"] = Logs(summary.held_out);
  json["effects"] = ordered_json::array();
  for (const auto& use : model.effects()) json["effects"].push_back({{"name", use.effect}, {"on", use.on}});
  json["model"] = JsonModel(model, summary.values);
  json["time_step_s"] = summary.time_step_s;
  json["command_shift_s"] = summary.shift_s;
  json["seed"] = seed;
  json["versions"] = JsonVersions();
  return json.dump(2);
}

}  // namespace gapscope
