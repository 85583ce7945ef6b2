#include <fmt/core.h>

#include <memory>

#include "src/cli/commands.h"
#include "src/cli/print.h"
#include "src/cli/session.h"
#include "src/report/version.h"

namespace gapscope::cli {
namespace {

// As in CITATION.cff, which a test compares.
constexpr const char* kTitle = "gapscope: why a simulated mechanism does not move like the real one";
constexpr const char* kAuthor = "The gapscope maintainers";

struct CiteFlags {
  bool bibtex = false;
};

int RunCite(const CiteFlags& flags) {
  if (flags.bibtex) {
    Print(stdout, "@software{{gapscope,\n  author = {{{{{}}}}},\n  title = {{{{{}}}}},\n  version = {{{}}}\n}}\n",
          kAuthor, kTitle, GapscopeVersion());
  } else {
    Print(stdout, "{}. {} (version {}) [Computer software].\n", kAuthor, kTitle, GapscopeVersion());
  }
  return kDone;
}

}  // namespace

Command CiteCommand() {
  auto flags = std::make_shared<CiteFlags>();
  return {.name = "cite",
          .what = "How to cite the program, with its version",
          .options = {{.flag = "--bibtex", .value = &flags->bibtex, .help = "As an entry of BibTeX"}},
          .example = "gapscope cite --bibtex",
          .run = [flags]() -> Result<int> { return RunCite(*flags); }};
}

}  // namespace gapscope::cli
