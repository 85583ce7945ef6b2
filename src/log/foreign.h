// Formats of other tools, which the Python package reads and writes (docs/reference/formats.md): its converter makes
// one NPZ table of them, and an MCAP file of one.
#ifndef GAPSCOPE_LOG_FOREIGN_H_
#define GAPSCOPE_LOG_FOREIGN_H_

#include <string>
#include <vector>

#include "src/log/log.h"

namespace gapscope {

struct ForeignFormat {
  std::string name;  // "MAT file"
};

// By the name of a file, or by what a folder holds; null: none of them, or nothing is there.
const ForeignFormat* ForeignFormatOf(const std::string& path);

// "dataset#3" names an episode of "dataset".
std::string WithoutEpisodes(const std::string& path);

// The logs that a path names: of a LeRobot dataset ("dataset", "dataset#0:20") one for each of its episodes, which the
// converter lists; else itself. Errors: as ReadForeign.
Result<std::vector<std::string>> LogsNamed(const std::string& path);

// What to do where there is no converter: no package index has it. It says itself which of its extras it lacks.
inline constexpr char kInstallConverter[] =
    "scripts/wheel; in a venv pip install \"$(ls dist/gapscope-*.whl)[all]\"; its bin folder on the PATH";

// The converter: $GAPSCOPE_CONVERT, gapscope-convert beside this program, or on the PATH.
std::string ConverterProgram();

// Starts it, without a shell. Errors: there is none (says what to install); what the converter refuses, in its own
// words; it fails. `source` is handed on as it stands: a JSON object with the keys of docs/reference/formats.md, or
// nothing.
Result<Log> ReadForeign(const std::string& path, const ForeignFormat& format, const std::string& source);

// Columns /TOPIC/JOINT/position, velocity and effort as messages sensor_msgs/JointState in the MCAP file `path`, whole
// or not at all: the columns that ReadForeign gives again. Rows without a value of a topic are no message of it.
// Errors: as ReadForeign; a log without such columns; as WriteFile.
Status WriteMcap(const std::string& path, const Log& log);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_FOREIGN_H_
