// What a page says of a result beyond the traces: words, and tables as they are shown. Made from the run by the
// program, so that the page's script only draws.
#ifndef GAPSCOPE_REPORT_PAGE_CONTENT_H_
#define GAPSCOPE_REPORT_PAGE_CONTENT_H_

#include <limits>
#include <optional>
#include <string>
#include <utility>
#include <vector>

#include "src/report/sentences.h"
#include "src/report/words.h"

namespace gapscope {

struct PageContent {
  struct Conditions {
    std::string title;  // empty: of the result as a whole
    std::vector<ConditionShare> shares;
  };
  struct Looked {
    std::string title, answer, why;
    std::string bound;  // that its size stays below; empty: none is known
    double probability = 0, prior = 0;
    std::optional<StatementNumbers> numbers;  // none: it was not refitted
  };
  struct Fitted {
    std::string name;  // of the model's parameter
    double value = 0;
    double low = 0, high = 0;  // interval
    bool at_bound = false, identifiable = true;
  };

  // Numbers of their own, drawn below the headline.
  struct Table {
    std::string title;
    std::vector<std::string> heads;
    std::vector<std::vector<std::string>> rows;  // a cell a head
    std::string note;                            // what the heads mean; may be empty
  };

  Headline headline;
  std::vector<Table> tables;
  std::string mapped;  // whose missing torque is mapped: "model", "nominal model", "retuned model", "diagnosed model"
  std::vector<Conditions> where;
  std::vector<Sentence> findings;  // what is present, the largest share of the gap first
  std::string gap;                 // how it went beyond what the headline says; may be empty
  std::vector<Part> remainder;     // of the misfit that retuning leaves
  double reachable = kNaN;         // by a free-form torque, of the same
  std::vector<Looked> statements;  // the most probable first
  std::vector<Fitted> fitted;
  std::vector<std::pair<std::string, double>> values;  // of the result's model; what is not fitted is shown with these
  std::string next_text, next_command;                 // the next experiment; empty: none
};
PageContent PageOf(const ReplayRun& run);
PageContent PageOf(const TuneRun& run);
PageContent PageOf(const DiagnoseRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_PAGE_CONTENT_H_
