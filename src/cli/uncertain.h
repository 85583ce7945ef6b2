// What a result of tune leaves open about its parameters, for domain randomisation.
#ifndef GAPSCOPE_CLI_UNCERTAIN_H_
#define GAPSCOPE_CLI_UNCERTAIN_H_

#include <nlohmann/json_fwd.hpp>
#include <optional>
#include <string>
#include <vector>

#include "src/export/randomize.h"
#include "src/model/model.h"

namespace gapscope::cli {

struct Uncertain {
  UncertainParameters parameters;
  std::vector<double> values;  // of all of the model's parameters: the centre of the draws
  std::size_t logs = 0;        // whose fits differ so; 0: one fit's own covariance
  // Parameters that all logs together know, and some log alone does not: they stay as they are.
  std::vector<std::string> not_of_each;
  // Parameters in which the fits to each log differ no more than each leaves open: they stay at the fits' mean.
  std::vector<std::string> alike;
};

// From this many fits to a log alone on their mean and covariance are taken. Fewer say little of how logs differ.
inline constexpr std::size_t kEnoughLogs = 4;

// `json`: a result of tune, of this model; `where` it comes from; `values`: its own. `from`: what was asked for; else
// the logs, where there are enough of them, and the covariance. Errors: another result, or one of an earlier version;
// it has no fits to each log; the logs know no parameter.
Result<Uncertain> UncertainOf(const Model& model, const std::vector<double>& values, const nlohmann::ordered_json& json,
                              const std::string& where, std::optional<DrawsFrom> from);

}  // namespace gapscope::cli

#endif  // GAPSCOPE_CLI_UNCERTAIN_H_
