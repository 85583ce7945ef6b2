// Formats of other tools, which the Python package reads (docs/formats.md): its converter writes one NPZ table.
#ifndef GAPSCOPE_LOG_FOREIGN_H_
#define GAPSCOPE_LOG_FOREIGN_H_

#include <string>

#include "src/log/log.h"

namespace gapscope {

struct ForeignFormat {
  std::string name, install;  // "MAT file"; what pip installs to read it: "'gapscope[mat]'"
};

// By the name of a file, or by what a folder holds; null: none of them, or nothing is there.
const ForeignFormat* ForeignFormatOf(const std::string& path);

// "dataset#3" names an episode of "dataset".
std::string WithoutEpisodes(const std::string& path);

// The converter: $GAPSCOPE_CONVERT, gapscope-convert beside this program, or on the PATH.
std::string ConverterProgram();

// Starts it, without a shell. Errors: there is none (says what to install); what the converter refuses, in its own
// words; it fails. `source` is handed on as it stands: a JSON object with the keys of docs/formats.md, or nothing.
Result<Log> ReadForeign(const std::string& path, const ForeignFormat& format, const std::string& source);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_FOREIGN_H_
