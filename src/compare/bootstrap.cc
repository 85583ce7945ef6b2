#include "src/compare/bootstrap.h"

#include <algorithm>
#include <random>

#include "src/core/result.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostCells = 2048;

}  // namespace

std::size_t RowsPerCell(std::size_t rows) { return std::max<std::size_t>(1, (rows + kMostCells - 1) / kMostCells); }
std::size_t CellCount(std::size_t rows) { return (rows + RowsPerCell(rows) - 1) / RowsPerCell(rows); }

std::vector<double> ResampleSums(const std::vector<std::vector<double>>& columns, std::size_t block, int replicates,
                                 std::uint64_t seed) {
  GS_CHECK(!columns.empty() && replicates >= 0);
  const std::size_t width = columns.size(), cells = columns.front().size();
  GS_CHECK(block >= 1 && block <= cells);

  // The sums of every block, by the cell it starts at, wrapping at the end: blocks[start * width + column].
  std::vector<double> blocks(cells * width);
  for (std::size_t c = 0; c < width; ++c) {
    GS_CHECK(columns[c].size() == cells);
    double sum = 0;
    for (std::size_t start = 0; start < cells; ++start) {
      if (start % block == 0) {  // summed anew now and then: no rounding builds up
        sum = 0;
        for (std::size_t i = 0; i < block; ++i) sum += columns[c][(start + i) % cells];
      } else {
        sum = std::max(0.0, sum - columns[c][start - 1] + columns[c][(start + block - 1) % cells]);
      }
      blocks[start * width + c] = sum;
    }
  }

  // The distribution is written out: the library's may differ between compilers.
  std::mt19937_64 random(seed);
  const std::size_t draws = (cells + block - 1) / block;
  std::vector<double> result(static_cast<std::size_t>(replicates) * width);
  for (int r = 0; r < replicates; ++r) {
    double* const sums = &result[static_cast<std::size_t>(r) * width];
    for (std::size_t d = 0; d < draws; ++d) {
      const double even = static_cast<double>(random() >> 11) * 0x1p-53;
      const double* const drawn = &blocks[static_cast<std::size_t>(even * static_cast<double>(cells)) * width];
      for (std::size_t c = 0; c < width; ++c) sums[c] += drawn[c];
    }
  }
  return result;
}

}  // namespace gapscope
