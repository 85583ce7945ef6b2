// Arrays become columns; what is damaged, hostile or no number is refused.
#include "src/log/npz_reader.h"

#include <fmt/format.h>

#include <cmath>
#include <cstring>

#include "src/core/statistics.h"
#include "tests/log/log_fixture.h"
#include "tests/log/npz_fixture.h"

namespace gapscope {
namespace {

using namespace std::string_literals;

const std::vector<double> kTime = {0, 0.1, 0.2, 0.30000000000000004}, kAngle = {1, -2.5, 1e-300, M_PI};

Log MustRead(const std::string& bytes) {
  auto log = ReadNpz("log.npz", bytes);
  EXPECT_TRUE(log.ok()) << log.error().Text();
  return log.ok() ? std::move(log).value() : Log{};
}

void ExpectColumn(const Log& log, const std::string& name, const std::vector<double>& values) {
  const Column* column = log.Find(name);
  ASSERT_NE(column, nullptr) << name << " of " << fmt::format("{}", fmt::join(log.ColumnNames(), ", "));
  ASSERT_EQ(column->values.size(), values.size()) << name;
  EXPECT_EQ(std::memcmp(column->values.data(), values.data(), values.size() * sizeof(double)), 0) << name;
}

std::string Shape(const char* shape, const std::string& type, const std::string& data, bool fortran = false) {
  return Zip({{"time.npy", Npy(kTime)}, {"x.npy", Npy(type, shape, data, fortran)}});
}

TEST(NpzReaderTest, EqualsTheCsvOfTheSameLogToTheLastBit) {
  const TempFolder folder;
  std::string csv = "time_s,u [V],q\n";
  std::vector<double> t, u, q;
  for (int k = 0; k < 200; ++k) {
    t.push_back(0.002 * k), u.push_back(std::sin(0.1 * k) / 3), q.push_back(k == 7 ? kNaN : std::exp(-0.37 * k));
    csv += fmt::format("{},{},{}\n", t.back(), u.back(), k == 7 ? "" : fmt::format("{}", q.back()));
  }
  const std::string own =
      Table(R"({"schema": "gapscope.log/1", "names": ["time_s", "u", "q"], "units": ["", "V", ""]})", {t, u, q}, true);
  const std::string user = Zip({{"time_s.npy", Npy(t)}, {"u [V].npy", Npy(u), true}, {"q.npy", Npy(q)}});
  const Log from_csv = ReadLog(folder.Write("log.csv", csv), {}).value();
  for (const std::string& bytes : {own, user}) {
    const Log log = ReadLog(folder.Write("log.bin", bytes), {}).value();
    EXPECT_EQ(log.format, "npz");
    EXPECT_EQ(log.ColumnNames(), from_csv.ColumnNames());
    for (const Column& column : from_csv.columns) {
      ExpectColumn(log, column.name, column.values);
      EXPECT_EQ(log.Find(column.name)->unit, column.unit);
    }
    const Finding* missing = FindFinding(log.findings, "missing", "q");
    ASSERT_NE(missing, nullptr);
    EXPECT_EQ(missing->first_row, 7u);
  }
}

TEST(NpzReaderTest, ReadsEveryTypeOfNumber) {
  const std::vector<double> small = {0, 1, 2, 100};
  const auto cast = [&](auto zero) {
    std::vector<decltype(zero)> values;
    for (const double x : small) values.push_back(static_cast<decltype(zero)>(x));
    return BytesOf(values);
  };
  const std::vector<std::pair<std::string, std::string>> types = {
      {"|i1", cast(std::int8_t{})},
      {"|u1", cast(std::uint8_t{})},
      {"<i2", cast(std::int16_t{})},
      {"<u2", cast(std::uint16_t{})},
      {"<i4", cast(std::int32_t{})},
      {"<u4", cast(std::uint32_t{})},
      {"<i8", cast(std::int64_t{})},
      {"<u8", cast(std::uint64_t{})},
      {"<f4", cast(float{})},
      {"<f8", cast(double{})},
      {"<f2", BytesOf(std::vector<std::uint16_t>{0, 0x3C00, 0x4000, 0x5640})}};
  for (const auto& [type, data] : types) {
    SCOPED_TRACE(type);
    ExpectColumn(MustRead(Shape("(4,)", type, data)), "x", small);
  }
  ExpectColumn(MustRead(Shape("(4,)", "|b1", "\0\1\1\0"s)), "x", {0, 1, 1, 0});
  ExpectColumn(MustRead(Shape("(4,)", "<f2", BytesOf(std::vector<std::uint16_t>{0x0001, 0x8400, 0x7BFF, 0xB555}))), "x",
               {std::ldexp(1, -24), -std::ldexp(1, -14), 65504, -0.33325195312500});
  ExpectColumn(MustRead(Shape("(4,)", "<i2", BytesOf(std::vector<std::int16_t>{-1, -32768, 5, 0}))), "x",
               {-1, -32768, 5, 0});
}

TEST(NpzReaderTest, TwoAxesAreColumnsByNumberOrByName) {
  const std::string rows = BytesOf(std::vector<double>{1, 5, 2, 6, 3, 7, 4, 8});
  const std::string columns = BytesOf(std::vector<double>{1, 2, 3, 4, 5, 6, 7, 8});
  for (const bool fortran : {false, true}) {
    const Log log = MustRead(Shape("(4, 2)", "<f8", fortran ? columns : rows, fortran));
    ExpectColumn(log, "x[0]", {1, 2, 3, 4});
    ExpectColumn(log, "x[1]", {5, 6, 7, 8});
  }
  const std::string unicode = BytesOf(std::vector<std::uint32_t>{'h', 0x00FC, 0x20AC, 'k', 0, 0});
  for (const char* list : {"x_names", "joint_names", "joint_order"}) {
    const Log log = MustRead(Zip(
        {{"t.npy", Npy(kTime)}, {"x.npy", Npy("<f8", "(4, 2)", rows)}, {list + ".npy"s, Npy("<U3", "(2,)", unicode)}}));
    ExpectColumn(log, "x/hü€", {1, 2, 3, 4});
    ExpectColumn(log, "x/k", {5, 6, 7, 8});
  }
  ExpectColumn(MustRead(Zip({{"t.npy", Npy(kTime)},
                             {"x.npy", Npy("<f8", "(4, 2)", rows)},
                             {"x_names.npy", Npy("|S4", "(2,)", "hip\0knee"s)}})),
               "x/knee", {5, 6, 7, 8});
}

TEST(NpzReaderTest, TheTimesRowsAreTheTable) {
  const Log log = MustRead(Zip({{"mass.npy", Npy("<f8", "()", Bytes(0.7))},
                                {"robot.npy", Npy("<U3", "()", BytesOf(std::vector<std::uint32_t>{'a', 'r', 'm'}))},
                                {"long.npy", Npy({1, 2, 3, 4, 5, 6})},
                                {"cube.npy", Npy("<f8", "(4, 1, 1)", BytesOf(kTime))},
                                {"time.npy", Npy(kTime)},
                                {"notes.txt", "not an array"},
                                {"q.npy", Npy(kAngle)}}));
  EXPECT_EQ(log.ColumnNames(), (std::vector<std::string>{"time", "q"}));
  EXPECT_EQ(log.header.at("mass"), 0.7);
  EXPECT_EQ(log.header_text.at("robot"), "arm");
  EXPECT_NE(FindFinding(log.findings, "ignored_array", "long"), nullptr);
  EXPECT_NE(FindFinding(log.findings, "ignored_array", "cube"), nullptr);
  // Without a time: the greatest number of rows that two have.
  EXPECT_EQ(MustRead(Zip({{"a.npy", Npy(kTime)}, {"b.npy", Npy(kTime)}, {"long.npy", Npy({1, 2, 3, 4, 5})}})).rows(),
            4u);
}

TEST(NpzReaderTest, TheTableCarriesHeaderAndFindings) {
  const Log log = MustRead(
      Table(R"({"schema": "gapscope.log/1", "names": ["t", "q"], "time": "q", "header": {"kp": 100, "rig": "a"},
      "findings": [{"kind": "mixed_clocks", "column": "q", "count": 3, "text": "two clocks"}]})",
            {kTime, kAngle}));
  EXPECT_EQ(
      BuildTimeline(MustRead(Table(R"({"schema": "gapscope.log/1", "names": ["t", "clock_2"], "time": "clock_2"})",
                                   {kAngle, kTime})),
                    {})
          .value()
          .time_column,
      "clock_2");
  EXPECT_EQ(log.time_column, "q");
  EXPECT_EQ(log.header.at("kp"), 100);
  EXPECT_EQ(log.header_text.at("rig"), "a");
  const Finding* finding = FindFinding(log.findings, "mixed_clocks", "q");
  ASSERT_NE(finding, nullptr);
  EXPECT_EQ(finding->count, 3u);
  EXPECT_EQ(log.Where(2), "log.npz: row 3");
  EXPECT_EQ(log.WhereHeader(), "log.npz");
}

struct Broken {
  const char* name;
  std::string bytes;
  const char* says;
};

std::vector<Broken> BrokenArchives() {
  const std::string good = Zip({{"t.npy", Npy(kTime)}, {"q.npy", Npy(kAngle), true}});
  std::string flipped = good, beyond = good, far_directory = good;
  flipped[good.find("NUMPY") + 120] ^= 1;
  beyond.replace(good.rfind("q.npy") - 4, 4, Bytes(std::uint32_t{1 << 30}));
  far_directory.replace(good.size() - 6, 4, Bytes(std::uint32_t{1 << 30}));
  const auto one = [](Member member) { return Zip({std::move(member)}); };
  const std::string q = Npy(kAngle);
  return {
      {"cut in the middle", good.substr(0, good.size() / 2), "no directory at its end"},
      {"cut before the end", good.substr(0, good.size() - 1), "no directory at its end"},
      {"signature alone", "PK\x03\x04"s, "no directory at its end"},
      {"empty archive", Zip({}), "without an array"},
      {"a spreadsheet", one({"xl/workbook.xml", "<x/>"}), "Export the log as CSV"},
      {"a bit flipped", flipped, "checksum"},
      {"a member elsewhere", beyond, "where the archive's directory says"},
      {"directory elsewhere", far_directory, "not where it should be"},
      {"no zip at all", "time,x\n0,1\n", "no NPZ archive"},
      {"stored with two sizes", one({"q.npy", q, false, 99}), "two sizes"},
      {"unpacks to more", one({"q.npy", q, true, 9}), "cannot be unpacked"},
      {"unpacks to less", one({"q.npy", q, true, 9999}), "cannot be unpacked"},
      {"claims 10^9 rows", one({"q.npy", Npy("<f8", "(1000000000,)", ""), true}), "do not fill its shape"},
      {"claims 2^64 rows", one({"q.npy", Npy("<f8", "(18446744073709551615, 3)", ""), true}), "do not fill its shape"},
      {"a bomb", one({"q.npy", q, true, 0xFFFFFFFE}), "more than a log of its size"},
      {"encrypted", one({"q.npy", q, false, 0, 0, 1}), "encrypted"},
      {"bzip2", one({"q.npy", q, false, 0, 12}), "method 12"},
      {"twice", Zip({{"q.npy", q}, {"q.npy", q}}), "twice"},
      {"above 4 GB", one({"q.npy", q, true, 0xFFFFFFFF}), "above 4 GB"},
  };
}

std::vector<Broken> BrokenArrays() {
  const auto header = [](const std::string& text) { return Zip({{"q.npy", NpyOf(text, BytesOf(kAngle))}}); };
  const auto typed = [](const char* type) { return Zip({{"q.npy", Npy(type, "(4,)", BytesOf(kAngle))}}); };
  return {
      {"no npy", Zip({{"q.npy", "0,1,2,3,4,5,6,7,8"}}), "header cannot be read"},
      {"a short one", Zip({{"q.npy", "\x93NUMPY\x01"}}), "header cannot be read"},
      {"version 9", Zip({{"q.npy", NpyOf("{}", "", 9)}}), "header cannot be read"},
      {"a header longer than the file", Zip({{"q.npy", "\x93NUMPY\x01\0\xFF\xFFxxxxxxx"s}}), "header cannot be read"},
      {"an empty header", header("{}"), "header cannot be read"},
      {"no shape", header("{'descr': '<f8', 'fortran_order': False}"), "header cannot be read"},
      {"a negative axis", header("{'descr': '<f8', 'fortran_order': False, 'shape': (-4,)}"), "header cannot be read"},
      {"code in the header", header("{'descr': __import__('os').system('true'), 'shape': (4,)}"), "cannot be read"},
      {"another key", header("{'descr': '<f8', 'fortran_order': False, 'shape': (4,), 'x': 1}"), "cannot be read"},
      {"an open text", header("{'descr': '<f8"), "header cannot be read"},
      {"objects", typed("|O"), "nothing is unpickled"},
      {"records", header("{'descr': [('t', '<f8')], 'fortran_order': False, 'shape': (4,)}"), "an array of records"},
      {"dates", typed("<M8[ns]"), "an array of dates"},
      {"complex", typed("<c16"), "complex"},
      {"big-endian", typed(">f8"), "big-endian"},
      {"long double", typed("<f16"), "no number"},
      {"void", typed("|V8"), "no number"},
      {"no size", typed("<f"), "no number"},
      {"a size with a tail", typed("<i8x"), "unknown type"},
      {"too few bytes", Zip({{"q.npy", Npy("<f8", "(5,)", BytesOf(kAngle))}}), "do not fill its shape"},
      {"too many bytes", Zip({{"q.npy", Npy("<f8", "(3,)", BytesOf(kAngle))}}), "do not fill its shape"},
      {"only text", Zip({{"q.npy", Npy("|S8", "(4,)", BytesOf(kAngle))}}), "no array that could be a column"},
      {"no rows", Zip({{"q.npy", Npy({})}}), "no array that could be a column"},
      {"10^9 rows of nothing", Zip({{"q.npy", Npy("<f8", "(1000000000, 0)", "")}}), "no array that could be a column"},
      {"too many columns", Zip({{"q.npy", Npy("|u1", "(1, 10001)", std::string(10001, '\0'))}}), "too many columns"},
  };
}

std::vector<Broken> BrokenTables() {
  const auto meta = [](const std::string& rest) {
    return Table("{\"schema\": \"gapscope.log/1\", " + rest + "}", {kTime, kAngle});
  };
  return {
      {"no JSON", Table("{", {kTime}), "no JSON object"},
      {"a deep JSON", Table(std::string(100'000, '['), {kTime}), "no JSON object"},
      {"another schema", Table(R"({"schema": "gapscope.log/2", "names": ["t"]})", {kTime}), "gapscope.log/2"},
      {"a number for the schema", Table(R"({"schema": 1, "names": ["t"]})", {kTime}), "schema '1'"},
      {"no names", meta("\"units\": []"), "no list of names"},
      {"a number for a name", meta("\"names\": [\"t\", 1]"), "no list of names"},
      {"a name too many", meta("\"names\": [\"t\", \"q\", \"w\"]"), "no array 'c2' for 'w'"},
      {"a unit too few", meta("\"names\": [\"t\", \"q\"], \"units\": [\"s\"]"), "'units' is no list of as many"},
      {"a clock too many", meta("\"names\": [\"t\"], \"clock\": [\"header\", \"receive\"]"), "'clock' is no list"},
      {"an unknown word for what is missing", meta("\"names\": [\"t\", \"q\"], \"missing\": \"hold\""),
       "'missing' is not"},
      {"unequal columns", Table(R"({"schema": "gapscope.log/1", "names": ["t", "q"]})", {kTime, {1}}), "'c1' ('q')"},
      {"no rows", Table(R"({"schema": "gapscope.log/1", "names": ["t"]})", {{}}), "no rows"},
      {"a time that is not there", meta("\"names\": [\"t\"], \"time\": \"q\""), "names no column"},
      {"a list in the header", meta("\"names\": [\"t\"], \"header\": {\"kp\": []}"), "'header' or 'findings'"},
      {"a finding of nothing", meta("\"names\": [\"t\"], \"findings\": [{}]"), "'header' or 'findings'"},
      {"meta of doubles", Zip({{"meta.npy", Npy(kTime)}, {"c0.npy", Npy(kTime)}}), "no text in bytes"},
  };
}

TEST(NpzReaderTest, RefusesWhatIsDamagedOrHostile) {
  for (const auto& table : {BrokenArchives(), BrokenArrays(), BrokenTables()}) {
    for (const Broken& broken : table) {
      SCOPED_TRACE(broken.name);
      const auto log = ReadNpz("log.npz", broken.bytes);
      ASSERT_FALSE(log.ok());
      EXPECT_TRUE(log.error().where.starts_with("log.npz: ")) << log.error().Text();
      EXPECT_NE(log.error().Text().find(broken.says), std::string::npos) << log.error().Text();
      EXPECT_FALSE(log.error().cure.empty() && log.error().allowed.empty()) << log.error().Text();
    }
  }
}

TEST(NpzReaderTest, EveryCutIsRefused) {
  const std::string good = Table(R"({"schema": "gapscope.log/1", "names": ["t", "q"]})", {kTime, kAngle}, true);
  ASSERT_TRUE(ReadNpz("log.npz", good).ok());
  for (std::size_t size = 0; size < good.size(); ++size) EXPECT_FALSE(ReadNpz("log.npz", good.substr(0, size)).ok());
}

}  // namespace
}  // namespace gapscope
