#include "src/log/csv_dialect.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <set>

#include "src/core/units.h"
#include "src/log/csv_fields.h"
#include "src/log/text.h"
#include "src/log/time_column.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostColumns = 10'000;
constexpr std::size_t kLongestLine = 1 << 20;
constexpr std::size_t kSampleLines = 50;

constexpr const char* kHeaderCure = "put a line with the columns' names first, such as: time_s,voltage_v,arm_rad";

struct NumberedLine {
  std::string_view text;
  std::size_t line = 1, next = 0;  // number; offset of the following line
};

// rostopic's "%time,field.x" is a line of names, other lines with '%' are comments.
bool IsRosHeader(std::string_view line) {
  if (!line.starts_with('%')) return false;
  const std::string_view first = line.substr(1, line.find_first_of(",;\t") - 1);
  return first.size() < line.size() - 1 && IsTimeName(first);
}

bool IsNumeric(const std::string& field) {
  const FieldKind kind = ParseField(field, true).kind;
  return kind == FieldKind::kNumber || kind == FieldKind::kInfinite || kind == FieldKind::kTooLarge;
}

std::size_t CountFields(std::string_view line, char delimiter) {
  std::vector<std::string> fields = SplitLine(line, delimiter, nullptr);
  return fields.size();
}

// Mostly numbers: a row of data, not of names.
bool LooksLikeData(const std::vector<std::string>& fields) {
  std::size_t numbers = 0, filled = 0;
  for (const auto& field : fields) {
    filled += !field.empty();
    numbers += IsNumeric(field) || (!field.empty() && ParseField(field, true).kind == FieldKind::kMissing);
  }
  return filled > 0 && 2 * numbers > filled;
}

char ChooseDelimiter(std::string_view header, const std::vector<NumberedLine>& sample) {
  constexpr std::array kCandidates = {'\t', ';', ',', kBlanks};
  char best = ',';
  std::size_t best_score = 0;
  for (const char candidate : kCandidates) {
    const std::size_t names = CountFields(header, candidate);
    if (names < 2) continue;
    std::size_t matches = 0;
    for (const auto& line : sample) {
      const std::size_t fields = CountFields(line.text, candidate);
      matches += fields == names || fields == names + 1;
    }
    // All lines agree: take it. Otherwise the one with most agreement; the earlier one on a tie.
    if (!sample.empty() && matches == sample.size()) return candidate;
    if (1 + matches > best_score) {
      best = candidate;
      best_score = 1 + matches;
    }
  }
  return best;
}

std::string_view StripBrackets(std::string_view text) {
  if (text.size() >= 2 &&
      ((text.front() == '[' && text.back() == ']') || (text.front() == '(' && text.back() == ')'))) {
    return TrimBlanks(text.substr(1, text.size() - 2));
  }
  return text;
}

enum class RowKind { kData, kMetadata, kUnits };

// A line below the names: "Unit: V" cells of Simulink Data Inspector (with Type:, Interp: ... beside them), a row of
// plain units, or data.
RowKind ClassifyRow(const std::vector<std::string>& fields) {
  std::size_t filled = 0, tagged = 0, units = 0;
  for (const auto& field : fields) {
    if (field.empty()) continue;
    if (IsNumeric(field)) return RowKind::kData;
    ++filled;
    const std::size_t colon = field.find(':');
    tagged += colon != std::string::npos && colon > 1 &&
              std::all_of(field.begin(), field.begin() + static_cast<std::ptrdiff_t>(colon),
                          [](char c) { return (c >= 'A' && c <= 'Z') || (c >= 'a' && c <= 'z') || c == ' '; });
    units += LooksLikeUnit(StripBrackets(field));
  }
  if (filled == 0) return RowKind::kData;
  if (tagged == filled) return RowKind::kMetadata;
  return 2 * units > filled ? RowKind::kUnits : RowKind::kData;
}

void TakeUnits(const std::vector<std::string>& fields, RowKind kind, std::vector<std::string>* units) {
  for (std::size_t c = 0; c < std::min(fields.size(), units->size()); ++c) {
    std::string_view field = fields[c];
    if (kind == RowKind::kMetadata) {
      if (!ToLower(field.substr(0, 5)).starts_with("unit:")) continue;
      field = TrimBlanks(field.substr(5));
    }
    field = StripBrackets(field);
    if (!field.empty() && field != "-") (*units)[c] = field;
  }
}

// The first lines of a file, comments and blank lines apart.
struct Preamble {
  NumberedLine header;
  std::vector<NumberedLine> sample;  // lines after `header`
  NumberedLine last_comment;         // the comment just before `header`, if any
  char delimiter = '\0';             // of a "sep=;" line, as spreadsheets write it
};

Result<Preamble> ReadPreamble(const std::string& path, std::string_view bytes) {
  Preamble preamble;
  std::size_t offset = BomSize(bytes), number = 1;
  bool found = false;
  for (; offset < bytes.size() && preamble.sample.size() < kSampleLines; ++number) {
    const Line line = LineAt(bytes, offset);
    if (line.text.size() > kLongestLine) {
      return Error{.what = "a line without end",
                   .where = At(path, number),
                   .actual = fmt::format("{} bytes", line.text.size()),
                   .allowed = fmt::format("at most {} bytes", kLongestLine),
                   .cure = "is this a log in CSV, one row to a line?"};
    }
    const NumberedLine numbered{line.text, number, line.next};
    offset = line.next;
    const std::string_view trimmed = TrimBlanks(line.text);
    if (trimmed.empty()) continue;
    if (!found && number == 1 && trimmed.size() == 5 && ToLower(trimmed).starts_with("sep=")) {
      preamble.delimiter = trimmed[4];
      continue;
    }
    if (!found && number == 1 && ToLower(trimmed) == "sep=") {  // "sep=<tab>", the tab trimmed
      preamble.delimiter = '\t';
      continue;
    }
    if (IsCsvComment(trimmed) && (found || !IsRosHeader(trimmed))) {
      if (!found) preamble.last_comment = numbered;
      continue;
    }
    if (!found) {
      preamble.header = numbered;
      found = true;
    } else {
      preamble.sample.push_back(numbered);
    }
  }
  if (!found) {
    return Error{.what = "the log has comments only",
                 .where = At(path, 1),
                 .actual = "",
                 .allowed = "a line of names and rows of numbers",
                 .cure = kHeaderCure};
  }
  return preamble;
}

// numpy.savetxt writes its names as a comment above the numbers: "# t,x".
bool HeaderFromComment(const Preamble& preamble, CsvDialect* dialect) {
  std::string_view text = preamble.last_comment.text;
  text.remove_prefix(std::min(text.find_first_not_of(" \t#%/"), text.size()));
  if (text.empty()) return false;
  const std::vector<NumberedLine> rows = {preamble.header};
  const char delimiter = preamble.delimiter != '\0' ? preamble.delimiter : ChooseDelimiter(text, rows);
  const auto names = SplitLine(text, delimiter, nullptr);
  if (names.size() < 2 || names.size() != CountFields(preamble.header.text, delimiter) || LooksLikeData(names))
    return false;
  dialect->delimiter = delimiter;
  dialect->names = names;
  dialect->header_text = preamble.last_comment.text;
  dialect->header_line = preamble.last_comment.line;
  dialect->body_offset = preamble.last_comment.next;
  dialect->body_line = preamble.last_comment.line + 1;
  dialect->findings.push_back(
      {.kind = "header_comment",
       .column = "",
       .count = 1,
       .first_row = 0,
       .text = fmt::format("the columns' names were taken from the comment on line {}", dialect->header_line)});
  return true;
}

Status CheckNames(const std::string& path, CsvDialect* dialect) {
  const std::string where = At(path, dialect->header_line);
  if (dialect->names.size() < 2) {
    return Error{.what = "the log has only one column",
                 .where = where,
                 .actual = Quoted(dialect->header_text),
                 .allowed = "two or more columns, separated by ',', ';', tab or blanks",
                 .cure = "check the separator"};
  }
  if (dialect->names.size() > kMostColumns) {
    return Error{.what = "too many columns",
                 .where = where,
                 .actual = std::to_string(dialect->names.size()),
                 .allowed = fmt::format("at most {}", kMostColumns),
                 .cure = "is this a log in CSV, one row to a line?"};
  }
  std::set<std::string> seen;
  for (std::size_t c = 0; c < dialect->names.size(); ++c) {
    std::string& name = dialect->names[c];
    if (!IsUtf8(name)) {
      return Error{.what = fmt::format("the name of column {} is not UTF-8", c + 1),
                   .where = where,
                   .actual = Quoted(name),
                   .allowed = "UTF-8",
                   .cure = "convert it: iconv -f WINDOWS-1252 -t UTF-8 FILE > log.csv"};
    }
    const std::string heading = name;
    SplitHeading(heading, &name, &dialect->units[c]);
    if (name.empty()) {
      name = fmt::format("column_{}", c + 1);
      dialect->findings.push_back({.kind = "unnamed_column",
                                   .column = name,
                                   .count = 1,
                                   .first_row = 0,
                                   .text = fmt::format("column {} has no name; it is called '{}'", c + 1, name)});
    }
    if (!seen.insert(name).second) {
      dialect->findings.push_back(
          {.kind = "duplicate_name",
           .column = name,
           .count = 1,
           .first_row = 0,
           .text = fmt::format("column {} has the name '{}' of an earlier one; the first is used", c + 1, name)});
    }
  }
  return Ok();
}

// Columns that hold words in each of the first rows.
void FindTextColumns(const std::vector<NumberedLine>& sample, std::size_t first, CsvDialect* dialect) {
  std::vector<std::size_t> words(dialect->names.size()), filled(dialect->names.size());
  for (std::size_t k = first; k < sample.size(); ++k) {
    const auto fields = SplitLine(sample[k].text, dialect->delimiter, nullptr);
    if (fields.size() < dialect->names.size() || sample[k].text == dialect->header_text) continue;
    for (std::size_t c = 0; c < dialect->names.size(); ++c) {
      filled[c] += !fields[c].empty();
      words[c] += ParseField(fields[c], true).kind == FieldKind::kText;
    }
  }
  for (std::size_t c = 0; c < dialect->names.size(); ++c) {
    dialect->is_text[c] = words[c] >= 3 && words[c] == filled[c] && !IsTimeName(dialect->names[c]);
  }
}

}  // namespace

void SplitHeading(std::string_view heading, std::string* name, std::string* unit) {
  *name = heading;
  unit->clear();
  if (heading.empty()) return;
  const char close = heading.back();
  const char open = close == ']' ? '[' : close == ')' ? '(' : '\0';
  if (open == '\0') return;
  const std::size_t at = heading.rfind(open);
  if (at == std::string_view::npos || TrimBlanks(heading.substr(0, at)).empty()) return;
  const std::string_view inside = TrimBlanks(heading.substr(at + 1, heading.size() - at - 2));
  const bool index = !inside.empty() && inside.find_first_not_of("0123456789") == std::string_view::npos;
  if (open == '[' ? index : !LooksLikeUnit(inside)) return;
  *name = TrimBlanks(heading.substr(0, at));
  *unit = inside;
}

bool IsCsvComment(std::string_view line) {
  return line.starts_with('#') || line.starts_with('%') || line.starts_with("//");
}

Result<CsvDialect> DetectCsvDialect(const std::string& path, std::string_view bytes) {
  GS_ASSIGN(const Preamble preamble, ReadPreamble(path, bytes));
  CsvDialect dialect;
  const NumberedLine& header = preamble.header;
  dialect.delimiter = preamble.delimiter != '\0' ? preamble.delimiter : ChooseDelimiter(header.text, preamble.sample);

  bool unterminated = false;
  dialect.names = SplitLine(header.text, dialect.delimiter, &unterminated);
  if (unterminated) {
    return Error{.what = "a quote without its partner",
                 .where = At(path, header.line),
                 .actual = Quoted(header.text),
                 .allowed = "\"name\" on one line, a quote inside written twice",
                 .cure = "close the quote"};
  }
  std::size_t first_sample = 0;
  if (LooksLikeData(dialect.names)) {
    if (!HeaderFromComment(preamble, &dialect)) {
      return Error{.what = "no line of column names",
                   .where = At(path, header.line),
                   .actual = Quoted(header.text),
                   .allowed = "names before the first row of numbers",
                   .cure = kHeaderCure};
    }
  } else {
    dialect.header_text = header.text;
    dialect.header_line = header.line;
    dialect.body_offset = header.next;
    dialect.body_line = header.line + 1;
  }
  dialect.units.resize(dialect.names.size());
  dialect.is_text.resize(dialect.names.size());
  GS_RETURN_IF_ERROR(CheckNames(path, &dialect));

  // Lines of units and other words about the columns, below the names.
  bool units_seen = false;
  const bool names_from_comment = dialect.header_line != header.line;  // then numbers follow at once
  for (; !names_from_comment && first_sample < preamble.sample.size(); ++first_sample) {
    const NumberedLine& line = preamble.sample[first_sample];
    const auto fields = SplitLine(line.text, dialect.delimiter, nullptr);
    const RowKind kind = ClassifyRow(fields);
    if (kind == RowKind::kData || (kind == RowKind::kUnits && units_seen)) break;
    units_seen |= kind == RowKind::kUnits;
    TakeUnits(fields, kind, &dialect.units);
    dialect.body_offset = line.next;
    dialect.body_line = line.line + 1;
  }
  for (const auto& unit : dialect.units) {
    if (!IsUtf8(unit)) {
      return Error{.what = "a unit is not UTF-8",
                   .where = At(path, dialect.header_line),
                   .actual = Quoted(unit),
                   .allowed = "UTF-8",
                   .cure = "convert it: iconv -f WINDOWS-1252 -t UTF-8 FILE > log.csv"};
    }
  }
  FindTextColumns(preamble.sample, first_sample, &dialect);
  return dialect;
}

}  // namespace gapscope
