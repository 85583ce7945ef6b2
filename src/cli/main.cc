// gapscope: finds why a simulated mechanism does not move like the real one.
#include <fmt/core.h>
#include <malloc.h>

#include <cerrno>
#include <csignal>
#include <cstdio>
#include <cstring>
#include <exception>

#include "src/cli/arguments.h"
#include "src/cli/html.h"
#include "src/cli/print.h"
#include "src/cli/progress.h"
#include "src/cli/session.h"
#include "src/core/apart.h"
#include "src/core/file.h"

namespace gapscope::cli {
namespace {

int Refuse(const Error& error, bool json) {
  Print(stderr, "{}", json ? ErrorLine(error) : "gapscope: " + error.Text() + "\n");
  return kBadInput;
}

// What was printed may wait for room that a full disk behind it does not have.
int Printed(int status, bool json) {
  const bool flushed = std::fflush(stdout) == 0;
  if (flushed && std::ferror(stdout) == 0) return status;
  return Refuse({.what = "cannot write all that was to be printed",
                 .where = "standard output",
                 .actual = flushed ? "an earlier part is lost" : std::strerror(errno),
                 .cure = "make room, and run it again; what --out names is written all the same"},
                json);
}

int Main(int argc, char** argv) {
  SetCommandLine(argc, argv);
  const bool json = AsksForJsonProgress(argc, argv);
  const std::vector<Command> commands = AllCommands();
  int status = kDone;
  const auto command = ReadArguments(argc, argv, commands, &status);
  if (!command.ok()) return Refuse(command.error(), json);
  if (!command.value()) return Printed(status, json);
  const auto run = [&] {
    const auto done = command.value()->run();
    return done.ok() ? Printed(done.value(), json) : Refuse(done.error(), json);
  };
  const auto& leave_out = command.value()->leave_out_plugins;
  if (!leave_out || !leave_out("")) return run();
  const ApartEnd end = RunApart(run);
  if (end.crash.empty()) return end.status;
  leave_out(end.crash);
  Print(stderr, "warning: the run crashed ({}); it is made again without the candidates that are plugins\n", end.crash);
  return run();
}

}  // namespace
}  // namespace gapscope::cli

int main(int argc, char** argv) {
  // What is larger goes back to the system when it is freed. By glibc's own rule it stays, with gaps between: a quarter
  // of what a robot of 29 joints takes.
  mallopt(M_MMAP_THRESHOLD, 1 << 20);
  gapscope::EndWhereMappedFileIsCut();
  std::signal(SIGXFSZ, SIG_IGN);  // a file beyond the size that is allowed is an error, as on a full disk
  try {
    return gapscope::cli::Main(argc, argv);
  } catch (const std::exception& e) {
    gapscope::cli::Print(stderr, "gapscope: internal error: {}\nPlease report this with the command and the files.\n",
                         e.what());
    return gapscope::cli::kBug;
  }
}
