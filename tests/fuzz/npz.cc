#include "src/log/npz_reader.h"
#include "tests/fuzz/log_way.h"

FUZZ_TARGET(npz) {
  using namespace gapscope;
  fuzz::TakeLog(ReadNpz("log.npz", fuzz::Text(data, size)), "log.npz");
  return 0;
}
