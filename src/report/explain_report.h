// Why one statement of a diagnosis says what it says: for people and programs (gapscope.explain/1).
#ifndef GAPSCOPE_REPORT_EXPLAIN_REPORT_H_
#define GAPSCOPE_REPORT_EXPLAIN_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>

#include "src/report/page_content.h"
#include "src/report/run.h"

namespace gapscope {

struct ExplainRun {
  RunInfo info;
  std::string diagnosis;   // the folder or file that it was read from
  std::size_t number = 0;  // of the statement, from 1 on
  Statement statement;
};

nlohmann::ordered_json ToJson(const ExplainRun& run);
std::string ToText(const ExplainRun& run);
PageContent PageOf(const ExplainRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_EXPLAIN_REPORT_H_
