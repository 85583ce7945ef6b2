#include "src/log/csv_reader.h"
#include "tests/fuzz/log_way.h"

FUZZ_TARGET(csv) {
  using namespace gapscope;
  fuzz::TakeLog(ReadCsv("log.csv", fuzz::Text(data, size)), "log.csv:");
  return 0;
}
