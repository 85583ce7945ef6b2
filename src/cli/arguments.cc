#include "src/cli/arguments.h"

#include <fmt/core.h>

#include <CLI/CLI.hpp>
#include <cstdio>
#include <list>

#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"
#include "src/core/names.h"
#include "src/report/version.h"

namespace gapscope::cli {
namespace {

// An option with the words that were given for it.
struct Given {
  const Option* option = nullptr;
  CLI::Option* flag = nullptr;
  bool on = false;
  std::string word;
  std::vector<std::string> words;
};

struct AddedCommand {
  const Command* command = nullptr;
  CLI::App* app = nullptr;
  std::list<Given> given;  // CLI11 keeps pointers into it
};

// "Length of a window (s, above 0; default: 1)".
std::string HelpText(const Option& option) {
  const std::string allowed = option.Allowed(), value = option.Default();
  std::string text = allowed;
  if (!option.required && !value.empty()) text += (text.empty() ? "" : "; ") + ("default: " + value);
  return text.empty() ? option.help : option.help + " (" + text + ")";
}

void AddOption(const Option& option, AddedCommand& to) {
  Given& given = to.given.emplace_back();
  given.option = &option;
  if (option.IsFlag()) {
    given.flag = to.app->add_flag(option.flag, given.on, HelpText(option));
    return;
  }
  if (option.IsList()) {
    given.flag = to.app->add_option(option.flag, given.words, HelpText(option));
    if (option.commas) given.flag->delimiter(',');
    if (!option.commas && option.flag.starts_with("-")) given.flag->allow_extra_args(false);
  } else {
    given.flag = to.app->add_option(option.flag, given.word, HelpText(option));
  }
  given.flag->type_name(option.Kind())->required(option.required);
}

void AddCommand(CLI::App& above, const Command& command, std::list<AddedCommand>& added) {
  AddedCommand& own = added.emplace_back();
  own.command = &command;
  own.app = above.add_subcommand(command.name, command.what);
  own.app->footer("Example: " + command.example);
  for (const Option& option : command.options) AddOption(option, own);
  if (!command.commands.empty()) own.app->require_subcommand(1);
  CLI::App& app = *own.app;
  for (const Command& below : command.commands) AddCommand(app, below, added);
}

// What CLI11 has to say, and before it the nearest command where there is none of that name.
int Say(const CLI::App& program, const CLI::ParseError& error, int argc, char** argv) {
  if (error.get_exit_code() == 0) return program.exit(error), kDone;  // --help, --version
  if (AsksForJsonProgress(argc, argv)) {
    const Error refused{.what = error.what(), .where = "the command line", .cure = "run it with --help"};
    Print(stderr, "{}", ErrorLine(refused));
    return kBadInput;
  }
  std::vector<std::string> names;
  for (const CLI::App* command : program.get_subcommands({})) names.push_back(command->get_name());
  if (argc > 1 && argv[1][0] != '-' && std::find(names.begin(), names.end(), argv[1]) == names.end()) {
    const std::string nearest = Nearest(argv[1], names);
    Print(stderr, "gapscope: no command '{}'{}\n", argv[1], nearest.empty() ? "" : "; did you mean '" + nearest + "'?");
  }
  program.exit(error);
  return kBadInput;
}

Status WriteGiven(const AddedCommand& added) {
  for (const Given& given : added.given) {
    if (given.flag->count() == 0) continue;
    const Option& option = *given.option;
    GS_RETURN_IF_ERROR(option.Read(option.IsList() ? given.words : std::vector<std::string>{given.word}));
  }
  return Ok();
}

}  // namespace

Result<const Command*> ReadArguments(int argc, char** argv, const std::vector<Command>& commands, int* status) {
  CLI::App program{"gapscope finds why a simulated mechanism does not move like the real one.", "gapscope"};
  program.set_version_flag("--version", VersionText());
  program.require_subcommand(1);
  program.footer(
      "Exit status: 0 done, 1 a threshold asked for was not met, 2 bad input, 3 a bug.\nExample: gapscope replay "
      "models/qube/experiment.yaml log.csv");
  std::list<AddedCommand> added;
  for (const Command& command : commands) AddCommand(program, command, added);
  try {
    program.parse(argc, argv);
  } catch (const CLI::ParseError& error) {
    *status = Say(program, error, argc, argv);
    return nullptr;
  }
  for (const AddedCommand& one : added) {
    if (!one.app->parsed() || !one.command->run) continue;
    GS_RETURN_IF_ERROR(WriteGiven(one));
    return one.command;
  }
  throw std::logic_error("a command line without a command passed its check");
}

}  // namespace gapscope::cli
