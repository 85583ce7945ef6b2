// A file of --params.
#include "src/experiment/experiment.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(parameters) {
  using namespace gapscope;
  const std::string& path = fuzz::FileOf(fuzz::Text(data, size));
  const auto values = LoadParameterValues(path);
  if (!values.ok()) fuzz::CheckRefusal(values.error(), path + ":");
  fuzz::whole = values.ok();
  return 0;
}
