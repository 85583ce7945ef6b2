#include "src/log/csv_reader.h"
#include "tests/fuzz/log_way.h"

extern "C" int LLVMFuzzerTestOneInput(const std::uint8_t* data, std::size_t size) {
  using namespace gapscope;
  fuzz::TakeLog(ReadCsv("log.csv", fuzz::Text(data, size)), "log.csv:");
  return 0;
}
