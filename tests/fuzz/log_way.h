// The whole way of a log: reading, timeline, columns, inspect. What was refused must say where; what was read must hold
// together.
#ifndef GAPSCOPE_TESTS_FUZZ_LOG_WAY_H_
#define GAPSCOPE_TESTS_FUZZ_LOG_WAY_H_

#include <utility>
#include <vector>

#include "src/log/inspect.h"
#include "src/log/log.h"
#include "src/log/timeline.h"
#include "tests/fuzz/fuzz.h"

namespace gapscope::fuzz {

// `where`: how the place of every refusal begins; "log.csv:" for formats with lines.
inline void TakeLog(const Result<Log>& read, std::string_view where) {
  if (!read.ok()) return CheckRefusal(read.error(), where);
  const Log& log = read.value();
  for (const auto& column : log.columns) {
    if (column.values.size() != log.rows()) Complain("columns of different lengths");
  }
  const Result<Timeline> timeline = BuildTimeline(log, {});
  if (!timeline.ok()) return CheckRefusal(timeline.error(), where);
  const std::vector<double>& time_s = timeline.value().time_s;
  for (std::size_t k = 1; k < time_s.size(); ++k) {
    if (!(time_s[k] > time_s[k - 1])) Complain("a timeline that does not grow");
  }
  std::vector<InspectChannel> channels;
  std::vector<Finding> findings = log.findings;
  for (const auto& column : log.columns) {
    auto values =
        ExtractColumn(log, timeline.value(), column, {.wrap = WrapRepair::kUnwrap, .wrap_period = 6.28}, &findings);
    if (!values.ok()) {
      CheckRefusal(values.error(), where);
      continue;
    }
    const ChannelRole role = channels.size() % 2 ? ChannelRole::kMeasured : ChannelRole::kCommand;
    channels.push_back({column.name, "rad", role, std::move(values).value()});
    if (channels.size() == 3) break;
  }
  const InspectReport report = Inspect(timeline.value(), channels, findings, log.rows());
  if (!report.fit && report.unfit_because.empty()) Complain("unfit without a reason");
  whole = true;
}

}  // namespace gapscope::fuzz

#endif  // GAPSCOPE_TESTS_FUZZ_LOG_WAY_H_
