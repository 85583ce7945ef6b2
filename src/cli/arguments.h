// A command line read by tables of commands.
#ifndef GAPSCOPE_CLI_ARGUMENTS_H_
#define GAPSCOPE_CLI_ARGUMENTS_H_

#include <vector>

#include "src/cli/commands.h"

namespace gapscope::cli {

// Writes the words into the options of the command that is named and returns it; it lives in `commands`. nullptr: all
// is said already (--help, --version; or, on stderr, what is wrong with the words) and `status` is the exit status.
// Errors: a value that its option cannot have.
Result<const Command*> ReadArguments(int argc, char** argv, const std::vector<Command>& commands, int* status);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_ARGUMENTS_H_
