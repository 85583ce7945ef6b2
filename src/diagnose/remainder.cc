#include "src/diagnose/remainder.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"

namespace gapscope {
namespace {

// Rows that two logs have in common when their commands and stamps are the same; 0: they are no repeats.
std::size_t CommonRows(const Recording& a, const Recording& b) {
  const std::size_t rows = std::min(a.rows(), b.rows());
  constexpr std::size_t kLeast = 100;
  if (rows < kLeast || 2 * rows < std::max(a.rows(), b.rows()) || a.commands.size() != b.commands.size()) return 0;
  if (a.measured.size() != b.measured.size()) return 0;
  const double half_step = 0.5 * a.timeline.median_step_s;
  for (std::size_t r = 0; r < rows; ++r) {
    if (std::abs((a.time_s[r] - a.time_s[0]) - (b.time_s[r] - b.time_s[0])) > half_step) return 0;
  }
  bool changes = false;
  for (std::size_t c = 0; c < a.commands.size(); ++c) {
    const auto &x = a.commands[c].values, &y = b.commands[c].values;
    const auto [low, high] = std::minmax_element(x.begin(), x.begin() + static_cast<std::ptrdiff_t>(rows));
    changes = changes || *high > *low;
    constexpr double kSame = 1e-3;  // of the range
    for (std::size_t r = 0; r < rows; ++r) {
      if (std::abs(x[r] - y[r]) > kSame * (*high - *low)) return 0;
    }
  }
  return changes ? rows : 0;
}

// Predictions of all logs, fitted and held out: those of one log where each side has its own windows of it.
void Gather(const std::vector<Recording>& recordings, std::vector<LogReplay> replays, std::vector<Recording>* logs,
            std::vector<LogReplay>* predicted) {
  for (std::size_t l = 0; l < std::min(recordings.size(), replays.size()); ++l) {
    const auto known = std::find_if(logs->begin(), logs->end(),
                                    [&](const Recording& r) { return r.log_path == recordings[l].log_path; });
    if (known == logs->end()) {
      logs->push_back(recordings[l]);
      predicted->push_back(std::move(replays[l]));
      continue;
    }
    auto& signals = (*predicted)[static_cast<std::size_t>(known - logs->begin())].signals;
    for (std::size_t s = 0; s < signals.size(); ++s) {
      for (std::size_t r = 0; r < signals[s].predicted.size(); ++r) {
        double& value = signals[s].predicted[r];
        if (!std::isfinite(value)) value = replays[l].signals[s].predicted[r];
      }
    }
  }
}

}  // namespace

double SquareBetweenRepeats(const std::vector<Recording>& recordings, const std::vector<LogReplay>& predicted) {
  double sum = 0, count = 0;
  for (std::size_t a = 0; a < recordings.size(); ++a) {
    for (std::size_t b = a + 1; b < recordings.size(); ++b) {
      const std::size_t rows = CommonRows(recordings[a], recordings[b]);
      for (std::size_t s = 0; rows > 0 && s < recordings[a].measured.size(); ++s) {
        const SignalTrace &x = predicted[a].signals[s], &y = predicted[b].signals[s];
        const double deviation = MomentsOf(recordings[a].measured[s].values).deviation;
        if (!x.scored || !(deviation > 0)) continue;
        double square = 0, seen = 0;
        for (std::size_t r = 0; r < rows; ++r) {
          const double apart = (x.predicted[r] - x.measured[r]) - (y.predicted[r] - y.measured[r]);
          if (std::isfinite(apart)) square += apart * apart, seen += 1;
        }
        if (seen > 0) sum += 0.5 * square / seen / (deviation * deviation), count += 1;
      }
    }
  }
  return count > 0 ? sum / count : kNaN;
}

Remainder Divide(const Workbench& bench, const Candidate& base, const Candidate& final,
                 const std::vector<LogReplay>& held_out, double floor, const BesideTorques& beside) {
  Remainder remainder;
  const double before = base.held_out_error * base.held_out_error;
  if (!(before > 0) || !std::isfinite(before)) return remainder;
  std::vector<Recording> logs;
  std::vector<LogReplay> predicted;
  Gather(bench.data->train, final.problem->Predict(final.point), &logs, &predicted);
  Gather(bench.data->held_out, held_out, &logs, &predicted);
  const double left = std::min(1.0, final.held_out_error * final.held_out_error / before);
  remainder.explained = 1 - left;
  remainder.sensors = std::min(left, floor * floor / before);
  const double between = SquareBetweenRepeats(logs, predicted);
  remainder.not_repeatable =
      std::isfinite(between) ? std::clamp((between - floor * floor) / before, 0.0, left - remainder.sensors) : kNaN;
  remainder.systematic = left - remainder.sensors - (std::isfinite(between) ? remainder.not_repeatable : 0);
  remainder.reachable = remainder.explained + left * beside.free_form;
  return remainder;
}

}  // namespace gapscope
