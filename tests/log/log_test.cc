#include "src/log/log.h"

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

TEST(LogTest, FormatIsFoundByContentAndName) {
  const TempFolder folder;
  const auto csv = ReadLog(folder.Write("a.csv", "t,x\n0,1\n"), {});
  ASSERT_TRUE(csv.ok());
  EXPECT_EQ(csv.value().format, "csv");
  const auto json = ReadLog(folder.Write("b.log", "\n {\"entries\": [{\"t\": 0}]}"), {});
  ASSERT_TRUE(json.ok());
  EXPECT_EQ(json.value().format, "bam_json");
  for (const LogReader& reader : LogReaders()) {
    const std::string other = std::string(reader.name) == "csv" ? "b.log" : "a.csv";
    EXPECT_FALSE(ReadLog(folder.Path(other), {.format = &reader, .companions = {}}).ok()) << reader.name;
  }
}

// A mapped file may end where its page does: nothing behind the last cell may be read.
TEST(LogTest, TheLastCellMayStandAtTheEndOfAPage) {
  const TempFolder folder;
  const auto page = static_cast<std::size_t>(getpagesize());
  const std::string number = "-1.2345678901234567", head = "t,x\n0,1\n";
  for (std::size_t length = 2; length <= number.size(); ++length) {
    const std::string cell = number.substr(0, length);
    for (const std::string& last : {"1," + cell, "1," + cell + "\n", "1," + cell + "\r\n", "1,\"" + cell + "\""}) {
      const std::string comment = "#" + std::string(page - head.size() - last.size() - 2, 'c') + "\n";
      const auto log = ReadLog(folder.Write("page.csv", head + comment + last), {});
      ASSERT_TRUE(log.ok()) << log.error().Text();
      EXPECT_EQ(log.value().columns[1].values, (std::vector<double>{1, std::stod(cell)})) << last;
    }
  }
}

TEST(LogTest, APipeIsReadToo) {
  int ends[2];
  ASSERT_EQ(pipe(ends), 0);
  const std::string text = "t,x\n0,1\n1,2\n";
  ASSERT_EQ(write(ends[1], text.data(), text.size()), static_cast<ssize_t>(text.size()));
  close(ends[1]);
  const auto log = ReadLog("/dev/fd/" + std::to_string(ends[0]), {});
  close(ends[0]);
  ASSERT_TRUE(log.ok()) << log.error().Text();
  EXPECT_EQ(log.value().columns[1].values, (std::vector<double>{1, 2}));
}

class CompanionTest : public testing::Test {
 protected:
  Result<Log> Read(const std::string& own, const std::string& other) {
    folder_.Write("data_desired_1.csv", other);
    return ReadLog(folder_.Write("data_measured_1.csv", own),
                   {.companions = {{"data_measured", "data_desired", "desired."}}});
  }
  TempFolder folder_;
};

TEST_F(CompanionTest, RowsArePaired) {
  const auto log = Read("time,x\n0,1\n1,2\n", "time,x\n0,3\n1.1,nan\n");
  ASSERT_TRUE(log.ok()) << log.error().Text();
  EXPECT_EQ(log.value().ColumnNames(), (std::vector<std::string>{"time", "x", "desired.time", "desired.x"}));
  EXPECT_EQ(log.value().columns[2].values, (std::vector<double>{0, 1.1}));
  EXPECT_TRUE(FindFinding(log.value().findings, "missing", "desired.x"));
}

TEST_F(CompanionTest, OneRowMoreIsCutOffAndReported) {
  for (const bool own_longer : {true, false}) {
    const std::string shorter = "time,x\n0,1\n1,2\n", longer = shorter + "2,3\n";
    const auto log = own_longer ? Read(longer, shorter) : Read(shorter, longer);
    ASSERT_TRUE(log.ok()) << log.error().Text();
    for (const auto& column : log.value().columns) EXPECT_EQ(column.values.size(), 2u);
    const Finding* finding = FindFinding(log.value().findings, "companion_rows");
    ASSERT_TRUE(finding);
    EXPECT_EQ(finding->count, 1u);
    EXPECT_EQ(finding->first_row, 2u);
  }
}

TEST_F(CompanionTest, UnequalRowsAreAnErrorWithBothCounts) {
  const auto log = Read("time,x\n0,1\n1,2\n2,3\n", "time,x\n0,1\n");
  ASSERT_FALSE(log.ok());
  EXPECT_NE(log.error().Text().find("3 rows here, 1 in"), std::string::npos) << log.error().Text();
}

TEST_F(CompanionTest, AbsentBrokenOrUnnameable) {
  const std::string path = folder_.Write("data_measured_2.csv", "time,x\n0,1\n1,2\n");
  const auto absent = ReadLog(path, {.companions = {{"data_measured", "data_desired", "desired."}}});
  ASSERT_FALSE(absent.ok());
  EXPECT_NE(absent.error().Text().find("data_desired_2.csv"), std::string::npos) << absent.error().Text();
  folder_.Write("data_desired_2.csv", "time,x\n0,1\n1,b\n");
  const auto broken = ReadLog(path, {.companions = {{"data_measured", "data_desired", "desired."}}});
  ASSERT_FALSE(broken.ok());
  EXPECT_NE(broken.error().Text().find("data_desired_2.csv:3, column x"), std::string::npos) << broken.error().Text();
  const auto unnameable = ReadLog(path, {.companions = {{"actual", "desired", "desired."}}});
  ASSERT_FALSE(unnameable.ok());
  EXPECT_NE(unnameable.error().Text().find("'actual'"), std::string::npos) << unnameable.error().Text();
}

}  // namespace
}  // namespace gapscope
