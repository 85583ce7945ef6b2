#include "src/compare/decimate.h"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

namespace gapscope {
namespace {

TEST(ExtremeRowsTest, KeepsFewRowsAsTheyAre) {
  const std::vector<double> values = {3, 1, 2};
  const std::span<const double> columns[] = {values};
  EXPECT_EQ(ExtremeRows(columns, 10), (std::vector<std::size_t>{0, 1, 2}));
}

TEST(ExtremeRowsTest, KeepsEverySpikeOfEveryColumn) {
  constexpr std::size_t kRows = 1000000;
  std::vector<double> a(kRows), b(kRows);
  for (std::size_t r = 0; r < kRows; ++r) a[r] = std::sin(1e-4 * static_cast<double>(r)), b[r] = 0;
  a[123456] = 7;
  b[654321] = -9;
  const std::span<const double> columns[] = {a, b};
  const auto rows = ExtremeRows(columns, 2000);
  EXPECT_LE(rows.size(), 2000u * 4 + 2);
  EXPECT_TRUE(std::is_sorted(rows.begin(), rows.end()));
  EXPECT_EQ(std::adjacent_find(rows.begin(), rows.end()), rows.end());
  EXPECT_EQ(rows.front(), 0u);
  EXPECT_EQ(rows.back(), kRows - 1);
  for (const std::size_t spike : {123456u, 654321u})
    EXPECT_TRUE(std::binary_search(rows.begin(), rows.end(), spike)) << spike;
}

TEST(ExtremeRowsTest, ShowsWhereAGapBegins) {
  std::vector<double> a(10000, 1.0);
  for (std::size_t r = 4000; r < 6000; ++r) a[r] = NAN;
  const std::span<const double> columns[] = {a};
  const auto rows = ExtremeRows(columns, 100);
  EXPECT_TRUE(std::binary_search(rows.begin(), rows.end(), 4000u));
  EXPECT_LE(rows.size(), 302u);
}

}  // namespace
}  // namespace gapscope
