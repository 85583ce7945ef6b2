#include "src/log/list_reader.h"
#include "tests/fuzz/log_way.h"

FUZZ_TARGET(lists) {
  using namespace gapscope;
  fuzz::TakeLog(ReadCsvLists("log.csv", fuzz::Text(data, size)), "log.csv:");
  return 0;
}
