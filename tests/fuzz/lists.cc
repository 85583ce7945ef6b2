#include "src/log/list_reader.h"
#include "tests/fuzz/log_way.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapscope;
  fuzz::TakeLog(ReadCsvLists("log.csv", fuzz::Text(data, size)), "log.csv:");
  return 0;
}
