// Reports to look at: a replay of the demo log, a long log, a statement explained, and diagnoses made up to have
// everything a diagnosis can have, one for each verdict.
#ifndef GAPSCOPE_TESTS_REPORT_PAGES_H_
#define GAPSCOPE_TESTS_REPORT_PAGES_H_

#include <memory>
#include <nlohmann/json.hpp>
#include <string>
#include <vector>

#include "src/model/model.h"
#include "src/report/diagnose_report.h"
#include "src/report/html_report.h"

namespace gapscope::testing {

// A result, what its page shows beside it, and what that points to.
struct Page {
  nlohmann::ordered_json result;
  std::shared_ptr<const Model> model;
  std::vector<Recording> recordings;
  ReportSource source;
  std::string table;  // of a replay with many joints: what the console shows
};

// Two effects and a group, of which the verdict says what it would. A reason would break a page that takes text for
// HTML.
DiagnoseRun MadeDiagnosis(Verdict verdict);

// The log demo/qube.csv replayed by the nominal model.
std::unique_ptr<Page> ReplayPage();
// The same, and replayed by a model with a cable spring, under MadeDiagnosis.
std::unique_ptr<Page> DiagnosisPage(Verdict verdict);
// Why the first of those effects is believed.
std::unique_ptr<Page> ExplanationPage();
// `joints` joints, each with its command and its signal, "joint_07", of `rows` rows made up: the error of joint k over
// its spread grows with k.
std::unique_ptr<Page> ManyPage(int joints, int rows);
// One signal of `rows` rows with a spike of one row at `spike`.
std::unique_ptr<Page> LongPage(std::size_t rows, std::size_t spike);

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_REPORT_PAGES_H_
