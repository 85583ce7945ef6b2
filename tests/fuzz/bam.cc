#include "src/log/bam_reader.h"
#include "tests/fuzz/log_way.h"

FUZZ_TARGET(bam) {
  using namespace gapscope;
  fuzz::TakeLog(ReadBamJson("log.json", fuzz::Text(data, size)), "log.json:");
  return 0;
}
