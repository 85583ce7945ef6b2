// Broken bam JSON files: each is refused with file and line, what was found and a cure; none brings the program down.
#include <fmt/format.h>

#include <cstring>

#include "tests/log/log_fixture.h"

namespace gapscope {
namespace {

using namespace std::string_literals;

struct BrokenBam {
  const char* name;
  std::string bytes;
  const char* where;
  const char* says;
};

std::string Times(std::size_t count, const std::string& text) {
  std::string all;
  all.reserve(count * text.size());
  for (std::size_t k = 0; k < count; ++k) all += text;
  return all;
}

// Each entry with a key of its own.
std::string SparseEntries(std::size_t count) {
  std::string all;
  for (std::size_t k = 0; k < count; ++k) all += fmt::format("{}{{\"timestamp\": {}, \"k{}\": 1}}", k ? "," : "", k, k);
  return all;
}

std::vector<BrokenBam> BamTable() {
  const std::string head = "{\"kp\": 100, \"entries\": [\n";
  const std::string entry = "{\"timestamp\": 0.1, \"position\": 1}";
  const std::string good = head + entry + ",\n{\"timestamp\": 0.2, \"position\": 2}]}";
  return {
      {"empty", "", ":1", "empty"},
      {"only blanks", "\n \n", ":1", "empty"},
      {"cut in a key", head + "{\"times", ":2:8", "cut off"},
      {"cut behind a colon", head + "{\"timestamp\":", ":2:", "cut off"},
      {"cut in a number", head + "{\"timestamp\": 0.", ":2:", "not valid JSON"},
      {"cut between entries", head + entry + ",", ":2:", "cut off"},
      {"cut before the last bracket", good.substr(0, good.size() - 1), ":3:", "cut off"},
      {"cut in a word", head + "{\"timestamp\": tru", ":2:", "not valid JSON"},
      {"more behind the end", good + "\n{}", ":4:", "not valid JSON"},
      {"comma too many", head + entry + ",]}", ":2:", "not valid JSON"},
      {"comma missing", head + entry + entry + "]}", ":2:", "not valid JSON"},
      {"single quotes", "{'kp': 1}", ":1:2", "not valid JSON"},
      {"comment", "{\"kp\": 1, // gain\n\"entries\": []}", ":1:", "not valid JSON"},
      {"decimal comma", head + "{\"timestamp\": 0,1, \"position\": 1}]}", ":2:", "not valid JSON"},
      {"leading zeros", head + "{\"timestamp\": 007}]}", ":2:", "not valid JSON"},
      {"hexadecimal", head + "{\"timestamp\": 0x10}]}", ":2:", "not valid JSON"},
      {"overflow", head + "{\"timestamp\": 1e999}]}", ":2:", "too large"},
      {"overflow in the header", "{\"kp\": -1e400, \"entries\": []}", ":1:", "too large"},
      {"bad escape", "{\"a\\q\": 1}", ":1:", "not valid JSON"},
      {"lone surrogate", "{\"a\": \"\\ud800\"}", ":1:", "not valid JSON"},
      {"invalid UTF-8", "{\"a\": \"\xFF\xFE\"}", ":1:", "not valid JSON"},
      {"line break in a text", "{\"a\": \"b\nc\"}", ":1:", "not valid JSON"},
      {"NUL within", "{\"a\": \0 1}"s, ":1:7", "NUL"},
      {"UTF-16", "\xFF\xFE{\0}\0"s, ":1", "UTF-16"},
      {"binary", "\x93NUMPY\x01\x00v\x00"s, ":1", "NumPy"},
      {"control characters", "{\x01\x02}", ":1:2", "control character"},
      {"parameters, no log", "{\"kt\": 0.49, \"R\": 4.1, \"model\": \"m1\"}", ":1", "no array 'entries'"},
      {"empty object", "{}", ":1", "no array 'entries'"},
      {"array at the top", "[" + entry + "]", ":1:1", "not a bam log"},
      {"text at the top", "\"log\"", ":1:", "not a bam log"},
      {"number at the top", "1000000000", ":1:", "not a bam log"},
      {"no entries in the array", "{\"entries\": []}", ":1", "no samples"},
      {"empty entries", "{\"entries\": [{}, {}]}", ":1", "no samples"},
      {"entries are a number", "{\"entries\": 1000000000}", ":1:", "not an array"},
      {"entries are a text", "{\"entries\": \"none\"}", ":1", "no array 'entries'"},
      {"entries are an object", "{\"entries\": {\"timestamp\": [0, 1]}}", ":1", "no array 'entries'"},
      {"entries twice", "{\"entries\": [" + entry + "],\n\"entries\": [" + entry + "]}", ":2:12", "twice"},
      {"a number for an entry", head + "1, 2]}", ":2:2", "entry 1 is not an object"},
      {"an array for an entry", head + entry + ",\n[0.2, 2]]}", ":3:1", "entry 2 is not an object"},
      {"a text for an entry", head + "\"a\"]}", ":2:", "entry 1 is not an object"},
      {"null for an entry", head + "null]}", ":2:", "entry 1 is not an object"},
      {"text in an entry", head + "{\"timestamp\": 0.1, \"position\": \"1.5\"}]}", ":2:", "without quotes"},
      {"array in an entry", head + "{\"timestamp\": 0.1, \"position\": [1, 2]}]}", ":2:", "one key per joint"},
      {"object in an entry", head + "{\"timestamp\": 0.1, \"position\": {\"a\": 1}}]}", ":2:", "nested data"},
      {"key twice in an entry", head + "{\"timestamp\": 0.1, \"timestamp\": 0.2}]}", ":2:", "a key twice in entry 1"},
      {"key twice in the header", "{\"kp\": 1, \"kp\": 2, \"entries\": []}", ":1:", "twice in the header"},
      {"arrays 100000 deep", Times(100'000, "["), ":1:", "not a bam log"},
      {"arrays 100000 deep in the header", "{\"a\": " + Times(100'000, "[") + Times(100'000, "]") + "}",
       ":1:", "nested too deeply"},
      {"objects 100000 deep in the header", Times(100'000, "{\"a\":"), ":1:", "nested too deeply"},
      {"arrays 100000 deep in an entry", head + "{\"a\": " + Times(100'000, "["), ":2:", "nested data"},
      {"endless text", "{\"a\": \"" + std::string(4 << 20, 'x'), ":1:", "cut off"},
      {"endless number", "{\"a\": " + std::string(1 << 20, '9') + "}", ":1:", "too large"},
      {"entries without common keys", head + SparseEntries(900) + "," + SparseEntries(1200) + "]}",
       ":2:", "too many different keys"},
      {"no time", head + "{\"position\": 1}, {\"position\": 2}]}", ":2", "no time column"},
      {"time all null", head + "{\"timestamp\": null, \"a\": 1},{\"timestamp\": null, \"a\": 1}]}", ":2",
       "holds no number"},
      {"everything NaN", head + "{\"timestamp\": NaN, \"a\": NaN},{\"timestamp\": NaN, \"a\": NaN}]}", ":2",
       "holds no number"},
      {"column all NaN", head + "{\"timestamp\": 0, \"a\": NaN},\n{\"timestamp\": 1, \"a\": NaN}]}", ":2, column a",
       "without any value"},
      {"one entry", head + entry + "]}", ":2, column timestamp", "fewer than two rows"},
      {"stamps going back", head + "{\"timestamp\": 2, \"a\": 1},\n{\"timestamp\": -1, \"a\": 1}]}",
       ":2, column timestamp", "fewer than two rows"},
      {"stamps in the wrong unit", "{\"entries\": [{\"time_s\": 0, \"a\": 1},{\"time_s\": 1e9, \"a\": 2}]}",
       ":1, column time_s", "makes no sense"},
      {"CSV in a JSON file", "time_s,voltage_v\n0,1\n", ":1:", "not valid JSON"},
  };
}

TEST(BamHostileTest, EachIsRefusedWithFileAndLine) {
  const TempFolder folder;
  const auto table = BamTable();
  EXPECT_GE(table.size(), 40u);
  for (const auto& broken : table) {
    const std::string path = folder.Write("broken.json", broken.bytes);
    const auto error = FirstError(path);
    ASSERT_TRUE(error) << broken.name;
    const std::string text = error->Text();
    EXPECT_EQ(text.substr(0, path.size() + std::strlen(broken.where)), path + broken.where)
        << broken.name << ": " << text;
    EXPECT_NE(text.find(broken.says), std::string::npos) << broken.name << ": " << text;
    EXPECT_LT(text.size(), 1500u) << broken.name;
    EXPECT_EQ(text.find('\n'), std::string::npos) << broken.name;
  }
}

// Memory stays with the file's size: a late key in a long log, and keys that few entries have.
TEST(BamHostileTest, SparseTablesAreBounded) {
  std::string bytes = "{\"entries\": [";
  for (int k = 0; k < 40'000; ++k) bytes += "{\"t\":1},";
  for (int k = 0; k < 900; ++k) bytes += fmt::format("{{\"k{}\":1}}{}", k, k < 899 ? "," : "]}");
  const TempFolder folder;
  const auto error = FirstError(folder.Write("sparse.json", bytes));
  ASSERT_TRUE(error);
  EXPECT_NE(error->Text().find("too few keys in common"), std::string::npos) << error->Text();
}

}  // namespace
}  // namespace gapscope
