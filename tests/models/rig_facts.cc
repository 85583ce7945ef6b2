#include "tests/models/rig_facts.h"

#include <yaml-cpp/yaml.h>

#include <algorithm>
#include <filesystem>
#include <stdexcept>

namespace gapscope::testing {
namespace {

const std::string kModels = std::string(GAPSCOPE_SOURCE_DIR) + "/models";

RigFacts ReadFacts(const std::string& rig) {
  const std::string path = kModels + "/" + rig + "/facts.yaml";
  RigFacts facts;
  for (const auto& entry : YAML::LoadFile(path)) {
    const std::string key = entry.first.as<std::string>();
    const YAML::Node& value = entry.second;
    if (key == "joints") {
      facts.joints = value.as<std::vector<std::string>>();
    } else if (key == "motor") {
      facts.motor = value.as<std::string>();
    } else if (key == "spring") {
      facts.spring = value.as<std::string>();
    } else if (key == "dry_friction") {
      facts.dry_friction = value.as<bool>();
    } else if (key == "signals") {
      facts.signals = value.as<std::vector<std::string>>();
    } else if (key == "command") {
      facts.command = value.as<std::string>();
    } else if (key == "log_values") {
      facts.log_values = value.as<std::map<std::string, double>>();
    } else if (key == "own_values") {
      facts.own_values = value.as<bool>();
    } else if (key == "rounded") {
      facts.rounded = value.as<double>();
    } else if (key != "logs") {
      throw std::invalid_argument(path + ": unknown key '" + key + "'");
    }
  }
  return facts;
}

}  // namespace

const std::vector<std::string>& RigNames() {
  static const std::vector<std::string> names = [] {
    std::vector<std::string> found;
    for (const auto& folder : std::filesystem::directory_iterator(kModels)) {
      if (std::filesystem::exists(folder.path() / "experiment.yaml")) found.push_back(folder.path().filename());
    }
    std::sort(found.begin(), found.end());
    return found;
  }();
  return names;
}

const RigFacts& FactsOfRig(const std::string& rig) {
  static const std::map<std::string, RigFacts> facts = [] {
    std::map<std::string, RigFacts> read;
    for (const auto& name : RigNames()) read[name] = ReadFacts(name);
    return read;
  }();
  return facts.at(rig);
}

}  // namespace gapscope::testing
