// Whole files: read at once, written to a temporary name and renamed, so that nothing is lost half-way.
#ifndef GAPSCOPE_CORE_FILE_H_
#define GAPSCOPE_CORE_FILE_H_

#include <string>
#include <string_view>

#include "src/core/result.h"

namespace gapscope {

// The bytes of a regular file. Errors: absent, a folder, unreadable.
Result<std::string> ReadFile(const std::string& path);

// A new empty file beside `path`, making its folders; its name. Errors: cannot create.
Result<std::string> TemporaryBeside(const std::string& path);

// Writes `path` atomically (temporary name in the same folder, then rename), making its folders.
// Errors: cannot create, write (disk full) or rename; the old file stays.
Status WriteFile(const std::string& path, std::string_view bytes);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_FILE_H_
