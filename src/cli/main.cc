// gapscope: finds why a simulated mechanism does not move like the real one.
#include <fmt/core.h>
#include <malloc.h>

#include <cstdio>
#include <exception>

#include "src/cli/arguments.h"
#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"

namespace gapscope::cli {
namespace {

int Refuse(const Error& error, bool json) {
  Print(stderr, "{}", json ? ErrorLine(error) : "gapscope: " + error.Text() + "\n");
  return kBadInput;
}

int Main(int argc, char** argv) {
  SetCommandLine(argc, argv);
  const bool json = AsksForJsonProgress(argc, argv);
  const std::vector<Command> commands = AllCommands();
  int status = kDone;
  const auto command = ReadArguments(argc, argv, commands, &status);
  if (!command.ok()) return Refuse(command.error(), json);
  if (!command.value()) return status;
  const auto done = command.value()->run();
  return done.ok() ? done.value() : Refuse(done.error(), json);
}

}  // namespace
}  // namespace gapscope::cli

int main(int argc, char** argv) {
  // What is larger goes back to the system when it is freed. By glibc's own rule it stays, with gaps between: a quarter
  // of what a robot of 29 joints takes.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  try {
    return gapscope::cli::Main(argc, argv);
  } catch (const std::exception& e) {
    gapscope::cli::Print(stderr, "gapscope: internal error: {}\nPlease report this with the command and the files.\n",
                         e.what());
    return gapscope::cli::kBug;
  }
}
