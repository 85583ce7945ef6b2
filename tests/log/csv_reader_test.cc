#include "src/log/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <clocale>
#include <cmath>
#include <cstring>
#include <limits>
#include <random>

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

constexpr double kNaN = std::numeric_limits<double>::quiet_NaN();

Log Read(const std::string& bytes) {
  const Result<Log> log = ReadCsv("log.csv", bytes);
  EXPECT_TRUE(log.ok()) << (log.ok() ? "" : log.error().Text()) << "\n" << bytes;
  return log.ok() ? log.value() : Log{};
}

void ExpectValues(const std::vector<double>& got, const std::vector<double>& wanted, const std::string& what) {
  ASSERT_EQ(got.size(), wanted.size()) << what;
  for (std::size_t k = 0; k < got.size(); ++k) {
    if (std::isnan(wanted[k])) {
      EXPECT_TRUE(std::isnan(got[k])) << what << ", row " << k;
    } else {
      EXPECT_EQ(got[k], wanted[k]) << what << ", row " << k;
    }
  }
}

struct Good {
  const char* what;
  std::string bytes;
  std::vector<std::string> names, units;
  std::vector<std::vector<double>> columns;
};

std::vector<Good> GoodTable() {
  const std::vector<double> t = {0, 0.5}, x = {1.5, -2};
  return {
      {"plain", "t,x\n0,1.5\n0.5,-2\n", {"t", "x"}, {"", ""}, {t, x}},
      {"no newline at the end", "t,x\n0,1.5\n0.5,-2", {"t", "x"}, {}, {t, x}},
      {"CRLF", "t,x\r\n0,1.5\r\n0.5,-2\r\n", {"t", "x"}, {}, {t, x}},
      {"lone CR", "t,x\r0,1.5\r0.5,-2\r", {"t", "x"}, {}, {t, x}},
      {"BOM", "\xEF\xBB\xBFt,x\n0,1.5\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"blanks around", " t , x \n 0 , 1.5 \n 0.5 ,\t-2 \n", {"t", "x"}, {}, {t, x}},
      {"semicolon", "t;x\n0;1.5\n0.5;-2\n", {"t", "x"}, {}, {t, x}},
      {"decimal comma", "t;x\n0;1,5\n0,5;-2,0\n", {"t", "x"}, {}, {t, x}},
      {"decimal comma with tabs", "t\tx\n0\t1,5\n0,5\t-2\n", {"t", "x"}, {}, {t, x}},
      {"decimal comma in quotes", "t,x\n\"0\",\"1,5\"\n\"0,5\",\"-2\"\n", {"t", "x"}, {}, {t, x}},
      {"tab", "t\tx\n0\t1.5\n0.5\t-2\n", {"t", "x"}, {}, {t, x}},
      {"blanks", "t x\n0 1.5\n0.5   -2\n", {"t", "x"}, {}, {t, x}},
      {"aligned blanks", "   t     x\n   0   1.5\n 0.5  -2  \n", {"t", "x"}, {}, {t, x}},
      {"comma and blank", "t, x\n0, 1.5\n0.5, -2\n", {"t", "x"}, {}, {t, x}},
      {"sep line", "sep=;\nt;x\n0;1,5\n0,5;-2\n", {"t", "x"}, {}, {t, x}},
      {"quoted names", "\"t\",\"x, y\"\n0,1.5\n0.5,-2\n", {"t", "x, y"}, {}, {t, x}},
      {"doubled quote in a name", "t,\"a \"\"b\"\"\"\n0,1.5\n0.5,-2\n", {"t", "a \"b\""}, {}, {t, x}},
      {"comments first", "# rig 7\n// by hand\n% third\nt,x\n0,1.5\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"comment among rows", "t,x\n0,1.5\n# pause\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"blank lines", "\n\nt,x\n\n0,1.5\n  \n0.5,-2\n\n", {"t", "x"}, {}, {t, x}},
      {"savetxt header", "# t,x\n0,1.5\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"savetxt header with blanks", "# t x\n0 1.5\n5.0e-1 -2\n", {"t", "x"}, {}, {t, x}},
      {"rostopic", "%time,field.x\n0,1.5\n0.5,-2\n", {"%time", "field.x"}, {}, {t, x}},
      {"PlotJuggler", "__time,/joint/x\n0,1.5\n0.5,-2\n", {"__time", "/joint/x"}, {}, {t, x}},
      {"units in square brackets", "t [s],x [V]\n0,1.5\n0.5,-2\n", {"t", "x"}, {"s", "V"}, {t, x}},
      {"units in round brackets", "t (s),x (N m)\n0,1.5\n0.5,-2\n", {"t", "x"}, {"s", "N m"}, {t, x}},
      {"round brackets that are no unit", "t,x (filtered)\n0,1.5\n0.5,-2\n", {"t", "x (filtered)"}, {"", ""}, {t, x}},
      {"an index is no unit", "t,x[1]\n0,1.5\n0.5,-2\n", {"t", "x[1]"}, {"", ""}, {t, x}},
      {"degree sign", "t [s],x [\xC2\xB0]\n0,1.5\n0.5,-2\n", {"t", "x"}, {"s", "\xC2\xB0"}, {t, x}},
      {"row of units", "t,x\ns,V\n0,1.5\n0.5,-2\n", {"t", "x"}, {"s", "V"}, {t, x}},
      {"row of units in brackets", "t,x\n[s],[rad/s]\n0,1.5\n0.5,-2\n", {"t", "x"}, {"s", "rad/s"}, {t, x}},
      {"Simulink Data Inspector",
       "time,x\n,Type: double\nUnit: s,Unit: V\n,Interp: linear\n0,1.5\n0.5,-2\n",
       {"time", "x"},
       {"s", "V"},
       {t, x}},
      {"true and false", "t,x\n0,true\n0.5,FALSE\n", {"t", "x"}, {}, {t, {1, 0}}},
      {"missing values", "t,x,y\n0,,nan\n0.5,NaN,NA\n", {"t", "x", "y"}, {}, {t, {kNaN, kNaN}, {kNaN, kNaN}}},
      {"more missing values", "t,x,y\n0,null,-\n0.5,None,\"\"\n", {"t", "x", "y"}, {}, {t, {kNaN, kNaN}, {kNaN, kNaN}}},
      {"last field empty", "t,x\n0,1.5\n0.5,\n", {"t", "x"}, {}, {t, {1.5, kNaN}}},
      {"tabs, fields empty", "t\tx\ty\n0\t\t1.5\n0.5\t\t-2\n", {"t", "x", "y"}, {}, {t, {kNaN, kNaN}, x}},
      {"inf is missing", "t,x\n0,inf\n0.5,-Infinity\n", {"t", "x"}, {}, {t, {kNaN, kNaN}}},
      {"plus sign", "t,x\n+0,+1.5\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"exponents", "t,x\n0e0,15E-1\n5.0e-01,-0.2e+1\n", {"t", "x"}, {}, {t, x}},
      {"too small is zero", "t,x\n1e-999,1.5\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"separator behind each row", "t,x\n0,1.5,\n0.5,-2,\n", {"t", "x"}, {}, {t, x}},
      {"separator behind each line", "t,x,\n0,1.5,\n0.5,-2,\n", {"t", "x"}, {}, {t, x}},
      {"pandas index", ",t,x\n7,0,1.5\n8,0.5,-2\n", {"column_1", "t", "x"}, {}, {{7, 8}, t, x}},
      {"duplicate names", "t,x,x\n0,1.5,3\n0.5,-2,4\n", {"t", "x", "x"}, {}, {t, x, {3, 4}}},
      {"header again", "t,x\n0,1.5\nt,x\n0.5,-2\n", {"t", "x"}, {}, {t, x}},
      {"a column of words",
       "t,x,mode\n0,1.5,idle\n0.5,-2,run\n1,0,run\n",
       {"t", "x", "mode"},
       {},
       {{0, 0.5, 1}, {1.5, -2, 0}, {kNaN, kNaN, kNaN}}},
      {"one row", "t,x\n0,1.5\n", {"t", "x"}, {}, {{0}, {1.5}}},
      {"form of decimal point", "t,x\n0.,1.5\n.5,-2.\n", {"t", "x"}, {}, {t, x}},
  };
}

TEST(CsvReaderTest, ReadsWhatUsersHave) {
  for (const auto& good : GoodTable()) {
    const Log log = Read(good.bytes);
    EXPECT_EQ(log.ColumnNames(), good.names) << good.what;
    ASSERT_EQ(log.columns.size(), good.columns.size()) << good.what;
    for (std::size_t c = 0; c < good.columns.size(); ++c) {
      ExpectValues(log.columns[c].values, good.columns[c], good.what + (", column " + good.names[c]));
      if (c < good.units.size()) {
        EXPECT_EQ(log.columns[c].unit, good.units[c]) << good.what;
      }
    }
  }
}

TEST(CsvReaderTest, ReportsWhatItDidNotTakeLiterally) {
  const struct {
    const char* bytes;
    const char* kind;
    const char* column;
    std::size_t count, first_row;
  } rows[] = {
      {"t;x\n0;1,5\n0,5;-2\n", "decimal_comma", "", 2, 0},  {"t,x\n0,1\n1,\n2,nan\n", "missing", "x", 2, 1},
      {"t,x\n0,1\n1,inf\n", "infinite", "x", 1, 1},         {"t,x\n0,1\n# a\n// b\n1,2\n", "comment", "", 2, 1},
      {"t,x,x\n0,1,2\n", "duplicate_name", "x", 1, 0},      {"t,x\n0,1\nt,x\n1,2\n", "repeated_header", "", 1, 1},
      {"t,x\n0,1\n1,2,\n", "trailing_delimiter", "", 1, 1}, {"t,x,\n0,1,\n1,2,\n", "trailing_delimiter", "", 3, 0},
      {",t\n0,1\n", "unnamed_column", "column_1", 1, 0},    {"t,m\n0,a\n1,b\n2,c\n", "text_column", "m", 3, 0},
      {"# t,x\n0,1\n", "header_comment", "", 1, 0},
  };
  for (const auto& row : rows) {
    const Log log = Read(row.bytes);
    const Finding* finding = FindFinding(log.findings, row.kind);
    ASSERT_TRUE(finding) << row.kind << "\n" << row.bytes;
    EXPECT_EQ(finding->column, row.column) << row.kind;
    EXPECT_EQ(finding->count, row.count) << row.kind;
    EXPECT_EQ(finding->first_row, row.first_row) << row.kind;
    EXPECT_FALSE(finding->text.empty());
    EXPECT_EQ(log.findings.size(), 1u) << row.kind;
  }
}

TEST(CsvReaderTest, CleanLogHasNoFindings) { EXPECT_TRUE(Read("t,x\n0,1.5\n0.5,-2\n").findings.empty()); }

TEST(CsvReaderTest, FindsColumnsByNameAndHeading) {
  const Log log = Read("t [s],x [V],x (V)\n0,1,2\n");
  ASSERT_TRUE(log.Find("x"));
  EXPECT_EQ(log.Find("x"), &log.columns[1]);
  EXPECT_EQ(log.Find("x [V]"), &log.columns[1]);
  EXPECT_EQ(log.Find("x(V)"), &log.columns[1]);
  EXPECT_EQ(log.Find("x [A]"), nullptr);
  EXPECT_EQ(log.Find("y"), nullptr);
}

TEST(CsvReaderTest, RowsKnowTheirLines) {
  const Log log = Read("# a\nt,x\ns,V\n0,1\n\n1,2\n# b\n2,3\n3,4\n");
  ASSERT_EQ(log.rows(), 4u);
  EXPECT_EQ(log.WhereHeader(), "log.csv:2");
  EXPECT_EQ(log.Where(0), "log.csv:4");
  EXPECT_EQ(log.Where(1), "log.csv:6");
  EXPECT_EQ(log.Where(2), "log.csv:8");
  EXPECT_EQ(log.Where(3), "log.csv:9");
}

// Whatever doubles are written in the shortest form that names them come back bit for bit, under any dialect.
TEST(CsvReaderTest, RoundTripsRandomTables) {
  std::mt19937_64 random(7);
  for (int round = 0; round < 60; ++round) {
    const std::size_t columns = 2 + random() % 6, rows = 1 + random() % 80;
    const char delimiter = ",;\t "[random() % 4];
    const bool comma = delimiter == ';' && random() % 2;
    const char* end = random() % 2 ? "\r\n" : "\n";
    std::vector<std::vector<double>> table(columns, std::vector<double>(rows));
    std::string bytes;
    for (std::size_t c = 0; c < columns; ++c) bytes += fmt::format("{}c{}", c ? std::string(1, delimiter) : "", c);
    bytes += end;
    for (std::size_t r = 0; r < rows; ++r) {
      for (std::size_t c = 0; c < columns; ++c) {
        double x;
        do {
          const std::uint64_t bits = random();
          std::memcpy(&x, &bits, sizeof x);
        } while (!std::isfinite(x));
        if (random() % 2) x = static_cast<double>(static_cast<int>(random() % 2001) - 1000) / 8;
        table[c][r] = x;
        char text[64];
        std::string number(text, std::to_chars(text, text + sizeof text, x).ptr);
        if (comma) std::replace(number.begin(), number.end(), '.', ',');
        if (delimiter != ' ' && random() % 8 == 0) number = "\"" + number + "\"";
        bytes += (c ? std::string(1, delimiter) : "") + number;
      }
      bytes += end;
    }
    const Log log = Read(bytes);
    ASSERT_EQ(log.columns.size(), columns);
    for (std::size_t c = 0; c < columns; ++c) ASSERT_EQ(log.columns[c].values, table[c]) << "round " << round;
  }
}

// A file cut anywhere gives a log or an error, and never more rows than the whole.
TEST(CsvReaderTest, EveryPrefixIsReadOrRefused) {
  const std::string whole = "sep=;\n# c\n\"time [s]\";x (V)\ns;V\n0;1,5\n0,1;\"2,5\"\n0,2;nan\n0,3;true\n";
  for (std::size_t size = 0; size <= whole.size(); ++size) {
    const Result<Log> log = ReadCsv("log.csv", whole.substr(0, size));
    if (log.ok()) {
      EXPECT_LE(log.value().rows(), 4u);
      EXPECT_EQ(log.value().columns[0].values.size(), log.value().columns[1].values.size());
    } else {
      EXPECT_EQ(log.error().where.substr(0, 8), "log.csv:") << log.error().Text();
    }
  }
}

// Room is made for as many rows as the first mebibyte lets expect: what follows may differ.
TEST(CsvReaderTest, RowsMayBeMoreOrFewerThanTheFirstOnesLetExpect) {
  constexpr std::size_t kRows = 100'000;
  std::string rows = "t,x\n";
  for (std::size_t k = 0; k < kRows; ++k) rows += fmt::format("{},{}\n", k, k + 0.25);
  std::string comments = "t,x\n";
  while (comments.size() < (1u << 20)) comments += "#" + std::string(10'000, 'c') + "\n";
  for (const std::string& bytes : {rows + comments.substr(4), comments + rows.substr(4)}) {
    const Log log = Read(bytes);
    ASSERT_EQ(log.rows(), kRows);
    EXPECT_EQ(log.columns[1].values.front(), 0.25);
    EXPECT_EQ(log.columns[1].values.back(), static_cast<double>(kRows) - 0.75);
  }
}

TEST(CsvReaderTest, DoesNotDependOnTheLocale) {
  const char* old = std::setlocale(LC_ALL, nullptr);
  const std::string saved = old ? old : "C";
  std::setlocale(LC_ALL, "de_DE.UTF-8");  // without effect where it is not installed
  ExpectValues(Read("t,x\n0,1.5\n0.5,-2\n").columns[1].values, {1.5, -2}, "de_DE");
  std::setlocale(LC_ALL, saved.c_str());
}

}  // namespace
}  // namespace gapscope
