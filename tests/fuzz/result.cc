// A result of ours that is read back: for --params, --from, apply, export, explain, monitor and merge.
#include <nlohmann/json.hpp>

#include "src/cli/result_model.h"
#include "src/report/diagnose_report.h"
#include "src/report/read_diagnosis.h"
#include "src/report/read_run.h"
#include "src/report/unit_result.h"
#include "tests/fuzz/fuzz.h"

FUZZ_TARGET(result) {
  using namespace gapscope;
  const std::string& path = fuzz::FileOf(fuzz::Text(data, size));
  auto json = ReadJson(path);
  if (!json.ok()) {
    fuzz::CheckRefusal(json.error(), path);
    return 0;
  }
  // The corpus need not follow each version's policy.
  if (json.value().is_object() && json.value().contains("policy")) json.value()["policy"] = JsonPolicy();
  const auto model = ReadRunModel(json.value(), path);
  const auto tuned = ReadTuneRun(json.value(), path);
  const auto diagnosis = ReadDiagnosis(json.value(), path);
  const auto unit = ReadUnitResult(json.value(), path);
  for (const Error* error : {model.ok() ? nullptr : &model.error(), tuned.ok() ? nullptr : &tuned.error(),
                             diagnosis.ok() ? nullptr : &diagnosis.error(), unit.ok() ? nullptr : &unit.error()}) {
    if (error) fuzz::CheckRefusal(*error, path);
  }
  cli::JudgedBy(json.value());
  if (const auto parts = MergedParts(json.value(), path); parts.ok()) parts.value().dump();
  for (const char* word : {"1", "friction@arm"}) {
    if (!diagnosis.ok()) break;
    const auto found = FindStatement(diagnosis.value(), word, "STATEMENT");
    if (!found.ok()) fuzz::CheckRefusal(found.error(), "STATEMENT");
  }
  fuzz::whole = model.ok() && (tuned.ok() || (diagnosis.ok() && unit.ok()));
  return 0;
}
