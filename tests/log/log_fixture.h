// Logs from bytes, through the same way that files take.
#ifndef GAPSCOPE_TESTS_LOG_LOG_FIXTURE_H_
#define GAPSCOPE_TESTS_LOG_LOG_FIXTURE_H_

#include <gtest/gtest.h>
#include <unistd.h>

#include <cmath>
#include <filesystem>
#include <optional>
#include <string>
#include <vector>

#include "src/core/file.h"
#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

// A folder of this process, taken away at the end.
class TempFolder {
 public:
  TempFolder() : path_(std::filesystem::temp_directory_path() / ("gapscope_log_" + std::to_string(getpid()))) {
    std::filesystem::create_directories(path_);
  }
  ~TempFolder() {
    std::error_code ignored;
    std::filesystem::remove_all(path_, ignored);
  }
  std::string Write(const std::string& name, const std::string& bytes) const {
    const std::string path = (path_ / name).string();
    EXPECT_TRUE(WriteFile(path, bytes).ok());
    return path;
  }
  std::string Path(const std::string& name) const { return (path_ / name).string(); }

 private:
  std::filesystem::path path_;
};

inline const Finding* FindFinding(const std::vector<Finding>& findings, const std::string& kind,
                                  const std::string& column = "") {
  for (const auto& finding : findings) {
    if (finding.kind == kind && (column.empty() || finding.column == column)) return &finding;
  }
  return nullptr;
}

// A log made in memory.
inline Log MakeLog(const std::vector<std::pair<std::string, std::vector<double>>>& columns) {
  Log log;
  log.path = "made.csv";
  log.format = "csv";
  for (const auto& [name, values] : columns) log.columns.push_back({name, "", values});
  log.lines = {{0, 2}};
  return log;
}

// The first error on the way from a file to SI values: reading, time, every other column.
inline std::optional<Error> FirstError(const std::string& path, const ReadOptions& options = {}) {
  const Result<Log> log = ReadLog(path, options);
  if (!log.ok()) return log.error();
  const Result<Timeline> timeline = BuildTimeline(log.value(), {});
  if (!timeline.ok()) return timeline.error();
  for (const auto& column : log.value().columns) {
    const auto values = ExtractColumn(log.value(), timeline.value(), column, {}, nullptr);
    if (!values.ok()) return values.error();
  }
  return std::nullopt;
}

}  // namespace gapscope

#endif  // GAPSCOPE_TESTS_LOG_LOG_FIXTURE_H_
