// Every command that the program has, those below others too, is told of in its --help, in the manual page and by
// bash completion, with all of its options.
#include "src/cli/commands.h"
#include "tests/cli/fixture.h"

namespace gapscope::testing {
namespace {

using cli::Command;

struct Listed {
  std::string name;  // "design chirp"
  Command command;
};

void List(const std::vector<Command>& commands, const std::string& above, std::vector<Listed>& to) {
  for (const Command& command : commands) {
    to.push_back({above + command.name, command});
    List(command.commands, above + command.name + " ", to);
  }
}

std::vector<Listed> AllListed() {
  std::vector<Listed> listed;
  List(cli::AllCommands(), "", listed);
  return listed;
}

// What it takes by name: options, or the commands below it.
std::set<std::string> Words(const Command& command) {
  std::set<std::string> words = {"--help"};
  for (const Option& option : command.options) {
    if (option.flag.starts_with("--")) words.insert(option.flag);
  }
  for (const Command& below : command.commands) words.insert(below.name);
  return words;
}

TEST_F(CliTest, EveryCommandHasAHelp) {
  for (const auto& [name, command] : AllListed()) {
    const Answer help = Run(name + " --help");
    EXPECT_EQ(help.status, 0) << name;
    EXPECT_NE(help.out.find("\nExample: " + command.example), std::string::npos) << name;
    EXPECT_TRUE(help.out.starts_with(command.what)) << name;
    for (const Option& option : command.options) {
      EXPECT_NE(help.out.find("\n  " + option.flag), std::string::npos) << name << ": " << option.flag;
      EXPECT_NE(help.out.find(option.help), std::string::npos) << name << ": " << option.flag << ": " << option.help;
    }
  }
}

TEST_F(CliTest, EveryCommandIsInTheManualPage) {
  std::string page = ReadAll(GAPSCOPE_MANUAL_PAGE);
  for (std::size_t at; (at = page.find("\\-")) != std::string::npos;) page.erase(at, 1);
  ASSERT_FALSE(page.empty()) << GAPSCOPE_MANUAL_PAGE;
  for (const auto& [name, command] : AllListed()) {
    std::string title = name;
    for (char& letter : title) letter = static_cast<char>(std::toupper(static_cast<unsigned char>(letter)));
    const std::size_t begin = page.find(".SH " + title + "\n");
    ASSERT_NE(begin, std::string::npos) << name;
    const std::string section = page.substr(begin, page.find("\n.SH ", begin) - begin);
    // Semicolons and all.
    EXPECT_NE(section.find(Run(name + " --help").out), std::string::npos) << section;
  }
}

TEST_F(CliTest, CompletionKnowsEveryCommand) {
  std::string script = ". '" + std::string(GAPSCOPE_SOURCE_DIR) + "/cmake/gapscope.bash'\n";
  // Asked for what may stand after each command: a command where there are any below it, else an option.
  for (const auto& [name, command] : AllListed()) {
    script += "COMP_WORDS=('" GAPSCOPE_PROGRAM "' " + name + " '" + (command.commands.empty() ? "--" : "") +
              "'); COMP_CWORD=$((${#COMP_WORDS[@]} - 1)); COMPREPLY=(); _gapscope; echo \"${COMPREPLY[*]}\"\n";
  }
  const Answer answer = scratch_.Shell("bash '" + scratch_.Write("complete.sh", script) + "'");
  EXPECT_EQ(answer.err, "");
  std::istringstream lines(answer.out);
  for (const auto& [name, command] : AllListed()) {
    std::string line, word;
    std::getline(lines, line);
    std::istringstream words(line);
    std::set<std::string> offered;
    while (words >> word) offered.insert(word);
    EXPECT_EQ(offered, Words(command)) << name;
  }
}

}  // namespace
}  // namespace gapscope::testing
