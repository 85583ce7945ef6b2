// What a page says of a result beyond the traces: words, and tables as they are shown. Made from the run by the
// program, so that the page's script only draws.
#ifndef GAPSCOPE_REPORT_PAGE_CONTENT_H_
#define GAPSCOPE_REPORT_PAGE_CONTENT_H_

#include <limits>
#include <string>
#include <utility>
#include <vector>

#include "src/report/words.h"

namespace gapscope {

struct PageContent {
  struct Conditions {
    std::string title;  // empty: of the result as a whole
    std::vector<ConditionShare> shares;
  };
  struct Candidate {
    std::string title, reason;
    double probability = 0;
    double held_out_error = 0;  // NaN: not refitted
  };
  struct Fitted {
    std::string name;  // of the model's parameter
    double value = 0;
    double low = 0, high = 0;  // interval
    bool at_bound = false, identifiable = true;
  };

  Headline headline;
  std::string mapped;  // whose missing torque is mapped: "model", "nominal model"
  std::vector<Conditions> where;
  std::vector<Candidate> candidates;  // the most probable first, as many as are shown
  std::size_t more_candidates = 0;    // that are not
  std::vector<Fitted> fitted;
  std::vector<std::pair<std::string, double>> values;  // of the result's model; what is not fitted is shown with these
  std::string next_text, next_command;                 // the next experiment; empty: none
};
PageContent PageOf(const ReplayRun& run);
PageContent PageOf(const TuneRun& run);
PageContent PageOf(const DiagnoseRun& run);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_PAGE_CONTENT_H_
