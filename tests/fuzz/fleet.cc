// A fleet's file. Its patterns are looked for in /proc/self/fd, where the file itself is a log.
#include "src/cli/fleet_file.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(fleet) {
  using namespace gapscope;
  const std::string_view text = fuzz::Text(data, size);
  // Not the whole disk.
  if (text.find("..") != text.npos || text.find("/") != text.npos) return 0;
  const std::string& path = fuzz::FileOf(text);
  const auto plan = cli::LoadFleet(path);
  fuzz::whole = plan.ok();
  return 0;
}
