#include "src/log/npz_reader.h"
#include "tests/fuzz/log_way.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapscope;
  fuzz::TakeLog(ReadNpz("log.npz", fuzz::Text(data, size)), "log.npz");
  return 0;
}
