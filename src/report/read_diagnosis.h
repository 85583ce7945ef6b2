// What an earlier diagnosis said, for those who go on from it.
#ifndef GAPSCOPE_REPORT_READ_DIAGNOSIS_H_
#define GAPSCOPE_REPORT_READ_DIAGNOSIS_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <vector>

#include "src/diagnose/diagnosis.h"

namespace gapscope {

struct EarlierDiagnosis {
  std::vector<std::string> train_logs, held_out_logs;
  std::string while_column;           // rows were used until it fell to zero; empty: all
  RunModel model;                     // the final one, which names the experiment
  std::vector<Statement> statements;  // in the result's order; sizes without their units
};

// `json`: gapscope.diagnosis/1 of this version of the program: others weigh evidence differently. `where` it comes
// from, for errors.
Result<EarlierDiagnosis> ReadDiagnosis(const nlohmann::ordered_json& json, const std::string& where);

// The statement that a word names: its number, from 1 on, or EFFECT@PLACE. Error: there is none.
Result<std::size_t> FindStatement(const EarlierDiagnosis& diagnosis, const std::string& word, const std::string& where);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_READ_DIAGNOSIS_H_
