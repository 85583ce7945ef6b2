#include "src/compare/decimate.h"

#include <algorithm>
#include <cmath>
#include <numeric>

#include "src/core/result.h"

namespace gapscope {

std::vector<std::size_t> ExtremeRows(std::span<const std::span<const double>> columns, std::size_t buckets) {
  GS_CHECK(buckets > 0);
  const std::size_t rows = columns.empty() ? 0 : columns.front().size();
  for (const auto& column : columns) GS_CHECK(column.size() == rows);
  std::vector<std::size_t> kept;
  if (rows <= buckets * 2 * columns.size()) {
    kept.resize(rows);
    std::iota(kept.begin(), kept.end(), std::size_t{0});
    return kept;
  }
  std::vector<std::size_t> of_bucket;
  for (std::size_t b = 0; b < buckets; ++b) {
    const std::size_t begin = b * rows / buckets, end = (b + 1) * rows / buckets;
    of_bucket.clear();
    for (const auto& column : columns) {
      std::size_t low = end, high = end, gap = end;
      for (std::size_t r = begin; r < end; ++r) {
        if (!std::isfinite(column[r])) {
          if (gap == end && (r == 0 || std::isfinite(column[r - 1]))) gap = r;
          continue;
        }
        if (low == end || column[r] < column[low]) low = r;
        if (high == end || column[r] > column[high]) high = r;
      }
      for (const std::size_t row : {low, high, gap}) {
        if (row != end) of_bucket.push_back(row);
      }
    }
    if (b == 0) of_bucket.push_back(0);
    if (b + 1 == buckets) of_bucket.push_back(rows - 1);
    std::sort(of_bucket.begin(), of_bucket.end());
    of_bucket.erase(std::unique(of_bucket.begin(), of_bucket.end()), of_bucket.end());
    kept.insert(kept.end(), of_bucket.begin(), of_bucket.end());
  }
  return kept;
}

}  // namespace gapscope
