#include "src/report/export_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <nlohmann/json.hpp>

#include "src/core/names.h"
#include "src/report/json.h"

namespace gapscope {

using nlohmann::ordered_json;

namespace {

// What the draws are of.
std::string SourceText(const ExportRun& run) {
  switch (run.draws_from) {
    case DrawsFrom::kCovariance:
      return " of what the logs leave open";
    case DrawsFrom::kInterval:
      return " within what the logs leave open, each parameter uniform in its interval";
    case DrawsFrom::kLogs:
      return fmt::format(" of how {} logs differ", run.fitted_alone);
    case DrawsFrom::kFits:
      return fmt::format(", each the fit to one of {} logs", run.fitted_alone);
  }
  return "";
}

std::string RangeLines(const ExportRun& run) {
  std::string text = fmt::format("  {} draws{}, and 95 % ranges:\n", run.draws, SourceText(run));
  for (const ParameterRange& range : run.randomization.ranges) {
    std::vector<std::string> fields;
    for (const VaryingNumber& number : range.numbers) {
      if (fields.empty() || fields.back() != number.field) fields.push_back(number.field);
    }
    text += fmt::format("  {:<36} {:.4g} .. {:.4g} {}{}: {}\n", range.name, range.low, range.high, range.unit,
                        range.conditional ? ", the others as they are" : "",
                        fields.empty() ? "no number of the MJCF, so the host's" : Join(fields));
  }
  if (!run.alike.empty())
    text += "  at their mean, for they differ no more than each fit leaves open: " + Join(run.alike) + "\n";
  if (!run.not_of_each.empty())
    text += "  as they are, for not each log alone knows them: " + Join(run.not_of_each) + "\n";
  if (run.fitted_alone == 0)
    text +=
        "  of one fit, which is not how robots and days differ: for that `tune --each-log`, with four logs or more\n";
  return text;
}

}  // namespace

ordered_json ToJson(const ExportRun& run) {
  ordered_json json = {{"schema", "gapscope.fidelity/1"},
                       {"result", run.result},
                       {"target", run.target},
                       {"model", run.out},
                       {"files", run.files},
                       {"time_step_s", run.time_step_s},
                       {"delay_steps", run.delay_steps},
                       {"effects", ordered_json::array()},
                       {"of_each_log", run.left_out},
                       {"held_out_error",
                        {{"nominal", JsonNumber(run.errors.nominal)},
                         {"model", JsonNumber(run.errors.model)},
                         {"exported", JsonNumber(run.errors.exported)},
                         {"lost", JsonNumber(run.errors.Lost())}}},
                       {"logs", run.logs},
                       {"unmeasured", run.unmeasured},
                       {"versions", JsonVersions(run.info)}};
  for (const NativeEffect& effect : run.effects) {
    json["effects"].push_back({{"name", effect.use.effect},
                               {"on", effect.use.on},
                               {"form", FidelityName(effect.fidelity)},
                               {"how", effect.how}});
  }
  return json;
}

ordered_json RandomizationJson(const ExportRun& run) {
  ordered_json json = {{"schema", "gapscope.randomization/1"},
                       {"result", run.result},
                       {"target", run.target},
                       {"model", run.out},
                       {"draws", run.draws},
                       {"seed", run.info.seed},
                       {"from", NameOf(run.draws_from)},
                       {"fitted_alone", run.fitted_alone},
                       {"not_of_each", run.not_of_each},
                       {"alike", run.alike},
                       {"parameters", ordered_json::array()},
                       {"fields", ordered_json::object()},
                       {"versions", JsonVersions(run.info)}};
  for (const ParameterRange& range : run.randomization.ranges) {
    ordered_json numbers = ordered_json::array();
    for (const VaryingNumber& number : range.numbers) {
      numbers.push_back({{"field", number.field},
                         {"index", {number.row, number.column}},
                         {"value", number.value},
                         {"low", number.low},
                         {"high", number.high}});
    }
    json["parameters"].push_back({{"name", range.name},
                                  {"unit", range.unit},
                                  {"value", range.value},
                                  {"low", range.low},
                                  {"high", range.high},
                                  {"conditional", range.conditional},
                                  {"numbers", std::move(numbers)}});
  }
  for (const DrawnField& field : run.randomization.fields) json["fields"][field.name] = field.shape;
  return json;
}

std::string ToTable(const ExportRun& run) {
  constexpr double kMuch = 0.1;
  std::string text;
  std::vector<std::string> files = {run.out};
  files.insert(files.end(), run.files.begin(), run.files.end());
  if (const double lost = run.errors.Lost(); lost > kMuch)
    text += fmt::format("{:.0f} % of what the model closes is open again in {}\n", 100 * std::min(lost, 1.0), run.out);
  text += fmt::format("{}: {} for {}, steps of {:.4g} ms\n", Join(files), run.result, run.what, 1e3 * run.time_step_s);
  for (const NativeEffect& effect : run.effects)
    text += fmt::format("  {:<36} {:<13} {}\n", effect.use.Text(), FidelityName(effect.fidelity), effect.how);
  if (!run.left_out.empty()) text += fmt::format("  as it was, since each log sets it anew: {}\n", Join(run.left_out));
  if (run.draws > 0) text += RangeLines(run);
  if (!run.unmeasured.empty()) return text + "  not measured: " + run.unmeasured + "\n";
  return text + fmt::format("  held-out error: nominal {:.4g}, the model {:.4g}, exported {:.4g}\n", run.errors.nominal,
                            run.errors.model, run.errors.exported);
}

}  // namespace gapscope
