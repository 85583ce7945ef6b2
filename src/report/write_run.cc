#include "src/report/write_run.h"

#include <filesystem>
#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/report/html_report.h"

namespace gapscope {

std::vector<RunTable> TraceTables(const std::vector<LogReplay>& logs, const std::vector<Recording>& recordings) {
  const std::vector<std::string> names = CsvNames(Collect(logs, &LogReplay::log_path));
  std::vector<RunTable> tables;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    RunTable table{.path = "traces/" + names[l], .columns = {{"__time", logs[l].time_s}}};
    for (const auto& command : recordings[l].commands)
      table.columns.push_back({"command/" + command.actuator, command.values});
    for (const auto& signal : logs[l].signals) {
      table.columns.push_back({"measured/" + signal.signal, signal.measured});
      table.columns.push_back({"predicted/" + signal.signal, signal.predicted});
    }
    tables.push_back(std::move(table));
  }
  return tables;
}

Status WriteRun(const std::string& folder, const nlohmann::ordered_json& result, const RunFiles& files) {
  const std::filesystem::path out = folder;
  GS_RETURN_IF_ERROR(WriteFile(out / "result.json", JsonText(result)));
  if (!files.model_xml.empty()) GS_RETURN_IF_ERROR(WriteFile(out / "model.xml", files.model_xml));
  for (const auto& table : files.tables)
    GS_RETURN_IF_ERROR(WriteFile(out / table.path, CsvText(table.columns, table.digits)));
  if (!files.next_experiment.empty()) GS_RETURN_IF_ERROR(WriteFile(out / kNextExperimentFile, files.next_experiment));
  if (files.report) GS_RETURN_IF_ERROR(WriteReportHtml(folder, result, *files.report));
  return Ok();
}

}  // namespace gapscope
