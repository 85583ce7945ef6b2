#include "src/report/tune_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <numeric>

#include "src/core/collect.h"
#include "src/report/signal_table.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

constexpr std::size_t kMostParameters = 24, kMostNotes = 12;

std::vector<TuneRun::Log> Scored(const std::vector<LogReplay>& replays) {
  std::vector<TuneRun::Log> logs;
  for (const auto& replay : replays) {
    TuneRun::Log log{.log = replay.log_path, .outcome = replay.outcome, .signals = {}};
    for (const auto& s : replay.signals)
      log.signals.push_back(ScoreSignal(s.signal, replay.time_s, s.measured, s.predicted, s.resolution));
    logs.push_back(std::move(log));
  }
  return logs;
}

ordered_json Json(const std::vector<TuneRun::Log>& logs) {
  ordered_json list = ordered_json::array();
  for (const auto& log : logs) {
    ordered_json entry = {{"log", log.log}, {"outcome", OutcomeName(log.outcome)}, {"signals", ordered_json::object()}};
    for (const auto& score : log.signals) entry["signals"][score.signal] = JsonScore(score);
    list.push_back(std::move(entry));
  }
  return list;
}

TuneRun::Parameter ParameterOf(const TunedParameter& t, const Model& model) {
  const gapscope::Parameter& p = model.parameters()[t.index];
  return {p.name, p.unit, p.nominal, t.value, t.low, t.high, t.at_bound, t.identifiable};
}

ordered_json Json(const Spread& spread) {
  ordered_json covariance = ordered_json::array();
  for (const auto& row : spread.covariance.rowwise()) covariance.push_back(std::vector<double>(row.begin(), row.end()));
  return {{"logarithmic", spread.logarithmic}, {"covariance", std::move(covariance)}};
}

ordered_json Json(const std::vector<TuneRun::Parameter>& parameters) {
  ordered_json list = ordered_json::array();
  for (const auto& p : parameters) {
    list.push_back({{"name", p.name},
                    {"unit", p.unit},
                    {"nominal", p.nominal},
                    {"value", p.value},
                    {"low", p.low},
                    {"high", p.high},
                    {"at_bound", p.at_bound},
                    {"identifiable", p.identifiable}});
  }
  return list;
}

// From the least to the most of what each log alone says of a parameter; of logs that do not know it nothing.
std::string PerLogLines(const TuneRun& run) {
  if (run.per_log.empty()) return "";
  std::string text = fmt::format("\n{:<44} {:>11}    {:<11}\n", "each log alone", "least", "most");
  for (std::size_t i = 0; i < run.per_log.front().parameters.size(); ++i) {
    std::vector<double> values;
    for (const auto& fit : run.per_log) {
      if (fit.parameters[i].identifiable) values.push_back(fit.parameters[i].value);
    }
    const auto& p = run.per_log.front().parameters[i];
    const std::string count = fmt::format("  {} of {} logs", values.size(), run.per_log.size());
    if (values.empty()) {
      text += fmt::format("{:<44} not known of a log alone\n", p.name);
      continue;
    }
    const auto [least, most] = std::ranges::minmax(values);
    text += fmt::format("{:<44} {:>11.4g} .. {:<11.4g} {}{}\n", p.name, least, most, p.unit,
                        values.size() < run.per_log.size() ? count : "");
  }
  return text;
}

// Two directions may lead with the same parameter and say the same: once is enough.
std::vector<std::string> FlatTexts(const TuneRun& run) {
  std::vector<std::string> texts;
  for (const auto& flat : run.flat) {
    if (std::ranges::find(texts, flat.text) == texts.end()) texts.push_back(flat.text);
  }
  return texts;
}

// By what stands before the last dot of a name: "link: d2, t1".
std::string LeftFrozenText(const TuneRun& run) {
  std::map<std::string, std::string> bodies;
  for (const std::string& name : run.left_frozen) {
    const std::size_t dot = name.rfind('.');
    std::string& keys = bodies[name.substr(0, dot)];
    keys += (keys.empty() ? "" : ", ") + name.substr(dot + 1);
  }
  std::string text;
  for (const auto& [body, keys] : bodies) text += fmt::format("{}{}: {}", text.empty() ? "" : "; ", body, keys);
  return "frozen, for these logs do not know them: " + text;
}

std::string CorrelatedText(const TuneRun::Correlated& pair) {
  return fmt::format("{} and {} go together (correlation {:.3f})", pair.a, pair.b, pair.correlation);
}

// By number: all of a few; of many those that moved furthest, in halves of their intervals, in the order given.
std::vector<std::size_t> ParametersInTable(const TuneRun& run) {
  std::vector<std::size_t> order(run.parameters.size());
  std::iota(order.begin(), order.end(), std::size_t{0});
  if (order.size() <= kMostParameters) return order;
  const auto moved = [&](std::size_t i) {
    const auto& p = run.parameters[i];
    return p.identifiable && p.high > p.low ? std::abs(p.value - p.nominal) / (p.high - p.low) : 0;
  };
  std::ranges::stable_sort(order, [&](std::size_t a, std::size_t b) { return moved(a) > moved(b); });
  order.resize(kMostParameters);
  std::ranges::sort(order);
  return order;
}

std::string ParameterLines(const TuneRun& run, const Console& console) {
  std::string text = console.Bold(fmt::format("{:<44} {:>11} {:>11}   {:<24} {}", "parameter", "nominal", "value",
                                              "95 % interval", "unit")) +
                     "\n";
  for (const std::size_t i : ParametersInTable(run)) {
    const auto& p = run.parameters[i];
    text += fmt::format("{:<44} {:>11.4g} {:>11.4g}   {:<24} {}{}\n", p.name, p.nominal, p.value,
                        p.identifiable ? fmt::format("{:.4g} .. {:.4g}", p.low, p.high) : "not known", p.unit,
                        p.at_bound ? console.Warn("  at its bound") : "");
  }
  if (!run.left_frozen.empty()) text += LeftFrozenText(run) + "\n";
  if (run.parameters.size() > kMostParameters)
    text += fmt::format("{} more parameters, nearer to their nominal values (--json: all)\n",
                        run.parameters.size() - kMostParameters);
  std::vector<std::string> notes;
  for (const auto& flat : FlatTexts(run)) notes.push_back("flat: " + flat);
  for (const auto& pair : run.correlated) notes.push_back(CorrelatedText(pair));
  for (std::size_t i = 0; i < std::min(notes.size(), kMostNotes); ++i) text += Wrapped(notes[i], 120, "  ") + "\n";
  if (notes.size() > kMostNotes)
    text += fmt::format("{} more directions and pairs (--json: all)\n", notes.size() - kMostNotes);
  return text;
}

std::string HeldOutLines(const TuneRun& run, const Console& console) {
  std::size_t name_width = 18;
  for (const auto& log : run.held_out) name_width = std::max(name_width, WidestSignal(log.signals));
  std::string text = console.Bold(fmt::format("{:<44} {:<{}} {:>10} {:>10} {:>8}", "held-out log", "signal", name_width,
                                              "RMSE", "MAE", "nRMSE")) +
                     "\n";
  for (const auto& log : run.held_out) {
    const std::string name = log.log.size() > 44 ? "..." + log.log.substr(log.log.size() - 41) : log.log;
    bool first = true;
    for (const std::size_t k : SignalsInTable(log.signals)) {
      const SignalScore& score = log.signals[k];
      text += fmt::format("{:<44} {:<{}} {:>10.4g} {:>10.4g} {:>8.4g}\n", first ? name : "", score.signal, name_width,
                          score.rmse, score.mae, score.nrmse);
      first = false;
    }
    if (const std::string rest = SignalsNotInTable(log.signals); !rest.empty())
      text += fmt::format("{:<44} {}\n", "", rest);
  }
  return text;
}

}  // namespace

std::string FlatText(const FlatDirection& flat, const Model& model) {
  // Two that grow alike, both on logarithmic scales: their ratio stays, and is what is known.
  if (flat.parts.size() == 2 && std::abs(std::abs(flat.parts[1].second) - 1) < 0.1) {
    // In the model's order: which of two equals is the larger is a matter of rounding.
    const auto [first, second] = std::minmax(flat.parts[0].first, flat.parts[1].first);
    const Parameter &a = model.parameters()[first], &b = model.parameters()[second];
    if (a.low > 0 && b.low > 0)
      return fmt::format("only {} {} {} is known from these logs, neither alone", a.name,
                         flat.parts[1].second > 0 ? "/" : "*", b.name);
  }
  std::string names;
  for (const auto& [index, weight] : flat.parts) {
    const Parameter& p = model.parameters()[index];
    names += fmt::format("{}{}{}{}",
                         names.empty() ? ""
                         : weight > 0  ? " + "
                                       : " - ",
                         std::abs(std::abs(weight) - 1) < 0.05 ? "" : fmt::format("{:.2f} ", std::abs(weight)),
                         flat.parts.size() > 1 && p.low > 0 ? "ln " : "", p.name);
  }
  return flat.parts.size() == 1 ? names + " is not known from these logs"
                                : "these logs leave the direction " + names + " open";
}

std::vector<std::string> ParameterNotes(const TuneRun& run) {
  std::vector<std::string> notes = FlatTexts(run);
  if (!run.left_frozen.empty()) notes.insert(notes.begin(), LeftFrozenText(run));
  for (const auto& pair : run.correlated) notes.push_back(CorrelatedText(pair));
  return notes;
}

TuneRun TuneRunOf(const TuneSummary& summary, const Model& model, std::uint64_t seed) {
  TuneRun run{.info = {.seed = seed},
              .optimizer = summary.optimizer,
              .termination = TerminationText(summary.termination),
              .starts_agree = summary.starts_agree,
              .starts = summary.start_costs.size(),
              .cost = *std::min_element(summary.start_costs.begin(), summary.start_costs.end()),
              .evaluations = summary.evaluations,
              .replays = summary.replays,
              .wall_s = summary.wall_s,
              .solve_s = summary.solve_s,
              .error_nominal = summary.error_nominal,
              .error_train = summary.error_train,
              .error_held_out = summary.error_held_out,
              .held_out_by = summary.split,
              .train = Scored(summary.train),
              .held_out = Scored(summary.held_out),
              .model = RunModelOf(model, summary.values),
              .time_step_s = summary.time_step_s,
              .command_shift_s = summary.stamps.commands_s,
              .force_shift_s = summary.stamps.forces_s};
  const auto name = [&](int index) { return model.parameters()[index].name; };
  for (const auto& t : summary.tuned) run.parameters.push_back(ParameterOf(t, model));
  for (const int index : summary.left_frozen) run.left_frozen.push_back(name(index));
  for (const auto& flat : summary.flat) {
    TuneRun::Flat entry{.direction = {}, .text = FlatText(flat, model)};
    for (const auto& [index, weight] : flat.parts) entry.direction.emplace_back(name(index), weight);
    run.flat.push_back(std::move(entry));
  }
  for (const auto& [a, b, r] : summary.correlated) run.correlated.push_back({name(a), name(b), r});
  run.spread = summary.spread;
  return run;
}

std::vector<TuneRun::LogFit> PerLogOf(const LogFits& fits, const Model& model) {
  return Collect(fits.logs, [&](const LogFit& fit) -> TuneRun::LogFit {
    return {.log = fit.log,
            .termination = TerminationText(fit.termination),
            .parameters = Collect(fit.tuned, [&](const TunedParameter& t) { return ParameterOf(t, model); }),
            .spread = fit.spread};
  });
}

ordered_json JsonParameters(const TuneRun& run) { return Json(run.parameters); }

ordered_json JsonErrors(const TuneRun& run) {
  return {{"nominal", JsonNumber(run.error_nominal)},
          {"train", JsonNumber(run.error_train)},
          {"held_out", JsonNumber(run.error_held_out)}};
}

ordered_json ToJson(const TuneRun& run, Timing timing) {
  ordered_json json = {{"schema", kTuneSchema},          {"optimizer", run.optimizer},
                       {"termination", run.termination}, {"starts_agree", run.starts_agree},
                       {"starts", run.starts},           {"cost", run.cost},
                       {"evaluations", run.evaluations}, {"replays", run.replays}};
  if (timing == Timing::kInclude) {
    json["wall_s"] = run.wall_s;
    json["solve_s"] = run.solve_s;
  }
  json["parameters"] = JsonParameters(run);
  json["left_frozen"] = run.left_frozen;
  json["flat"] = ordered_json::array();
  for (const auto& flat : run.flat) {
    ordered_json parts = ordered_json::object();
    for (const auto& [name, weight] : flat.direction) parts[name] = weight;
    json["flat"].push_back({{"direction", parts}, {"text", flat.text}});
  }
  json["correlated"] = ordered_json::array();
  for (const auto& [a, b, r] : run.correlated)
    json["correlated"].push_back({{"parameters", {a, b}}, {"correlation", r}});
  json["spread"] = Json(run.spread);
  for (const auto& fit : run.per_log) {
    json["per_log"].push_back({{"log", fit.log},
                               {"termination", fit.termination},
                               {"parameters", Json(fit.parameters)},
                               {"spread", Json(fit.spread)}});
  }
  json["error"] = JsonErrors(run);
  json["held_out_by"] = run.held_out_by;
  json["train"] = Json(run.train);
  json["held_out"] = Json(run.held_out);
  json["experiment"] = run.model.experiment;
  json["effects"] = JsonEffects(run.model.effects);
  json["model"] = JsonModel(run.model);
  json["time_step_s"] = run.time_step_s;
  json["command_shift_s"] = run.command_shift_s;
  json["force_shift_s"] = run.force_shift_s;
  json["seed"] = run.info.seed;
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::string ToTable(const TuneRun& run, const Console& console) {
  std::string text = ParameterLines(run, console) + PerLogLines(run) + "\n" + HeldOutLines(run, console);
  text += fmt::format("\nerror: nominal {:.4g}, train {:.4g}, held out {:.4g} ({})\n", run.error_nominal,
                      run.error_train, run.error_held_out, run.held_out_by);
  const std::string forces = run.force_shift_s == 0 ? "" : fmt::format(", forces {:+.3f} ms", 1e3 * run.force_shift_s);
  text += fmt::format(
      "{}: {}; {} evaluations, {} replays of all logs, {:.2f} s; time step {:.3g} ms; commands {:+.3f} ms late{}\n",
      run.optimizer, run.termination, run.evaluations, run.replays, run.wall_s, 1e3 * run.time_step_s,
      1e3 * run.command_shift_s, forces);
  if (run.starts > 1) {
    text += fmt::format("{} starts {}\n", run.starts,
                        run.starts_agree ? "agree"
                                         : "end in different places: the best is shown; more starts (--starts) or "
                                           "a global search (--optimizer crs2) may find better");
  }
  return text;
}

}  // namespace gapscope
