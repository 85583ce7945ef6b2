#include "src/log/log_files.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>

#include "src/log/foreign.h"
#include "src/log/list_reader.h"
#include "src/log/text.h"

namespace gapscope {

Result<std::string> CompanionPath(const std::string& path, const Companion& companion) {
  const std::filesystem::path whole(path);
  std::string name = whole.filename().string();
  const std::size_t at = companion.find.empty() ? std::string::npos : name.rfind(companion.find);
  if (at == std::string::npos || companion.find == companion.replace) {
    return Error{.what = "no name for the file that belongs to this log",
                 .where = At(path, 1),
                 .actual = Quoted(name, 200),
                 .allowed = fmt::format("a name with {}, to be replaced by {}", Quoted(companion.find),
                                        Quoted(companion.replace)),
                 .cure = "name the right log, or correct 'companions' in the experiment file"};
  }
  name.replace(at, companion.find.size(), companion.replace);
  return (whole.parent_path() / name).string();
}

Result<std::vector<std::string>> FilesOfLog(const std::string& path, const ReadOptions& options) {
  std::error_code failed;
  std::vector<std::string> files;
  if (!options.format && ForeignFormatOf(path)) {
    const std::string place = WithoutEpisodes(path);
    if (!std::filesystem::is_directory(place, failed)) return std::vector{place};
    for (const auto& entry : std::filesystem::recursive_directory_iterator(place, failed)) {
      if (entry.is_regular_file(failed)) files.push_back(entry.path().string());
    }
    std::sort(files.begin(), files.end());
    return files;
  }
  const std::string own = StateFileOf(path);
  files.push_back(own);
  for (const std::string& beside : FilesBesideLists(own)) files.push_back(beside);
  for (const Companion& companion : options.companions) {
    GS_ASSIGN(std::string other, CompanionPath(own, companion));
    files.push_back(std::move(other));
  }
  return files;
}

}  // namespace gapscope
