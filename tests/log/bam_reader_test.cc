#include "src/log/bam_reader.h"

#include <fmt/format.h>

#include <charconv>
#include <cstring>
#include <random>

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

Log ReadBam(const std::string& bytes) {
  const Result<Log> log = ReadBamJson("log.json", bytes);
  EXPECT_TRUE(log.ok()) << (log.ok() ? "" : log.error().Text()) << "\n" << bytes;
  return log.ok() ? log.value() : Log{};
}

TEST(BamReaderTest, ReadsHeaderAndEntries) {
  const Log log = ReadBam(R"({"mass": 0.49, "kp": 100, "motor": "xl330", "spare": true, "entries": [
    {"timestamp": 0.0035, "position": -0.5, "load": 65527, "torque_enable": true},
    {"timestamp": 0.0087, "position": 1e-3, "load": 0, "torque_enable": false}]})");
  EXPECT_EQ(log.header, (std::map<std::string, double>{{"kp", 100}, {"mass", 0.49}, {"spare", 1}}));
  EXPECT_EQ(log.header_text, (std::map<std::string, std::string>{{"motor", "xl330"}}));
  EXPECT_EQ(log.ColumnNames(), (std::vector<std::string>{"timestamp", "position", "load", "torque_enable"}));
  EXPECT_EQ(log.columns[1].values, (std::vector<double>{-0.5, 1e-3}));
  EXPECT_EQ(log.columns[2].values, (std::vector<double>{65527, 0}));
  EXPECT_EQ(log.columns[3].values, (std::vector<double>{1, 0}));
  EXPECT_EQ(log.Where(0), "log.json:2");
  EXPECT_EQ(log.Where(1), "log.json:3");
  EXPECT_TRUE(log.findings.empty());
}

TEST(BamReaderTest, EntriesMayComeBeforeTheHeader) {
  const Log log = ReadBam(R"({"entries": [{"t": 0, "x": 1}], "kp": 3})");
  EXPECT_EQ(log.header.at("kp"), 3);
  EXPECT_EQ(log.rows(), 1u);
}

TEST(BamReaderTest, MissingKeysAndNullsAreMissingValues) {
  const Log log = ReadBam(R"({"entries": [{"t": 0, "x": 1}, {"t": 1}, {"x": null, "t": 2, "late": 5}]})");
  ASSERT_EQ(log.rows(), 3u);
  EXPECT_EQ(log.Find("t")->values, (std::vector<double>{0, 1, 2}));
  EXPECT_TRUE(std::isnan(log.Find("x")->values[1]));
  EXPECT_TRUE(std::isnan(log.Find("x")->values[2]));
  EXPECT_TRUE(std::isnan(log.Find("late")->values[0]));
  EXPECT_EQ(log.Find("late")->values[2], 5);
  ASSERT_TRUE(FindFinding(log.findings, "missing", "x"));
  EXPECT_EQ(FindFinding(log.findings, "missing", "x")->count, 2u);
  EXPECT_EQ(FindFinding(log.findings, "missing", "x")->first_row, 1u);
  EXPECT_EQ(FindFinding(log.findings, "missing", "late")->count, 2u);
}

TEST(BamReaderTest, PythonsNaNIsMissing) {
  const Log log = ReadBam(
      R"({"note": "NaN \" Infinity", "entries": [{"t": 0, "x": NaN},
      {"t":1, "x":-Infinity}, {"t":2, "x":Infinity}, {"t":3, "x":-3}]})");
  EXPECT_EQ(log.header_text.at("note"), "NaN \" Infinity");
  EXPECT_EQ(FindFinding(log.findings, "missing", "x")->count, 3u);
  EXPECT_EQ(FindFinding(log.findings, "infinite")->count, 2u);
  EXPECT_EQ(log.Find("x")->values[3], -3);
}

TEST(BamReaderTest, PlacesStayRightBehindNaN) {
  const auto log = ReadBamJson("log.json", "{\"entries\": [\n{\"t\": NaN, \"x\": NaN, \"y\": \"a\"}]}");
  ASSERT_FALSE(log.ok());
  EXPECT_EQ(log.error().where, "log.json:2:29") << log.error().Text();
}

TEST(BamReaderTest, NestedHeaderIsReportedAndIgnored) {
  const Log log =
      ReadBam(R"({"gains": {"p": [1, 2, {"deep": true}]}, "list": [[]], "kp": 2, "entries": [{"t": 0, "x": 1}]})");
  EXPECT_EQ(log.header, (std::map<std::string, double>{{"kp", 2}}));
  EXPECT_TRUE(FindFinding(log.findings, "ignored_header", "gains"));
  EXPECT_TRUE(FindFinding(log.findings, "ignored_header", "list"));
}

TEST(BamReaderTest, ByteOrderMark) { EXPECT_EQ(ReadBam("\xEF\xBB\xBF{\"entries\": [{\"t\": 0}]}").rows(), 1u); }

TEST(BamReaderTest, RoundTripsRandomTables) {
  std::mt19937_64 random(11);
  for (int round = 0; round < 40; ++round) {
    const std::size_t columns = 1 + random() % 5, rows = 1 + random() % 50;
    std::vector<std::vector<double>> table(columns, std::vector<double>(rows));
    std::string bytes = "{\"k\": 1, \"entries\": [";
    for (std::size_t r = 0; r < rows; ++r) {
      bytes += r ? ", {" : "{";
      // The keys of an entry in a random order.
      std::vector<std::size_t> order(columns);
      for (std::size_t c = 0; c < columns; ++c) order[c] = c;
      if (r > 0) std::shuffle(order.begin(), order.end(), random);
      for (std::size_t i = 0; i < columns; ++i) {
        double x;
        do {
          const std::uint64_t bits = random();
          std::memcpy(&x, &bits, sizeof x);
        } while (!std::isfinite(x));
        table[order[i]][r] = x;
        char text[64];
        bytes += fmt::format("{}\"c{}\": {}", i ? ", " : "", order[i],
                             std::string(text, std::to_chars(text, text + sizeof text, x).ptr));
      }
      bytes += random() % 3 ? "}" : "}\n";
    }
    const Log log = ReadBam(bytes + "]}");
    ASSERT_EQ(log.columns.size(), columns);
    for (std::size_t c = 0; c < columns; ++c) ASSERT_EQ(log.columns[c].values, table[c]);
  }
}

TEST(BamReaderTest, EveryPrefixIsRefused) {
  const std::string whole = R"({"kp": 1.5, "m": "a\u00e9", "entries": [{"t": 0, "x": NaN}, {"t": 1e-3, "x": false}]})";
  for (std::size_t size = 0; size < whole.size(); ++size) {
    const auto log = ReadBamJson("log.json", whole.substr(0, size));
    ASSERT_FALSE(log.ok()) << whole.substr(0, size);
    EXPECT_EQ(log.error().where.substr(0, 9), "log.json:") << log.error().Text();
  }
  EXPECT_EQ(ReadBam(whole).rows(), 2u);
}

}  // namespace
}  // namespace gapscope
