// docs/reference/results.md says what the JSON Schemas in schemas/ say. Between its markers it is made from them:
// GAPSCOPE_WRITE_DOCS=1 build/tests/docs_results_test rewrites it, without that the test compares.
#include <gtest/gtest.h>

#include <algorithm>
#include <nlohmann/json.hpp>
#include <string>

#include "tests/docs/made_part.h"
#include "tests/docs/schemas.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

const ordered_json kNone = ordered_json::object();

std::string Joined(const ordered_json& words) {
  std::string text;
  for (const auto& word : words) text += (text.empty() ? "" : ", ") + ("`" + word.dump() + "`");
  return text;
}

// "common.schema.json#/$defs/size" is told as "size", "#/$defs/log" as "log": both are described under that name.
std::string Referred(const std::string& reference) { return reference.substr(reference.rfind('/') + 1); }

// "list of lists of number", "`"none"`, `"effects"`".
std::string KindOf(const ordered_json& value) {
  if (value.contains("$ref")) return "*" + Referred(value["$ref"]) + "*";
  if (value.contains("const")) return "`" + value["const"].dump() + "`";
  if (value.contains("enum")) return Joined(value["enum"]);
  const ordered_json type = value.value("type", ordered_json("anything"));
  if (type.is_array()) {
    std::string text;
    for (const auto& one : type) text += (text.empty() ? "" : " or ") + one.get<std::string>();
    return text;
  }
  if (type == "array") return "list of " + KindOf(value.value("items", kNone));
  const ordered_json named = value.value("additionalProperties", kNone);
  if (type == "object" && named.is_object() && !named.empty()) return "by name: " + KindOf(named);
  return type;
}

std::string Cell(std::string text) {
  for (std::size_t at = 0; (at = text.find('|', at)) != std::string::npos; at += 2) text.insert(at, "\\");
  return text;
}

void AddRows(const ordered_json& schema, const std::string& above, std::string& to);

// The keys of an object, of a list of objects or of objects by name.
void AddBelow(const ordered_json& value, const std::string& name, std::string& to) {
  if (value.contains("properties")) AddRows(value, name + ".", to);
  if (value.contains("items")) AddBelow(value["items"], name + "[]", to);
  const ordered_json named = value.value("additionalProperties", kNone);
  if (named.is_object() && !named.empty()) AddBelow(named, name + ".NAME", to);
}

void AddRows(const ordered_json& schema, const std::string& above, std::string& to) {
  const ordered_json required = schema.value("required", ordered_json::array());
  for (const auto& [key, value] : schema["properties"].items()) {
    const bool always = std::ranges::find(required, ordered_json(key)) != required.end();
    const std::string name = above + key, what = value.value("description", "");
    const std::string missing = always ? "" : what.empty() ? "may be missing" : "may be missing; ";
    to += "| `" + name + "` | " + KindOf(value) + " | " + Cell(missing + what) + " |\n";
    AddBelow(value, name, to);
  }
}

std::string Table(const ordered_json& schema) {
  std::string rows;
  AddRows(schema, "", rows);
  return "| key | is | what |\n|---|---|---|\n" + rows;
}

std::string Definitions(const ordered_json& schema) {
  std::string text;
  const ordered_json definitions = schema.value("$defs", kNone);
  for (const auto& [name, value] : definitions.items()) {
    text += "\n*" + name + "*";
    const std::string kind = value.contains("properties") ? "" : KindOf(value), what = value.value("description", "");
    text += (kind.empty() ? "" : ": " + kind) + (what.empty() ? "" : (kind.empty() ? ": " : ". ") + what) + "\n";
    if (value.contains("properties")) text += "\n" + Table(value);
  }
  return text;
}

std::string ResultsText() {
  std::string text, common;
  for (const auto& [name, schema] : AllSchemas()) {
    if (name == "experiment") continue;  // scripts/references makes docs/reference/experiment.md of it
    std::string title = schema.at("title");
    if (!title.ends_with('.')) title += '.';
    std::string section = "\n## " + name + "\n\n" + Wrapped(title);
    if (schema.contains("properties")) section += "\n" + Table(schema);
    section += Definitions(schema);
    (name == "common" ? common : text) += section;
  }
  return (text + common).substr(1);
}

TEST(ResultsDocTest, IsWhatTheSchemasSay) { ExpectMadePart("results", "schemas", ResultsText(), "docs_results_test"); }

}  // namespace
}  // namespace gapscope
