// docs/reference/options.md says what the commands' tables of options say. Between its markers it is made from them:
// GAPSCOPE_WRITE_DOCS=1 build/tests/docs_options_test rewrites it, without that the test compares.
#include <gtest/gtest.h>

#include <map>

#include "src/cli/commands.h"
#include "tests/docs/made_part.h"

namespace gapscope {
namespace {

using cli::Command;

// "**`--window NUMBER`** (s, above 0; default: the experiment's). Length of a window. Windows follow ..."
std::string Paragraph(const Option& option) {
  std::string head = option.flag, facts = option.Allowed();
  if (!option.Kind().empty()) head += " " + option.Kind();
  const std::string value = option.Default();
  if (option.required) facts += std::string(facts.empty() ? "" : "; ") + "required";
  if (!option.required && !value.empty()) facts += (facts.empty() ? "" : "; ") + ("default: " + value);
  std::string text = "- **`" + head + "`**" + (facts.empty() ? "" : " (" + facts + ")") + ". " + option.help + ".";
  return text + (option.more.empty() ? "" : " " + option.more + ".");
}

struct Listed {
  std::string name, family;  // "design chirp", "design"
  const Command* command;
};

// The commands that do something, in the order of the help.
void List(const std::vector<Command>& commands, const std::string& above, std::vector<Listed>& to) {
  for (const Command& command : commands) {
    const std::string name = above + command.name;
    if (command.run) to.push_back({name, name.substr(0, name.find(' ')), &command});
    List(command.commands, name + " ", to);
  }
}

// A paragraph that several commands use stands once: first of all where they are of several families ("replay",
// "identify"), else at the head of its family.
enum class Home { kCommand, kFamily, kAll };
struct Homes {
  std::map<std::string, std::map<std::string, int>> uses;  // by paragraph and family
  std::vector<std::string> order;
  Home Of(const std::string& paragraph) const {
    const auto& families = uses.at(paragraph);
    if (families.size() >= 2) return Home::kAll;
    return families.begin()->second >= 3 ? Home::kFamily : Home::kCommand;
  }
};

std::string SharedText(const Homes& homes, Home home, const std::string& family) {
  std::string text;
  for (const auto& paragraph : homes.order) {
    if (homes.Of(paragraph) == home && (family.empty() || homes.uses.at(paragraph).contains(family)))
      text += Wrapped(paragraph);
  }
  return text;
}

std::string CommandText(const Listed& listed, const Homes& homes) {
  std::string text = "\n## " + listed.name + "\n\n" + Wrapped(listed.command->what + ".") + "\n";
  text += Wrapped("Example: `" + listed.command->example + "`") + "\n";
  std::string shared;
  for (const Option& option : listed.command->options) {
    const std::string paragraph = Paragraph(option);
    if (homes.Of(paragraph) == Home::kCommand) text += Wrapped(paragraph);
    if (homes.Of(paragraph) != Home::kCommand) shared += (shared.empty() ? "`" : ", `") + option.flag + "`";
  }
  return text + (shared.empty() ? "" : Wrapped("- As above: " + shared + "."));
}

std::string OptionsText() {
  const std::vector<Command> commands = cli::AllCommands();
  std::vector<Listed> listed;
  List(commands, "", listed);
  Homes homes;
  for (const auto& [name, family, command] : listed) {
    for (const Option& option : command->options) {
      const std::string paragraph = Paragraph(option);
      if (!homes.uses.contains(paragraph)) homes.order.push_back(paragraph);
      ++homes.uses[paragraph][family];
    }
  }
  std::string text = "## Options of several commands\n\n" + SharedText(homes, Home::kAll, ""), last;
  for (const Listed& one : listed) {
    const std::string shared = SharedText(homes, Home::kFamily, one.family);
    if (one.family != last && !shared.empty()) text += "\n## " + one.family + ": options of several\n\n" + shared;
    last = one.family;
    text += CommandText(one, homes);
  }
  return text;
}

TEST(OptionsDocTest, IsWhatTheCommandsTake) {
  ExpectMadePart("options", "src/cli", OptionsText(), "docs_options_test");
}

// What a command starts from is a value that it would accept.
TEST(OptionsDocTest, DefaultsAreInTheirRanges) {
  const std::vector<Command> commands = cli::AllCommands();
  std::vector<Listed> listed;
  List(commands, "", listed);
  EXPECT_GE(listed.size(), 25u);
  for (const auto& [name, family, command] : listed) {
    for (const Option& option : command->options) {
      if (option.required) continue;
      const Status status = option.Check();
      EXPECT_TRUE(status.ok()) << name << ": " << status.error().Text();
    }
  }
}

}  // namespace
}  // namespace gapscope
