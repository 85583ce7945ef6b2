// A log that was written is read as it was.
#include "src/log/npz_writer.h"

#include <cstring>
#include <limits>

#include "src/core/statistics.h"
#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

Log Example() {
  Log log;
  log.columns = {{.name = "t", .unit = "ms", .values = {0, 1, 2.5}},
                 {.name = "/arm/q é", .unit = "", .values = {-0.0, kNaN, 1e-308}, .clock = "header"}};
  log.time_column = "t";
  log.header["kp"] = 0.1;
  log.header_text["rig"] = "a \"b\"";
  log.findings = {{.kind = "missing", .column = "/arm/q é", .count = 1, .text = "counted again"},
                  {.kind = "converted", .column = "t", .count = 7, .text = "two clocks"}};
  return log;
}

Log WrittenAndRead(const Log& log) {
  const TempFolder folder;
  const std::string path = folder.Path("new/table.npz");
  const Status written = WriteNpz(path, log);
  EXPECT_TRUE(written.ok()) << written.error().Text();
  auto read = ReadLog(path, {});
  EXPECT_TRUE(read.ok()) << read.error().Text();
  return read.ok() ? std::move(read).value() : Log{};
}

TEST(NpzWriterTest, EqualsTheLogToTheLastBit) {
  const Log log = Example(), read = WrittenAndRead(log);
  ASSERT_EQ(read.ColumnNames(), log.ColumnNames());
  for (std::size_t c = 0; c < log.columns.size(); ++c) {
    const Column &before = log.columns[c], &after = read.columns[c];
    EXPECT_EQ(after.unit, before.unit);
    EXPECT_EQ(after.clock, before.clock);
    ASSERT_EQ(after.values.size(), before.values.size());
    for (std::size_t row = 0; row < before.values.size(); ++row) {
      if (std::isnan(before.values[row])) {
        EXPECT_TRUE(std::isnan(after.values[row]));
      } else {
        EXPECT_EQ(std::memcmp(&after.values[row], &before.values[row], sizeof(double)), 0) << c << ", " << row;
      }
    }
  }
  EXPECT_EQ(read.time_column, "t");
  EXPECT_EQ(read.header, log.header);
  EXPECT_EQ(read.header_text, log.header_text);
  EXPECT_FALSE(read.joined);
  ASSERT_EQ(read.findings.size(), 2u);
  EXPECT_EQ(FindFinding(read.findings, "missing")->count, 1u);
  EXPECT_EQ(FindFinding(read.findings, "converted", "t")->count, 7u);
}

// NaN is no loss where another rate has a row.
TEST(NpzWriterTest, OfSeveralRatesNothingIsMissing) {
  Log log = Example();
  log.joined = true;
  const Log read = WrittenAndRead(log);
  EXPECT_TRUE(read.joined);
  EXPECT_EQ(FindFinding(read.findings, "missing"), nullptr);
}

}  // namespace
}  // namespace gapscope
