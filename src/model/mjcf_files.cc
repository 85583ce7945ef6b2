#include "src/model/mjcf_files.h"

#include <filesystem>
#include <set>
#include <utility>

#include "src/core/file.h"
#include "src/model/xml_text.h"

namespace gapscope {
namespace {

namespace fs = std::filesystem;

class MjcfFiles {
 public:
  explicit MjcfFiles(const std::string& path) : main_(fs::path(path).parent_path()) {}

  Status Read(const fs::path& path) {
    if (!seen_.insert(path.lexically_normal()).second) return Ok();
    files_.push_back(path.string());
    GS_ASSIGN(const std::string text, ReadFile(path.string()));
    GS_ASSIGN(const XmlText xml, XmlText::Parse(text, path.string()));
    for (const XmlElement& element : xml.elements()) {
      for (const XmlAttribute& attribute : element.attributes) {
        const std::string& name = attribute.name;
        if (name == "meshdir" || name == "texturedir" || name == "assetdir") folders_.insert(attribute.value);
        // A cube's texture has six: fileright, fileleft ...
        if (name.starts_with("file")) names_.push_back({attribute.value, path.parent_path()});
        const bool is_mjcf = name == "file" && (element.tag == "include" || element.tag == "model");
        if (is_mjcf) GS_RETURN_IF_ERROR(ReadIncluded(attribute.value, path.parent_path()));
      }
    }
    return Ok();
  }

  // With the assets, whose folders may be stated behind them.
  std::vector<std::string> All() {
    for (const auto& [name, own] : names_) {
      for (const fs::path& folder : {main_, own}) {
        for (const std::string& assets : folders_) {
          Add(folder / assets / name);
          Add(folder / assets / fs::path(name).filename());  // strippath
        }
      }
    }
    return files_;
  }

 private:
  Status ReadIncluded(const std::string& name, const fs::path& own) {
    std::error_code failed;
    for (const fs::path& folder : {main_, own}) {
      if (fs::is_regular_file(folder / name, failed)) return Read(folder / name);
    }
    return Ok();  // what MuJoCo misses, it says
  }
  void Add(const fs::path& path) {
    std::error_code failed;
    if (fs::is_regular_file(path, failed) && seen_.insert(path.lexically_normal()).second)
      files_.push_back(path.string());
  }

  fs::path main_;
  std::vector<std::string> files_;
  std::set<fs::path> seen_;
  std::set<std::string> folders_ = {""};
  std::vector<std::pair<std::string, fs::path>> names_;  // as stated, and the folder of the file that states it
};

}  // namespace

Result<std::vector<std::string>> FilesOfMjcf(const std::string& path) {
  MjcfFiles files(path);
  GS_RETURN_IF_ERROR(files.Read(path));
  return files.All();
}

}  // namespace gapscope
