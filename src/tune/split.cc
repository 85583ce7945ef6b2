#include "src/tune/split.h"

#include <algorithm>

namespace gapscope {
namespace {

constexpr double kSingleLogHeldOut = 0.3;

}  // namespace

Recording Slice(const Recording& recording, std::size_t begin, std::size_t end) {
  Recording part = recording;
  const auto cut = [&](std::vector<double>& values) {
    values = std::vector<double>(values.begin() + static_cast<std::ptrdiff_t>(begin),
                                 values.begin() + static_cast<std::ptrdiff_t>(end));
  };
  cut(part.time_s);
  const double shift = part.time_s.front();
  for (double& t : part.time_s) t -= shift;
  part.start_s += shift;
  for (auto& command : part.commands) cut(command.values);
  for (auto& measured : part.measured) cut(measured.values);
  return part;
}

DataSplit SplitData(std::vector<Recording> recordings, const std::vector<std::size_t>& held_out) {
  DataSplit split;
  std::vector<char> keep(recordings.size(), 0);
  for (const std::size_t index : held_out) keep[index] = 1;
  if (held_out.empty() && recordings.size() == 1) {
    const Recording& only = recordings.front();
    std::size_t row = 0;
    while (row < only.rows() && only.time_s[row] < (1 - kSingleLogHeldOut) * only.duration_s()) ++row;
    row = std::clamp<std::size_t>(row, 2, only.rows() - 2);
    split.train.push_back(Slice(only, 0, row));
    split.held_out.push_back(Slice(only, row, only.rows()));
    split.how = "the last 30 % of the only log's time";
    return split;
  }
  if (held_out.empty()) {
    for (std::size_t i = 1; i < recordings.size(); i += 3) keep[i] = 1;
  }
  split.asked = !held_out.empty();
  std::size_t count = 0;
  for (std::size_t i = 0; i < recordings.size(); ++i) {
    count += keep[i];
    (keep[i] ? split.held_out : split.train).push_back(std::move(recordings[i]));
  }
  split.how = held_out.empty() ? "every third log, from the second on (" + std::to_string(count) + " of " +
                                     std::to_string(recordings.size()) + ")"
                               : "as asked (" + std::to_string(count) + ")";
  return split;
}

}  // namespace gapscope
