#include "src/report/identify_report.h"

#include <fmt/format.h>

#include <cmath>
#include <nlohmann/json.hpp>

#include "src/report/json.h"

namespace gapscope {

using nlohmann::ordered_json;

std::string ToTable(const IdentifyRun& run) {
  const Identification& result = run.result;
  std::string text =
      fmt::format("{}\n\n{:<28} {:>12}   {:<26} {}\n", result.relation, "", "value", "95 % interval", "unit");
  for (const auto& v : result.values) {
    text += fmt::format(
        "{:<28} {:>12.5g}   {:<26} {}\n", v.name, v.value,
        std::isfinite(v.low) || std::isfinite(v.high) ? fmt::format("{:.5g} .. {:.5g}", v.low, v.high) : "", v.unit);
  }
  text += fmt::format("\n{} rows", result.rows);
  if (std::isfinite(result.r2)) text += fmt::format(", R^2 {:.5f}", result.r2);
  if (std::isfinite(result.rmse)) text += fmt::format(", RMSE {:.4g} {}", result.rmse, result.unit);
  text += "\n";
  for (const auto& remark : result.remarks) text += fmt::format("- {}\n", remark);
  return text;
}

ordered_json ToJson(const IdentifyRun& run) {
  const Identification& result = run.result;
  ordered_json json = {{"schema", "gapscope.identify." + result.method + "/1"},
                       {"relation", result.relation},
                       {"values", ordered_json::object()}};
  for (const auto& v : result.values)
    json["values"][v.name] = {
        {"value", JsonNumber(v.value)}, {"low", JsonNumber(v.low)}, {"high", JsonNumber(v.high)}, {"unit", v.unit}};
  json["fit"] = {
      {"r2", JsonNumber(result.r2)}, {"rmse", JsonNumber(result.rmse)}, {"unit", result.unit}, {"rows", result.rows}};
  json["remarks"] = result.remarks;
  json["tables"] = ordered_json::object();
  for (const auto& table : result.tables) {
    ordered_json rows = ordered_json::array();
    for (const auto& row : table.rows) {
      ordered_json cells = ordered_json::array();
      for (const double cell : row) cells.push_back(JsonNumber(cell));
      rows.push_back(std::move(cells));
    }
    json["tables"][table.name] = {{"columns", table.columns}, {"rows", rows}};
  }
  json["logs"] = run.logs;
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::vector<std::vector<double>> ColumnsOf(const PointTable& table) {
  std::vector<std::vector<double>> columns(table.columns.size());
  for (const auto& row : table.rows) {
    for (std::size_t c = 0; c < columns.size(); ++c) columns[c].push_back(row[c]);
  }
  return columns;
}

}  // namespace gapscope
