// What others write into their scripts and files is promised: names of effects and their parameters, commands with
// their options and words, keys of results (CHANGELOG.md says what that means for a version). promised_names.txt lists
// those of the last version. One that is gone fails here; new ones are added at release, by
// GAPSCOPE_WRITE_DOCS=1 build/tests/promised_names_test.
#include <gtest/gtest.h>

#include <cstdlib>
#include <iostream>
#include <nlohmann/json.hpp>
#include <set>
#include <sstream>

#include "src/cli/commands.h"
#include "src/core/file.h"
#include "src/model/effect.h"
#include "src/report/version.h"
#include "tests/docs/schemas.h"

namespace gapscope {
namespace {

using Names = std::set<std::string>;
const std::string kList = std::string(GAPSCOPE_SOURCE_DIR) + "/tests/docs/promised_names.txt";
const std::string kVersion = "version ";  // of the program that the list was made of

void AddEffects(Names& to) {
  for (const Effect& effect : Catalogue()) {
    to.insert("effect " + effect.name);
    for (const EffectParameter& parameter : effect.parameters) to.insert("effect " + effect.name + "." + parameter.key);
  }
}

void AddCommands(const std::vector<cli::Command>& commands, const std::string& above, Names& to) {
  for (const cli::Command& command : commands) {
    const std::string name = above + " " + command.name;
    to.insert(name);
    for (const Option& option : command.options) {
      const std::string flag = name + " " + option.flag;
      to.insert(flag);
      const auto* choice = std::get_if<Choice>(&option.value);
      for (const std::string& word : choice ? choice->names : option.words) to.insert(flag + " " + word);
    }
    AddCommands(command.commands, name, to);
  }
}

// "schema diagnosis.effects[].name", and once more with "required" where it is.
void AddKeys(const nlohmann::ordered_json& schema, const std::string& at, Names& to) {
  if (!schema.is_object()) return;
  for (const auto& [part, below] : schema.items()) {
    if (part == "properties" || part == "$defs") {
      for (const auto& [key, value] : below.items()) {
        const std::string name = at + (part == "$defs" ? "#" : ".") + key;
        to.insert(name);
        AddKeys(value, name, to);
      }
    } else if (part == "required") {
      for (const auto& key : below) to.insert(at + "." + key.get<std::string>() + " required");
    } else if (part == "enum") {
      for (const auto& word : below) to.insert(at + " = " + word.dump());
    } else {
      AddKeys(below, at + (part == "items" ? "[]" : ".*"), to);
    }
  }
}

Names NamesNow() {
  Names names;
  AddEffects(names);
  AddCommands(cli::AllCommands(), "command", names);
  for (const auto& [name, schema] : AllSchemas()) {
    names.insert("schema " + name);
    AddKeys(schema, "schema " + name, names);
  }
  return names;
}

std::string Lines(const Names& names) {
  std::string text;
  for (const std::string& name : names) text += name + "\n";
  return text;
}

Names Without(const Names& names, const Names& others) {
  Names left;
  std::set_difference(names.begin(), names.end(), others.begin(), others.end(), std::inserter(left, left.end()));
  return left;
}

TEST(PromisedNamesTest, NoneDisappears) {
  const auto file = ReadFile(kList);
  ASSERT_TRUE(file.ok()) << file.error().Text();
  Names promised;
  std::string version;
  std::istringstream lines(file.value());
  for (std::string line; std::getline(lines, line);) {
    if (line.starts_with(kVersion)) version = line.substr(kVersion.size());
    if (!line.starts_with(kVersion)) promised.insert(line);
  }
  const Names now = NamesNow(), gone = Without(promised, now), added = Without(now, promised);
  ASSERT_TRUE(gone.empty()) << "version " << version << " promised these names, and they are gone:\n"
                            << Lines(gone)
                            << "Bring them back. Where one has to go: take its line out of "
                               "tests/docs/promised_names.txt, and say so in CHANGELOG.md.";
  if (std::getenv("GAPSCOPE_WRITE_DOCS")) {
    ASSERT_TRUE(WriteFile(kList, kVersion + GapscopeVersion() + "\n" + Lines(now)).ok());
    return;
  }
  const std::string cure = "GAPSCOPE_WRITE_DOCS=1 build/tests/promised_names_test adds them at release.\n";
  EXPECT_EQ(version, GapscopeVersion()) << "the list is of another version; " << cure;
  if (!added.empty()) std::cout << "new since version " << version << ":\n" << Lines(added) << cure;
}

}  // namespace
}  // namespace gapscope
