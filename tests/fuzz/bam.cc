#include "src/log/bam_reader.h"
#include "tests/fuzz/log_way.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapscope;
  fuzz::TakeLog(ReadBamJson("log.json", fuzz::Text(data, size)), "log.json:");
  return 0;
}
