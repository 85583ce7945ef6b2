#include "src/core/result.h"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>
#include <filesystem>

#include "src/core/file.h"
#include "src/core/units.h"

namespace gapscope {
namespace {

TEST(ErrorTest, TextNamesWhereWhatActualAllowedCure) {
  const Error error{.what = "bad", .where = "f.csv:3", .actual = "x", .allowed = "y", .cure = "write y"};
  EXPECT_EQ(error.Text(), "f.csv:3: bad: got x, allowed: y; write y");
}

TEST(ResultTest, ValueOfAnErrorThrows) {
  const Result<int> result = Error{.what = "no"};
  EXPECT_FALSE(result.ok());
  EXPECT_THROW((void)result.value(), std::logic_error);
}

TEST(UnitTest, KnownUnitsConvertToSi) {
  EXPECT_DOUBLE_EQ(ParseUnit("deg").value().factor * 180, M_PI);
  EXPECT_DOUBLE_EQ(ParseUnit("rpm").value().factor, 2 * M_PI / 60);
  EXPECT_DOUBLE_EQ(ParseUnit("counts/2048").value().factor, 2 * M_PI / 2048);
  EXPECT_EQ(ParseUnit("mA").value().si, "A");
}

TEST(UnitTest, UnknownUnitNamesTheNearest) {
  const auto unit = ParseUnit("degs");
  ASSERT_FALSE(unit.ok());
  EXPECT_NE(unit.error().Text().find("did you mean 'deg'"), std::string::npos) << unit.error().Text();
  EXPECT_FALSE(ParseUnit("counts/0").ok());
}

TEST(FileTest, WriteThenReadGivesTheBytesAndLeavesNoTemporary) {
  const std::filesystem::path folder = std::filesystem::temp_directory_path() / "gapscope_file_test";
  std::filesystem::remove_all(folder);
  const std::string bytes("a\0b\n", 4);
  ASSERT_TRUE(WriteFile(folder / "x" / "y.bin", bytes).ok());
  EXPECT_EQ(ReadFile(folder / "x" / "y.bin").value(), bytes);
  EXPECT_EQ(std::distance(std::filesystem::directory_iterator(folder / "x"), {}), 1);
  EXPECT_FALSE(ReadFile(folder).ok());
  EXPECT_FALSE(ReadFile(folder / "absent").ok());
  std::filesystem::remove_all(folder);
}

}  // namespace
}  // namespace gapscope
