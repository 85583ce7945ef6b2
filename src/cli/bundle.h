// One diagnosis as a ZIP archive that another machine runs again: what it read, its command, its result, digests of all
// of it, and a script that compares.
#ifndef GAPSCOPE_CLI_BUNDLE_H_
#define GAPSCOPE_CLI_BUNDLE_H_

#include <filesystem>
#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/core/result.h"
#include "src/experiment/experiment.h"

namespace gapscope::cli {

// What a diagnosis reads, as the command line names it.
struct BundleInputs {
  std::vector<std::string> logs;
  std::vector<std::string> others;  // --params, --plugin
  bool digests_only = false;        // logs stay out, their digests are in
};

// Files keep their places to each other, so that what names another by a relative path still finds it.
class Bundle {
 public:
  // Finds the files and takes their digests. Errors: unreadable; a path in the experiment file or the MJCF that holds
  // on this machine alone.
  static Result<Bundle> Of(const Experiment& experiment, const BundleInputs& inputs);

  // How the bundle's command names a path that this one names `path`.
  std::string Moved(const std::string& path) const;

  // Writes the archive. `words`: the command, its paths moved. Errors: a file that has changed since Of, an archive
  // above 4 GB, the disk.
  Status Write(const std::string& zip, const std::vector<std::string>& words, nlohmann::ordered_json result) const;

 private:
  struct File {
    std::filesystem::path place;
    std::string inside;  // its name in the archive
    std::string sha256;
    bool packed = true;
  };
  Status Add(const std::string& path, bool packed);
  nlohmann::ordered_json Facts(const std::string& command) const;

  std::vector<File> files_;
  std::vector<std::string> given_;     // paths as they were given
  std::filesystem::path root_, from_;  // above all files; the folder that the command runs in
};

// What differs between two results of one command, wall time and versions apart: "" or a line for each of the first
// few places.
std::string Differences(const nlohmann::ordered_json& expected, const nlohmann::ordered_json& got);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_BUNDLE_H_
