#include "src/model/plugin_library.h"

#include <dlfcn.h>
#include <mujoco/mujoco.h>

#include <filesystem>

#include "src/core/apart.h"

namespace gapscope {
namespace {

std::string Open(const std::string& file) {
  const int before = mjp_pluginCount();
  if (!dlopen(file.c_str(), RTLD_NOW | RTLD_LOCAL)) return dlerror();
  return mjp_pluginCount() > before ? "" : "it registers no plugin";
}

}  // namespace

Result<std::vector<std::string>> LoadPluginLibraries(const std::vector<std::string>& files) {
  std::vector<std::string> left_out;
  for (const std::string& file : files) {
    std::error_code failure;
    const auto path = std::filesystem::canonical(file, failure);
    if (failure || !std::filesystem::is_regular_file(path))
      return Error{.what = "no such plugin library", .where = "--plugin", .actual = "'" + file + "'"};
    std::string fault = TryApart([&] { return Open(path); });
    if (fault.empty()) fault = Open(path);
    if (!fault.empty())
      left_out.push_back(std::string("the plugin library '").append(file).append("' is left out: ").append(fault));
  }
  return left_out;
}

}  // namespace gapscope
