// The files that an MJCF takes in.
#ifndef GAPSCOPE_MODEL_MJCF_FILES_H_
#define GAPSCOPE_MODEL_MJCF_FILES_H_

#include <string>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// The MJCF at `path`, then what it includes, attaches and draws: every file of a name that it states, in the places
// where MuJoCo looks. (mju_getXMLDependencies fills a vector of MuJoCo's C++ library, which is not this program's.)
// Errors: unreadable, not XML.
Result<std::vector<std::string>> FilesOfMjcf(const std::string& path);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_MJCF_FILES_H_
