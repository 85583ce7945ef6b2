// Private to src/compare: intervals of shares by a circular block bootstrap.
#ifndef GAPSCOPE_COMPARE_BOOTSTRAP_H_
#define GAPSCOPE_COMPARE_BOOTSTRAP_H_

#include <cstddef>
#include <cstdint>
#include <vector>

namespace gapscope {

// Rows are gathered in cells of equal length, at most 2048 (the last one may be shorter), so that a log of a million
// rows costs no more than one of two thousand.
std::size_t RowsPerCell(std::size_t rows);
std::size_t CellCount(std::size_t rows);

// columns[c][cell] >= 0, columns of equal length: what each cell adds to sum c. Returns `replicates` rows of
// columns.size() numbers: each the sums of ceil(cells / block) blocks of `block` neighbouring cells, drawn evenly with
// replacement, the end of the log being followed by its start. 1 <= block <= cells.
std::vector<double> ResampleSums(const std::vector<std::vector<double>>& columns, std::size_t block, int replicates,
                                 std::uint64_t seed);

}  // namespace gapscope

#endif  // GAPSCOPE_COMPARE_BOOTSTRAP_H_
