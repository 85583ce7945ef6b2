#include "src/report/csv.h"

#include <charconv>
#include <cmath>
#include <filesystem>
#include <set>

#include "src/core/statistics.h"

namespace gapscope {

std::string CsvText(const std::vector<CsvColumn>& columns, int digits) {
  std::string text;
  for (const auto& column : columns) text += (text.empty() ? "" : ",") + column.head;
  text += '\n';
  char buffer[40];
  for (std::size_t row = 0; !columns.empty() && row < columns.front().values.size(); ++row) {
    for (std::size_t c = 0; c < columns.size(); ++c) {
      if (c > 0) text += ',';
      const double value = row < columns[c].values.size() ? columns[c].values[row] : kNaN;
      if (!std::isfinite(value)) continue;
      char* const end = buffer + sizeof buffer;
      text.append(buffer, digits > 0 ? std::to_chars(buffer, end, value, std::chars_format::general, digits).ptr
                                     : std::to_chars(buffer, end, value).ptr);
    }
    text += '\n';
  }
  return text;
}

std::vector<std::string> CsvNames(const std::vector<std::string>& log_paths) {
  std::vector<std::string> names;
  std::set<std::string> used;
  for (std::size_t i = 0; i < log_paths.size(); ++i) {
    std::string name = std::filesystem::path(log_paths[i]).stem().string();
    if (!used.insert(name).second) name.insert(0, std::to_string(i) + "_");
    names.push_back(name + ".csv");
  }
  return names;
}

}  // namespace gapscope
