// Plugin libraries of the user's: `--plugin FILE`.
#ifndef GAPSCOPE_MODEL_PLUGIN_LIBRARY_H_
#define GAPSCOPE_MODEL_PLUGIN_LIBRARY_H_

#include <string>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// Loads them into MuJoCo, each after it was loaded apart: one that cannot be loaded, that crashes or registers no
// plugin is left out, and what is returned says so. Error: no such file.
Result<std::vector<std::string>> LoadPluginLibraries(const std::vector<std::string>& files);

}  // namespace gapscope

#endif  // GAPSCOPE_MODEL_PLUGIN_LIBRARY_H_
