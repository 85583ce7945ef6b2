// Long traces thinned for drawing without losing what the eye looks for: of each stretch of rows the extremes stay, at
// their own times.
#ifndef GAPSCOPE_COMPARE_DECIMATE_H_
#define GAPSCOPE_COMPARE_DECIMATE_H_

#include <cstddef>
#include <span>
#include <vector>

namespace gapscope {

// Rows to keep, ascending, first and last among them: of each of `buckets` equal stretches the rows where a column is
// smallest and largest (of its finite values), and the first row that is not finite where a gap begins. All columns
// have the same size. With few rows, all of them: never more than max(rows that fit, buckets * (3 * columns.size()) +
// 2).
std::vector<std::size_t> ExtremeRows(std::span<const std::span<const double>> columns, std::size_t buckets);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_DECIMATE_H_
