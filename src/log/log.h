// A hardware log as it stands in its file: a table of columns in the file's own units, and the header's values.
// Nothing has been converted, repaired or dropped; src/log/timeline.h does that, by named policies, and counts it.
#ifndef GAPSCOPE_LOG_LOG_H_
#define GAPSCOPE_LOG_LOG_H_

#include <cstddef>
#include <map>
#include <span>
#include <string>
#include <string_view>
#include <vector>

#include "src/core/result.h"

namespace gapscope {

// One column; rows without a value hold NaN. All columns of a log have the same number of rows.
struct Column {
  std::string name;  // as in the file, blanks trimmed
  std::string unit;  // as the file states it ("V" of "voltage [V]"), empty when it does not
  std::vector<double> values;
  std::string clock = {};  // what its stamps are: "header", "receive", "sampled", "synthetic"; empty: not known
};

// Something that was noticed or repaired while reading: never silent, always counted.
struct Finding {
  std::string kind;         // "missing", "repeated_stamp", "time_reversal", "gap", "saturation", "wrap", ...
  std::string column = {};  // empty: the whole row
  std::size_t count = 0;
  std::size_t first_row = 0;  // row index of the first one, 0-based
  std::string text = {};      // one sentence for the user, saying what was done about it
};

// Row `row` stands on line `line` (1-based) of the file, and the rows after it on the lines after it, one each, up to
// the next anchor. Comments, blank lines and formats with many rows to a line start a new anchor.
struct LineAnchor {
  std::size_t row = 0, line = 1;
};

struct Log {
  std::string path;
  std::string format;  // LogReader::name
  std::vector<Column> columns;
  std::map<std::string, double> header;            // numbers of the header, by name
  std::map<std::string, std::string> header_text;  // texts of the header, by name
  std::string rig;                                 // what the header says it was recorded on; empty: nothing
  std::string time_column;                         // that the file itself names as the time; empty: it does not
  bool joined = false;                             // of several rates: NaN where a rate has no row
  std::vector<Finding> findings;
  std::vector<LineAnchor> lines;  // ascending in row; empty: a format without lines
  std::size_t header_line = 1;    // where the columns' names are; 0: a format without lines

  std::size_t rows() const { return columns.empty() ? 0 : columns.front().values.size(); }
  // The column of that name, or null. The first one when the file repeats a name (reported as a finding). "voltage",
  // "voltage [V]" and "voltage (V)" all find the column whose heading was "voltage [V]".
  const Column* Find(std::string_view name) const;
  std::vector<std::string> ColumnNames() const;
  // "path:line" of a row, or of the names, for error messages; "path: row 17" (from 1) and "path" without lines.
  std::string Where(std::size_t row) const;
  std::string WhereHeader() const;
};

// A format: its name in Log::format and in experiment files, and its reader.
struct LogReader {
  const char* name;
  bool (*matches)(const std::string& path, std::string_view bytes);  // by its content or extension
  Result<Log> (*read)(const std::string& path, std::string_view bytes);
};
// All formats, in the order in which a file of none in particular is offered to them; the last takes every one.
std::span<const LogReader> LogReaders();

// A second file that belongs to the log and is paired with it row by row: its path is the log's path with the last
// `find` in its file name replaced by `replace`; its columns are named `prefix` + name.
struct Companion {
  std::string find, replace, prefix;
};

struct ReadOptions {
  const LogReader* format = nullptr;  // of LogReaders(); null: the first that matches
  std::vector<Companion> companions = {};
  std::string source = {};  // what to take of a file of another tool (foreign.h), a JSON object; empty: all
};

// Reads a log. Errors name file and line (and column): absent, empty, binary, UTF-16, no header, wrong number of
// fields, not a number, unterminated quote, endless line, invalid JSON, unequal companion, more than 10^9 values.
// Companions whose rows differ by one are cut to the shorter file (Finding "companion_rows").
Result<Log> ReadLog(const std::string& path, const ReadOptions& options);

}  // namespace gapscope

#endif  // GAPSCOPE_LOG_LOG_H_
