// The files that a log consists of.
#ifndef GAPSCOPE_LOG_LOG_FILES_H_
#define GAPSCOPE_LOG_LOG_FILES_H_

#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/log/log.h"

namespace gapscope {

// The path of the file that belongs to the log at `path`. Error: the log's name does not have what is to be replaced.
Result<std::string> CompanionPath(const std::string& path, const Companion& companion);

// Every file that ReadLog reads of `path`: itself, its companions, all files of a folder that is a log. Errors as
// CompanionPath.
Result<std::vector<std::string>> FilesOfLog(const std::string& path, const ReadOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_LOG_FILES_H_
