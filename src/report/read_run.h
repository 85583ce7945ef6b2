// Readers of our own results: a result.json, whoever wrote it, becomes the value it was written from (a diagnosis:
// read_diagnosis.h).
#ifndef GAPSCOPE_REPORT_READ_RUN_H_
#define GAPSCOPE_REPORT_READ_RUN_H_

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "src/report/run.h"
#include "src/report/tune_report.h"

namespace gapscope {

// `path`: the file, or the folder that a command wrote with --out. Errors: unreadable, not JSON, nested deeper than
// 64.
Result<nlohmann::ordered_json> ReadJson(const std::string& path);

// `json`: a result of replay, tune or diagnose; `where` it comes from, for errors. Error: it has no such model.
Result<RunModel> ReadRunModel(const nlohmann::ordered_json& json, const std::string& where);

// The same of a file or folder. Errors: as ReadJson.
Result<RunModel> LoadRunModel(const std::string& path);

// `json`: gapscope.tune/1, with or without times (then NaN). Error: it is something else, or lacks a part.
Result<TuneRun> ReadTuneRun(const nlohmann::ordered_json& json, const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_READ_RUN_H_
