// Strict reading of YAML maps: every key is declared, every value is checked, errors give file:line:column.
#ifndef GAPSCOPE_EXPERIMENT_YAML_READER_H_
#define GAPSCOPE_EXPERIMENT_YAML_READER_H_

#include <yaml-cpp/yaml.h>

#include <optional>
#include <string>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// A map of a YAML file whose keys are read one by one; Finish() reports the first key that nobody asked for.
// The first error sticks; readers after it return their defaults.
class YamlMap {
 public:
  // `what` names the map in errors: "measured signal".
  YamlMap(const YAML::Node& node, std::string file, std::string what);

  std::string Text(const char* key, const std::optional<std::string>& fallback = std::nullopt);
  double Number(const char* key, std::optional<double> fallback = std::nullopt);
  bool Flag(const char* key, bool fallback);
  std::vector<std::string> TextList(const char* key);  // a scalar or a list of scalars; empty when absent
  std::vector<double> NumberList(const char* key, std::size_t size);
  // One of `allowed`; the index is returned.
  std::size_t Choice(const char* key, const std::vector<std::string>& allowed, std::size_t fallback);
  YAML::Node Child(const char* key);              // undefined node when absent
  std::vector<YAML::Node> List(const char* key);  // the items; empty when absent, an error when it is no list
  // A key of this map that expressions use as a name; an error when they cannot.
  std::string Name(const YAML::Node& key);
  bool Has(const char* key);

  void Fail(const YAML::Node& at, Error error);
  bool failed() const { return error_.has_value(); }
  Status Finish();
  const std::string& file() const { return file_; }

 private:
  YAML::Node Take(const char* key);

  YAML::Node node_;
  std::string file_, what_;
  std::vector<std::string> known_;
  std::optional<Error> error_;
};

// "file:line:column" of a node.
std::string YamlPlace(const std::string& file, const YAML::Node& node);

// Parses a file of at most 1 MB. Errors: unreadable, not YAML (with line and column), empty, several documents, nested
// too deep.
Result<YAML::Node> ReadYaml(const std::string& path);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_YAML_READER_H_
