#include "src/log/npz_writer.h"

#include <fmt/format.h>

#include <nlohmann/json.hpp>

#include "src/core/file.h"
#include "src/log/npz_archive.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostAround = 512;  // bytes of headers, about one member

std::string MetaOf(const Log& log) {
  nlohmann::ordered_json json = {{"schema", "gapscope.log/1"},
                                 {"names", nlohmann::ordered_json::array()},
                                 {"units", nlohmann::ordered_json::array()}};
  nlohmann::ordered_json clocks = nlohmann::ordered_json::array();
  bool known = false;
  for (const Column& column : log.columns) {
    json["names"].push_back(column.name);
    json["units"].push_back(column.unit);
    clocks.push_back(column.clock);
    known = known || !column.clock.empty();
  }
  if (known) json["clock"] = std::move(clocks);
  if (!log.time_column.empty()) json["time"] = log.time_column;
  if (log.joined) json["missing"] = "keep";
  json["header"] = nlohmann::ordered_json::object();
  for (const auto& [key, value] : log.header) json["header"][key] = value;
  for (const auto& [key, value] : log.header_text) json["header"][key] = value;
  json["findings"] = nlohmann::ordered_json::array();
  for (const Finding& finding : log.findings) {
    // What is missing is NaN in the table: who reads that counts it again.
    if (finding.kind == "missing") continue;
    json["findings"].push_back(
        {{"kind", finding.kind}, {"column", finding.column}, {"count", finding.count}, {"text", finding.text}});
  }
  return json.dump(-1, ' ', false, nlohmann::ordered_json::error_handler_t::replace);
}

}  // namespace

Status WriteNpz(const std::string& path, const Log& log) {
  const std::string meta = MetaOf(log);
  const std::size_t each = log.rows() * sizeof(double) + kMostAround;
  if (meta.size() + (log.columns.size() + 1) * each > NpzArchive::kMost)
    return Error{.what = "a log above 4 GB",
                 .where = log.path,
                 .actual = fmt::format("{} columns of {} rows", log.columns.size(), log.rows()),
                 .cure = "split it, or leave out columns"};
  NpzArchive archive;
  archive.AddBytes("meta", meta);
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    const std::vector<double>& values = log.columns[c].values;
    archive.Add(fmt::format("c{}", c), {values.size()}, values);
  }
  return WriteFile(path, archive.Finish());
}

}  // namespace gapscope
