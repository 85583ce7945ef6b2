// Broken CSV files: each is refused with file and line, what was found and a cure; none brings the program down.
#include <fmt/format.h>

#include <cstring>

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

using namespace std::string_literals;

struct BrokenCsv {
  const char* name;
  std::string bytes;
  const char* where;  // behind the path
  const char* says;   // part of the message
};

std::string Rows(int count, const std::string& row) {
  std::string all;
  for (int k = 0; k < count; ++k) all += row;
  return all;
}

std::string Utf16(const std::string& text, bool mark, bool little) {
  std::string bytes = mark ? (little ? "\xFF\xFE" : "\xFE\xFF") : "";
  for (const char c : text) {
    if (little) bytes += c;
    bytes += '\0';
    if (!little) bytes += c;
  }
  return bytes;
}

std::vector<BrokenCsv> Table() {
  const std::string head = "time_s,voltage_v\n";
  return {
      {"empty", "", ":1", "empty"},
      {"only blanks", " \n\t\r\n \n", ":1", "empty"},
      {"only a mark", "\xEF\xBB\xBF", ":1", "empty"},
      {"only comments", "# a\n# b\n", ":1", "comments only"},
      {"names only", head, ":1", "no rows"},
      {"names and units only", head + "s,V\n", ":1", "no rows"},
      {"names only, no newline", "time_s,voltage_v", ":1", "no rows"},
      {"no names", "0,1\n1,2\n2,3\n", ":1", "no line of column names"},
      {"no names, nan first", "nan,1\n1,2\n", ":1", "no line of column names"},
      {"no names, below a comment", "# made by hand\n0,1\n1,2\n", ":2", "no line of column names"},
      {"one column", "time_s\n0\n1\n", ":1", "only one column"},
      {"unknown separator", "time_s|voltage_v\n0|1\n1|2\n", ":1", "only one column"},
      {"too few fields", head + "0,1\n1\n2,3\n", ":3", "wrong number of fields"},
      {"too many fields", head + "0,1\n1,2,3\n2,3\n", ":3", "wrong number of fields"},
      {"two separators at the end", head + "0,1,,\n", ":2", "wrong number of fields"},
      {"cut in the last row", head + "0,1\n1,2\n2", ":4", "delete its last line"},
      {"decimal commas between commas", head + "0,0,1,5\n0,1,2,5\n", ":2", "decimal commas"},
      {"decimal commas and points", "t;x\n0,0;1,5\n0.1;2,5\n", ":3", "decimal points and decimal commas"},
      {"thousands separators", "t;x\n0;1.234,5\n1;2\n", ":2, column x", "not a number"},
      {"word", head + "0,1\n1,abc\n2,3\n", ":3, column voltage_v", "not a number"},
      {"word in the time", head + "zero,1\n1,2\n", ":2, column time_s", "not a number"},
      {"number with a tail", head + "0,1\n1,2V\n", ":3, column voltage_v", "'2V'"},
      {"two points", head + "0,1\n1,1.2.3\n", ":3, column voltage_v", "not a number"},
      {"lone sign", head + "0,1\n1,+\n", ":3, column voltage_v", "not a number"},
      {"exponent without digits", head + "0,1\n1,1e\n", ":3, column voltage_v", "not a number"},
      {"hexadecimal", head + "0,1\n1,0x1F\n", ":3, column voltage_v", "not a number"},
      {"Unicode minus",
       head + "0,1\n1,\xE2\x88\x92"
              "5\n",
       ":3, column voltage_v", "not a number"},
      {"invalid UTF-8 in a row", head + "0,1\n1,\xFF\xFE\x80\n", ":3, column voltage_v", "\\xff"},
      {"invalid UTF-8 in a name", "time_s,angle [\xB0]\n0,1\n1,2\n", ":1", "not UTF-8"},
      {"dates", "time,x\n2026-01-15 10:28:10.1,1\n2026-01-15 10:28:10.2,2\n", ":2, column time", "is this a date"},
      {"clock times", "time,x\n10:28:10.1,1\n10:28:10.2,2\n10:28:10.3,2\n10:28:10.4,2\n", ":2, column time",
       "is this a date"},
      {"overflow", head + "0,1\n1,1e999\n", ":3, column voltage_v", "too large"},
      {"negative overflow", head + "0,1\n1,-1e400\n", ":3, column voltage_v", "too large"},
      {"overflow of digits", head + "0,1\n1," + std::string(400, '9') + "\n", ":3, column voltage_v", "too large"},
      {"quote not closed", head + "0,1\n1,\"2\n2,3\n", ":3, column voltage_v", "quote"},
      {"quote not closed in the names", "time_s,\"voltage_v\n0,1\n", ":1", "quote"},
      {"text behind a quote", head + "0,1\n1,\"2\"x\n", ":3, column voltage_v", "quote"},
      {"quote not closed, 1 MB", head + "0,\"" + std::string(1 << 20, '7') + "\n", ":2", "line without end"},
      {"UTF-16 with a mark", Utf16(head + "0,1\n", true, true), ":1", "UTF-16"},
      {"UTF-16, big end first", Utf16(head + "0,1\n", true, false), ":1", "UTF-16"},
      {"UTF-16 without a mark", Utf16(head + "0,1\n", false, true), ":1", "UTF-16"},
      {"NUL within", head + "0,1\n1,\0\n"s, ":3:3", "NUL"},
      {"NULs at the end", head + "0,1\n" + std::string(4096, '\0'), ":3:1", "NUL"},
      {"control characters", head + "0,1\n1,\x01\x02\n", ":3:3", "control character"},
      {"gzip", "\x1f\x8b\x08\x00\x00"s, ":1", "gzip"},
      {"MAT file", "MATLAB 5.0 MAT-file, Platform: GLNXA64" + std::string(90, ' '), ":1", "MATLAB"},
      {"SQLite", "SQLite format 3\0"s, ":1", "SQLite"},
      {"endless line of names", std::string(3 << 20, 'a'), ":1", "line without end"},
      {"endless line of names in columns", Rows(600'000, "ab,"), ":1", "line without end"},
      {"too many columns", Rows(20'000, "a,") + "b\n1\n", ":1", "too many columns"},
      {"endless row", head + Rows(700'000, "1,") + "\n", ":2", "line without end"},
      {"endless row far below", head + Rows(60, "0,1\n") + Rows(1'000'000, "1,") + "\n", ":62",
       "wrong number of fields"},
      {"no time column", "voltage_v,position_rad\n0,1\n1,2\n", ":1", "no time column"},
      {"time all nan", head + "nan,1\nnan,2\n", ":2", "holds no number"},
      {"everything nan", head + "nan,nan\nnan,nan\n", ":2", "holds no number"},
      {"column all nan", head + "0,nan\n1,nan\n", ":1, column voltage_v", "without any value"},
      {"column all empty", head + "0,\n1,\n2,\n", ":1, column voltage_v", "without any value"},
      {"one row", head + "0,1\n", ":2, column time_s", "fewer than two rows"},
      {"stamps all equal", head + Rows(9, "1,2\n"), ":2, column time_s", "fewer than two rows"},
      {"stamps all going back", head + "3,1\n2,1\n1,1\n0,1\n", ":2, column time_s", "fewer than two rows"},
      {"stamps in volts", "time [V],x\n0,1\n1,2\n", ":1, column time", "not a unit of time"},
      {"stamps of 1e308", head + "-1e308,1\n1e308,2\n1.7e308,1\n", ":2, column time_s", "makes no sense"},
      {"stamps in the wrong unit", head + "0,1\n1000000,2\n2000000,1\n", ":2, column time_s", "makes no sense"},
      {"stamps far too close", "time_ns,x\n0,1\n1e-9,2\n2e-9,1\n", ":2, column time_ns", "makes no sense"},
      {"JSON cut to CSV", "{\"a\": 1", ":1", "JSON"},
      {"HTML", "<html><body>404, not found</body></html>\n", ":1", ""},
      {"mixed separators", "a;time;x\n0;1;2\n0,1,2\n", ":3", "not a number"},
      {"an entry with a date of NaN", "time_s,x\n,\n,\n", ":2", "holds no number"},
  };
}

TEST(CsvHostileTest, EachIsRefusedWithFileAndLine) {
  const TempFolder folder;
  const auto table = Table();
  EXPECT_GE(table.size(), 40u);
  for (const auto& broken : table) {
    const std::string path = folder.Write("broken.csv", broken.bytes);
    const auto error = FirstError(path);
    ASSERT_TRUE(error) << broken.name;
    const std::string text = error->Text();
    EXPECT_EQ(text.substr(0, path.size() + std::strlen(broken.where)), path + broken.where)
        << broken.name << ": " << text;
    EXPECT_NE(text.find(broken.says), std::string::npos) << broken.name << ": " << text;
    EXPECT_LT(text.size(), 1500u) << broken.name;
    EXPECT_EQ(text.find('\n'), std::string::npos) << broken.name;
    EXPECT_FALSE(error->cure.empty()) << broken.name << ": " << text;
  }
}

TEST(CsvHostileTest, AbsentFileAndFolder) {
  const TempFolder folder;
  const auto absent = FirstError(folder.Path("absent.csv"));
  ASSERT_TRUE(absent);
  EXPECT_NE(absent->Text().find("absent.csv"), std::string::npos);
  const auto is_folder = FirstError(folder.Path(""));
  ASSERT_TRUE(is_folder);
  EXPECT_NE(is_folder->Text().find("a folder"), std::string::npos);
}

TEST(CsvHostileTest, UnitsOfTheCallerAreChecked) {
  const TempFolder folder;
  const auto log = ReadLog(folder.Write("log.csv", "clk,x\n0,1\n1,2\n"), {});
  ASSERT_TRUE(log.ok());
  const auto bad = BuildTimeline(log.value(), {.time_column = "clk", .time_unit = "furlong"});
  ASSERT_FALSE(bad.ok());
  EXPECT_NE(bad.error().Text().find("log.csv:1, column clk: 'furlong' is not a unit of time"), std::string::npos)
      << bad.error().Text();
  const auto absent = BuildTimeline(log.value(), {.time_column = "clok"});
  ASSERT_FALSE(absent.ok());
  EXPECT_NE(absent.error().Text().find("did you mean 'clk'?"), std::string::npos) << absent.error().Text();
}

}  // namespace
}  // namespace gapscope
