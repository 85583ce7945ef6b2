// A diagnosis for people and programs: console page, JSON (gapscope.diagnosis/1).
#ifndef GAPSCOPE_REPORT_DIAGNOSE_REPORT_H_
#define GAPSCOPE_REPORT_DIAGNOSE_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "src/diagnose/diagnosis.h"
#include "src/report/json.h"
#include "src/report/run.h"

namespace gapscope {

struct DiagnoseRun {
  RunInfo info;
  Diagnosis diagnosis;
};

inline constexpr const char* kDiagnosisSchema = "gapscope.diagnosis/1";

// Every threshold, so that a result says by which rules it was made.
nlohmann::ordered_json JsonPolicy();
nlohmann::ordered_json JsonBlocks(const std::vector<BlockGain>& blocks);
nlohmann::ordered_json JsonRivals(const std::vector<Rival>& rivals);

nlohmann::ordered_json ToJson(const DiagnoseRun& run, Timing timing = Timing::kInclude);
std::string ToTable(const DiagnoseRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_DIAGNOSE_REPORT_H_
