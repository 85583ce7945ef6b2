// The JSON Schemas of the experiment file and of the results, as they stand in schemas/.
#ifndef GAPSCOPE_TESTS_DOCS_SCHEMAS_H_
#define GAPSCOPE_TESTS_DOCS_SCHEMAS_H_

#include <gtest/gtest.h>

#include <filesystem>
#include <map>
#include <nlohmann/json.hpp>
#include <string>

#include "src/core/file.h"

namespace gapscope {

// By name, "diagnosis" of schemas/diagnosis.schema.json.
inline std::map<std::string, nlohmann::ordered_json> AllSchemas() {
  std::map<std::string, nlohmann::ordered_json> schemas;
  for (const auto& file : std::filesystem::directory_iterator(std::string(GAPSCOPE_SOURCE_DIR) + "/schemas")) {
    const auto text = ReadFile(file.path().string());
    EXPECT_TRUE(text.ok()) << file.path();
    std::string name = file.path().filename().string();
    name.resize(name.find(".schema.json"));
    schemas[name] = nlohmann::ordered_json::parse(text.value());
  }
  return schemas;
}

}  // namespace gapscope

#endif  // GAPSCOPE_TESTS_DOCS_SCHEMAS_H_
