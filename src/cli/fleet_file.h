// A fleet's file (gapscope.fleet/1): which logs, of which robot and day by their paths, and what is done with each
// group of them. docs/reference/fleet.md tells its keys.
#ifndef GAPSCOPE_CLI_FLEET_FILE_H_
#define GAPSCOPE_CLI_FLEET_FILE_H_

#include <string>
#include <vector>

#include "src/cli/plan_file.h"

namespace gapscope::cli {

inline constexpr char kFleetSchema[] = "gapscope.fleet/1";

// A plan whose units have no names yet. Paths in the file are relative to it. Errors: as YamlMap; no log fits a
// pattern; patterns of different columns; a time that is no column.
Result<Plan> LoadFleet(const std::string& path);

// A path that fits a pattern, with the texts of the pattern's columns.
struct MatchedLog {
  std::string path;
  std::vector<std::string> columns;
};
// "logs/{robot}/{day}_*.csv": {NAME} and * stand for any text between slashes, ? for any letter. A name that comes
// twice is the same text twice. In the order of their paths; of folders that cannot be read nothing.
std::vector<MatchedLog> MatchLogs(const std::string& pattern, const std::vector<std::string>& columns);
// The names of a pattern, each once. Errors: a brace that does not close, a name that is not letters, digits and _, a
// pattern too long for a path.
Result<std::vector<std::string>> PatternColumns(const std::string& pattern);

// Numbers by their value, other texts by letters.
bool TextBefore(const std::string& a, const std::string& b);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_FLEET_FILE_H_
