// Since when is a series of estimates another one? The place where its mean steps the most, judged by Student's t.
#ifndef GAPSCOPE_CORE_CHANGE_POINT_H_
#define GAPSCOPE_CORE_CHANGE_POINT_H_

#include <cstddef>
#include <span>
#include <vector>

namespace gapscope {

// `error`: standard error that the estimate states of itself; 0: it states none.
struct SeriesValue {
  double value = 0, error = 0;
};

struct ChangePoint {
  std::size_t first = 0;         // of the series: the first estimate after the change
  double before = 0, after = 0;  // weighted means up to it and from it on, of the part of the series that is split
  double chance = 0;             // that a stable series shows such a step somewhere: at most this
};

// Shorter series have no change, and no part of one is shorter than that.
inline constexpr std::size_t kLeastSeries = 6, kLeastPart = 2;

// The variance is what the estimates of one part differ by among themselves, those that state small errors weighing
// more: a series that varies by more than its intervals say is not called changed, and one whose intervals are too wide
// is, down to a fifth of them. Looked for are a step, and a stretch that goes there and back; the chance of the largest
// counts each place that it could be at (Bonferroni). Where there is a change, its parts are searched again. A stable
// series of independent normal errors is called changed with a probability of at most `chance`. In order.
std::vector<ChangePoint> FindChanges(std::span<const SeriesValue> series, double chance);

// The step between the estimates before `first` and those from there on, at least one on each side, its chance that of
// this place alone. Of two estimates the variance is what they state, and they must state one.
ChangePoint StepAt(std::span<const SeriesValue> series, std::size_t first);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_CHANGE_POINT_H_
