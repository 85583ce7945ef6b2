#include "src/tune/each_log.h"

#include <fmt/format.h>

#include <filesystem>

namespace gapscope {

namespace {

// Of log number `index`, beside that of the fit of all: journal.bin, journal.log_0.bin.
std::string JournalOf(const std::string& joint, std::size_t index) {
  if (joint.empty()) return joint;
  const std::filesystem::path path = joint;
  return path.parent_path() / fmt::format("{}.log_{}{}", path.stem().string(), index, path.extension().string());
}

}  // namespace

LogFits FitEachLog(const Model& model, const std::vector<Recording>& logs, const TuneSummary& joint,
                   const TuneOptions& options, ThreadPool& pool) {
  TuneOptions alone = options;
  alone.free.clear();
  for (const TunedParameter& tuned : joint.tuned) {
    if (tuned.identifiable) alone.free.push_back(tuned.index);
  }
  if (alone.free.empty()) return {.warnings = {"no log is fitted alone: all of them together know no parameter"}};
  alone.if_known.clear();
  alone.starts = 1;
  alone.time_step_s = joint.time_step_s;
  LogFits fits;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    if (IsLate(alone.solve.deadline)) break;
    const Recording& log = logs[l];
    alone.journal = JournalOf(options.journal, l);
    auto fit = Tune(model, {.train = {log}}, joint.values, alone, pool);
    if (fit.ok()) {
      TuneSummary& found = fit.value();
      fits.logs.push_back({log.log_path, found.termination, std::move(found.tuned), std::move(found.spread)});
    } else {
      fits.warnings.push_back(log.log_path + " is not fitted alone: " + fit.error().Text());
    }
  }
  // The last fit was cut short.
  if (IsLate(alone.solve.deadline))
    return {.warnings = {"time was up before each log was fitted alone: the result is of all logs together"}};
  return fits;
}

void ForgetLogFits(const TuneOptions& options, std::size_t logs) {
  std::error_code ignored;  // what cannot be removed cannot be opened either, which is told
  for (std::size_t l = 0; l < logs; ++l) std::filesystem::remove(JournalOf(options.journal, l), ignored);
}

}  // namespace gapscope
