#include "src/report/apply_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/names.h"
#include "src/report/json.h"
#include "src/report/read_json.h"
#include "src/report/words.h"

namespace gapscope {

using nlohmann::ordered_json;

namespace {

constexpr int kDigits = 3;  // of a number in a comment

struct Interval {
  double low = kNaN, high = kNaN;
};

// An entry of a list by NAME@ON; null: it has none.
const ordered_json* EntryOf(const ordered_json& result, const char* list, const EffectUse& use) {
  if (!result.contains(list)) return nullptr;
  for (const auto& entry : result[list]) {
    if (TextIn(entry, "name") == use.effect && TextIn(entry, "on") == use.on) return &entry;
  }
  return nullptr;
}

// Of a parameter of a tuned model, by its name.
Interval TunedInterval(const ordered_json& result, const std::string& name) {
  if (!result.contains("parameters") || !result["parameters"].is_array()) return {};
  for (const auto& entry : result["parameters"]) {
    if (TextIn(entry, "name") == name) return {NumberIn(entry, "low"), NumberIn(entry, "high")};
  }
  return {};
}

std::string Quantity(double value, const std::string& unit, const Interval& interval) {
  std::string text = ShortNumber(value, kDigits) + UnitAfter(unit);
  if (std::isfinite(interval.low) && std::isfinite(interval.high) && interval.low < interval.high)
    text += fmt::format(" ({} .. {})", ShortNumber(interval.low, kDigits), ShortNumber(interval.high, kDigits));
  return text;
}

// Present statements of the same group, which the logs cannot tell from this one.
std::vector<std::string> Rivals(const ordered_json& result, const ordered_json& statement, const EffectUse& use) {
  std::vector<std::string> rivals;
  if (!statement.contains("group") || statement["group"].is_null()) return rivals;
  if (!result.contains("statements")) return rivals;
  for (const auto& other : result["statements"]) {
    const EffectUse rival{TextIn(other, "name"), TextIn(other, "on")};
    if (rival != use && TextIn(other, "answer") == "present" && other.contains("group") &&
        other["group"] == statement["group"])
      rivals.push_back(rival.Text());
  }
  return rivals;
}

std::string EffectNote(const ordered_json& result, const Model& model, std::span<const double> values,
                       const EffectUse& use) {
  const ordered_json* statement = EntryOf(result, "statements", use);
  if (!statement) statement = EntryOf(result, "effects", use);
  const std::string prefix = use.Text() + ".";
  const auto& parameters = model.parameters();
  const auto is_mine = [&](const Parameter& p) { return p.name.starts_with(prefix); };
  const bool several = std::count_if(parameters.begin(), parameters.end(), is_mine) > 1;
  std::vector<std::string> parts;
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    // One that does nothing is not worth a word.
    if (!is_mine(parameters[i]) || (several && values[i] == parameters[i].nominal)) continue;
    const std::string key = parameters[i].name.substr(prefix.size());
    Interval interval = TunedInterval(result, parameters[i].name);
    if (statement && statement->contains("parameters") && (*statement)["parameters"].contains(key)) {
      const auto& size = (*statement)["parameters"][key];
      interval = {NumberIn(size, "low"), NumberIn(size, "high")};
    }
    parts.push_back((several ? key + " " : "") + Quantity(values[i], parameters[i].unit, interval));
  }
  std::string note = use.Text() + ": " + Join(parts);
  if (!statement) return note;
  if (const double p = NumberIn(*statement, "probability"); std::isfinite(p)) note += fmt::format(", P {:.2f}", p);
  if (const auto rivals = Rivals(result, *statement, use); !rivals.empty())
    note += "; or " + Listed(rivals, "or") + ": the logs cannot tell";
  return note;
}

}  // namespace

std::map<std::string, std::string> NotesOf(const ordered_json& result, const Model& model,
                                           std::span<const double> values) {
  std::map<std::string, std::string> notes;
  const auto& parameters = model.parameters();
  for (std::size_t i = 0; i < parameters.size(); ++i) {
    const Parameter& p = parameters[i];
    if (p.owner == Parameter::Owner::kScale) continue;
    const auto use = std::find_if(model.effects().begin(), model.effects().end(),
                                  [&](const EffectUse& e) { return p.name.starts_with(e.Text() + "."); });
    if (use != model.effects().end()) {
      notes[p.name] = EffectNote(result, model, values, *use);
    } else if (values[i] != p.nominal) {
      notes[p.name] = p.name + ": " + Quantity(values[i], p.unit, TunedInterval(result, p.name)) + ", nominal " +
                      ShortNumber(p.nominal, kDigits);
    }
  }
  return notes;
}

ordered_json ToJson(const ApplyRun& run) {
  ordered_json json = {{"schema", "gapscope.apply/1"},
                       {"model", run.model},
                       {"result", run.result},
                       {"out", run.out},
                       {"changes", ordered_json::array()},
                       {"needs_plugins", run.needs_plugins},
                       {"time_step_s", JsonNumber(run.time_step_s)},
                       {"model_time_step_s", run.model_time_step_s},
                       {"not_in_model", JsonEffects(run.of_signals)},
                       {"of_each_log", run.left_out},
                       {"versions", JsonVersions(run.info)}};
  for (const auto& change : run.changes) {
    ordered_json entry = {{"element", change.element}};
    if (!change.attribute.empty())
      entry.update({{"attribute", change.attribute}, {"before", change.before}, {"after", change.after}});
    json["changes"].push_back(std::move(entry));
  }
  return json;
}

std::string ToTable(const ApplyRun& run) {
  std::string text = fmt::format("{}: {} with what {} says\n", run.out, run.model, run.result);
  for (const auto& c : run.changes) {
    if (c.attribute.empty()) {
      text += fmt::format("  {:<36} new\n", c.element);
    } else {
      text += fmt::format("  {:<36} {:<16} {} -> {}\n", c.element, c.attribute, c.before.empty() ? "none" : c.before,
                          c.after.empty() ? "none" : c.after);
    }
  }
  if (run.changes.empty()) text += "  nothing changes: the MJCF says it all already\n";
  for (const auto& use : run.of_signals)
    text += fmt::format("  not in it: {}, which is the log's and not the mechanism's\n", use.Text());
  if (!run.left_out.empty()) text += fmt::format("  as it was, since each log sets it anew: {}\n", Join(run.left_out));
  if (run.needs_plugins) text += "  it has plugin elements: load libgapscope_plugins.so before it\n";
  if (run.time_step_s < run.model_time_step_s)
    text += fmt::format("  the result's errors are of steps of {:.4g} ms; this model's own are {:.4g} ms\n",
                        1e3 * run.time_step_s, 1e3 * run.model_time_step_s);
  if (!run.setter.empty())
    text += fmt::format("  take out of 'set' in {} what stands here now: it writes nominal values over the MJCF's\n",
                        run.setter);
  return text;
}

}  // namespace gapscope
