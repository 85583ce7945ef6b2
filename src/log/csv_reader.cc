#include "src/log/csv_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <array>
#include <charconv>
#include <cmath>
#include <cstring>
#include <utility>
#include <vector>

#include "src/core/statistics.h"
#include "src/log/csv_dialect.h"
#include "src/log/csv_fields.h"
#include "src/log/decimal.h"
#include "src/log/text.h"

namespace gapscope {
namespace {

// How often something was met, and the row of the first.
struct Tally {
  std::size_t count = 0, first_row = 0, first_line = 0;
  void Add(std::size_t row, std::size_t line) {
    if (count++ == 0) first_row = row, first_line = line;
  }
};

class BodyReader {
 public:
  BodyReader(const std::string& path, std::string_view bytes, const CsvDialect& dialect, Log* log)
      : path_(path),
        bytes_(bytes),
        dialect_(dialect),
        log_(log),
        end_(bytes.data() + bytes.size()),
        line_(dialect.body_line),
        missing_(dialect.names.size()),
        infinite_(dialect.names.size()),
        words_(dialect.names.size()) {}

  Status Read() {
    Reserve();
    GS_RETURN_IF_ERROR(dialect_.delimiter == kBlanks ? ReadLines<true>() : ReadLines<false>());
    if (row_ == 0) {
      return Error{.what = "no rows after the line of names",
                   .where = At(path_, dialect_.header_line),
                   .actual = "0 rows",
                   .allowed = "one row of numbers per sample",
                   .cure = "was the recording stopped before anything was written?"};
    }
    if (decimal_comma_.count > 0) GS_RETURN_IF_ERROR(CheckNoDecimalPoint());
    Report();
    return Ok();
  }

 private:
  // Room for as many rows as the first ones let expect. Every row takes at least one byte per column, so that no file
  // makes us reserve more than eight times its size.
  void Reserve() {
    const std::string_view body = bytes_.substr(dialect_.body_offset), first = body.substr(0, 1 << 20);
    const auto ends = static_cast<double>(std::count(first.begin(), first.end(), '\n'));
    const double times = first.empty() ? 0 : static_cast<double>(body.size()) / static_cast<double>(first.size());
    const std::size_t expected = static_cast<std::size_t>(1.02 * ends * times) + 2;
    const std::size_t rows = std::min(expected, body.size() / dialect_.names.size() + 1);
    for (std::size_t c = 0; c < dialect_.names.size(); ++c) {
      log_->columns.push_back({dialect_.names[c], dialect_.units[c], {}});
      log_->columns.back().values.reserve(rows);
    }
    for (auto& column : log_->columns) columns_.push_back(&column.values);
  }

  template <bool kBlankDelimiter>
  Status ReadLines() {
    const char* p = bytes_.data() + dialect_.body_offset;
    while (p < end_) {
      const char* line_start = p;
      p = SkipBlanks<kBlankDelimiter>(p);
      if (p == end_) break;
      if (IsEnd(*p)) {  // a blank line
        p = NextLine(p);
        continue;
      }
      if (*p == '#' || *p == '%' || *p == '/') {
        const std::string_view rest(p, std::min<std::size_t>(2, static_cast<std::size_t>(end_ - p)));
        if (IsCsvComment(rest)) {
          comments_.Add(row_, line_);
          p = NextLine(LineEnd(p));
          continue;
        }
      }
      bool header = false;
      GS_RETURN_IF_ERROR(ReadRow<kBlankDelimiter>(line_start, &p, &header));
      if (header) {
        headers_.Add(row_, line_);
        p = NextLine(LineEnd(line_start));
        continue;
      }
      if (log_->lines.empty() || line_ != log_->lines.back().line + (row_ - log_->lines.back().row)) {
        log_->lines.push_back({row_, line_});
      }
      ++row_;
      if (p < end_) p = NextLine(p);
    }
    return Ok();
  }

  // The fields of one line, `*at` at the first; it becomes the line's end. `header`: the line is the header once more,
  // and no row.
  template <bool kBlankDelimiter>
  Status ReadRow(const char* line_start, const char** at, bool* header) {
    const char* p = *at;
    const char delimiter = dialect_.delimiter;
    std::size_t c = 0;
    const std::size_t columns = columns_.size();
    while (true) {
      if (c == columns) return WrongCount(line_start);
      double value = 0;
      const auto [q, failure] = ReadDecimal(p, end_, value);
      const char* stop = q;
      if (failure == std::errc{}) stop = SkipBlanks<kBlankDelimiter>(q);
      const bool closed = stop == end_ || IsEnd(*stop) || (kBlankDelimiter ? stop != q : *stop == delimiter);
      if (failure == std::errc{} && closed && std::isfinite(value)) [[likely]] {
        columns_[c]->push_back(value);
        p = stop;
      } else if (const char* comma_stop = DecimalComma<kBlankDelimiter>(p, q, &value)) {
        columns_[c]->push_back(value);
        decimal_comma_.Add(row_, line_);
        p = comma_stop;
      } else {
        const std::string_view rest(p, static_cast<std::size_t>(end_ - p));
        const FieldText field = FieldAt(rest, 0, delimiter);
        if (c == 0 && IsHeaderAgain(line_start)) {
          *header = true;
          return Ok();
        }
        GS_RETURN_IF_ERROR(SlowField(field, c));
        p = SkipBlanks<kBlankDelimiter>(p + field.end);
      }
      ++c;
      if (p == end_ || IsEnd(*p)) break;
      if constexpr (!kBlankDelimiter) p = SkipBlanks<kBlankDelimiter>(p + 1);  // the delimiter
      // A line that ends with its delimiter has one more, empty field.
      if (!kBlankDelimiter && (p == end_ || IsEnd(*p))) {
        if (c == columns) {
          trailing_.Add(row_, line_);
        } else {
          columns_[c]->push_back(kNaN);
          missing_[c].Add(row_, line_);
          ++c;
        }
        break;
      }
    }
    if (c != columns) return WrongCount(line_start);
    *at = p;
    return Ok();
  }

  // A number "1,5" from `p` on, whose comma is at `comma`, between delimiters that are no commas: read with a point
  // instead. Returns what follows it, or null when it is not such a number.
  template <bool kBlankDelimiter>
  const char* DecimalComma(const char* p, const char* comma, double* value) const {
    std::array<char, 64> text;
    const auto whole = static_cast<std::size_t>(comma - p);
    if (dialect_.delimiter == ',' || comma == end_ || *comma != ',' || comma == p || whole + 1 >= text.size())
      return nullptr;
    const std::size_t size = std::min(text.size(), static_cast<std::size_t>(end_ - p));
    std::memcpy(text.data(), p, size);
    text[whole] = '.';
    const auto [q, failure] = std::from_chars(text.data(), text.data() + size, *value);
    const auto used = static_cast<std::size_t>(q - text.data());
    if (failure != std::errc{} || used <= whole || used == text.size() || !std::isfinite(*value)) return nullptr;
    const char* stop = SkipBlanks<kBlankDelimiter>(p + used);
    const bool closed =
        stop == end_ || IsEnd(*stop) || (kBlankDelimiter ? stop != p + used : *stop == dialect_.delimiter);
    return closed ? stop : nullptr;
  }

  static bool IsEnd(char c) { return c == '\n' || c == '\r'; }

  template <bool kBlankDelimiter>
  const char* SkipBlanks(const char* p) const {
    if (p < end_ && *p > ' ') return p;  // as nearly always
    while (p < end_ && (*p == ' ' || (*p == '\t' && (kBlankDelimiter || dialect_.delimiter != '\t')))) ++p;
    return p;
  }
  const char* LineEnd(const char* p) const {
    while (p < end_ && !IsEnd(*p)) ++p;
    return p;
  }
  // `p` at a line's end.
  const char* NextLine(const char* p) {
    ++line_;
    if (p == end_) return p;
    return *p == '\r' && p + 1 < end_ && p[1] == '\n' ? p + 2 : p + 1;
  }
  std::string_view LineText(const char* start) const {
    return {start, static_cast<std::size_t>(LineEnd(start) - start)};
  }
  bool IsHeaderAgain(const char* start) const {
    const std::string_view rest(start, static_cast<std::size_t>(end_ - start));
    return rest.starts_with(dialect_.header_text) && LineText(start) == dialect_.header_text;
  }

  std::string Here(std::size_t column) const {
    return fmt::format("{}:{}, column {}", path_, line_, dialect_.names[column]);
  }

  // A field that is not simply a number.
  Status SlowField(const FieldText& field, std::size_t c) {
    if (field.unterminated) {
      return Error{.what = "a quote without its partner",
                   .where = Here(c),
                   .actual = Quoted(field.text),
                   .allowed = "\"1.5\" on one line",
                   .cure = "close the quote; was the file cut off?"};
    }
    const FieldValue value = ParseField(field.text, dialect_.delimiter != ',' || field.quoted);
    double stored = kNaN;
    switch (value.kind) {
      case FieldKind::kNumber:
        stored = value.value;
        if (value.decimal_comma) decimal_comma_.Add(row_, line_);
        break;
      case FieldKind::kMissing:
        missing_[c].Add(row_, line_);
        break;
      case FieldKind::kInfinite:
        infinite_[c].Add(row_, line_);
        break;
      case FieldKind::kTooLarge:
        return Error{.what = "a number too large",
                     .where = Here(c),
                     .actual = Quoted(field.text),
                     .allowed = "at most 1.8e308 in size",
                     .cure = "leave the field empty where the value is unknown"};
      case FieldKind::kText:
        if (!dialect_.is_text[c]) return NotANumber(field.text, c);
        words_[c].Add(row_, line_);
        break;
    }
    columns_[c]->push_back(stored);
    return Ok();
  }

  Error NotANumber(std::string_view text, std::size_t c) const {
    std::string cure = "correct it, or leave the field empty where the value is missing";
    if (text.find(':') != std::string_view::npos || std::count(text.begin(), text.end(), '-') >= 2) {
      cure = "is this a date? Write time as a number of seconds";
    } else if (text.find(',') != std::string_view::npos) {
      cure = "write numbers without thousands separators, with one decimal point (or one decimal comma throughout)";
    } else if (std::any_of(text.begin(), text.end(), [](char k) { return k == ';' || k == '|'; })) {
      cure = "use one separator throughout the file";
    }
    return Error{.what = "not a number",
                 .where = Here(c),
                 .actual = Quoted(text),
                 .allowed = "a number, true, false, or nothing for a missing value",
                 .cure = cure};
  }

  Error WrongCount(const char* line_start) const {
    bool unterminated = false;
    const std::string_view text = LineText(line_start);
    const std::string_view head = text.substr(0, 1 << 20);
    const std::size_t fields = SplitLine(head, dialect_.delimiter, &unterminated).size();
    const std::size_t columns = columns_.size();
    std::string cure = "give every row as many fields as there are names (empty ones for missing values)";
    const bool last = LineEnd(line_start) == end_;
    if (last && fields < columns) {
      cure = "the file ends in the middle of a row: delete its last line";
    } else if (dialect_.delimiter == ',' && (fields == 2 * columns || fields == 2 * columns - 1)) {
      cure = "are these decimal commas? Export with ';' between the fields, or with decimal points";
    }
    return Error{
        .what = "wrong number of fields",
        .where = At(path_, line_),
        .actual = fmt::format("{}{} fields: {}", head.size() < text.size() ? "more than " : "", fields, Quoted(text)),
        .allowed = fmt::format("{}, as on line {}", columns, dialect_.header_line),
        .cure = cure};
  }

  // "1,5" in one place and "0.5" in another: one of them is not what it seems.
  Status CheckNoDecimalPoint() const {
    const std::string_view body = bytes_.substr(dialect_.body_offset);
    if (std::memchr(body.data(), '.', body.size()) == nullptr) return Ok();
    std::size_t number = dialect_.body_line;
    for (std::size_t offset = dialect_.body_offset; offset < bytes_.size(); ++number) {
      const Line line = LineAt(bytes_, offset);
      offset = line.next;
      const std::string_view text = TrimBlanks(line.text);
      if (IsCsvComment(text) || text == TrimBlanks(dialect_.header_text)) continue;
      const std::size_t point = text.find('.');
      if (point == std::string_view::npos || text.find_first_of("0123456789", point) != point + 1) continue;
      // A point within a column of words does not count.
      bool among_numbers = false;
      const auto fields = SplitLine(text, dialect_.delimiter, nullptr);
      for (std::size_t c = 0; c < std::min(fields.size(), columns_.size()); ++c) {
        among_numbers |= !dialect_.is_text[c] && fields[c].find('.') != std::string::npos;
      }
      if (!among_numbers) continue;
      return Error{.what = "decimal points and decimal commas in one file",
                   .where = At(path_, number),
                   .actual = fmt::format("a point here, a comma on line {}", decimal_comma_.first_line),
                   .allowed = "one of them throughout",
                   .cure = "export the log again with decimal points and without thousands separators"};
    }
    return Ok();
  }

  void Report() {
    auto& findings = log_->findings;
    const auto add = [&](const char* kind, const std::string& column, const Tally& tally, std::string text) {
      if (tally.count > 0) findings.push_back({kind, column, tally.count, tally.first_row, std::move(text)});
    };
    add("decimal_comma", "", decimal_comma_,
        fmt::format("{} numbers were read with a decimal comma (first: line {})", decimal_comma_.count,
                    decimal_comma_.first_line));
    add("comment", "", comments_,
        fmt::format("{} comment lines among the rows were skipped (first: line {})", comments_.count,
                    comments_.first_line));
    add("repeated_header", "", headers_,
        fmt::format("the line of names comes again {} times (first: line {}); skipped: were several recordings joined?",
                    headers_.count, headers_.first_line));
    add("trailing_delimiter", "", trailing_,
        fmt::format("{} rows end with a separator and nothing behind it (first: line {}); ignored", trailing_.count,
                    trailing_.first_line));
    for (std::size_t c = 0; c < columns_.size(); ++c) {
      const std::string& name = dialect_.names[c];
      add("missing", name, missing_[c],
          fmt::format("no value in {} of {} rows (first: line {})", missing_[c].count, row_, missing_[c].first_line));
      add("infinite", name, infinite_[c],
          fmt::format("'inf' in {} of {} rows (first: line {}); taken as missing", infinite_[c].count, row_,
                      infinite_[c].first_line));
      add("text_column", name, words_[c],
          fmt::format("holds words in {} of {} rows; the column cannot be used", words_[c].count, row_));
    }
    DropEmptyLastColumn();
  }

  // "t,x," over "0,1,": the last separator makes a column that is not one.
  void DropEmptyLastColumn() {
    const std::size_t last = columns_.size() - 1;
    if (last < 2 || missing_[last].count != row_ || dialect_.names[last] != fmt::format("column_{}", last + 1)) return;
    log_->columns.pop_back();
    std::erase_if(log_->findings, [&](const Finding& f) { return f.column == dialect_.names[last]; });
    log_->findings.push_back(
        {"trailing_delimiter", "", row_ + 1, 0, "every line ends with a separator and nothing behind it; ignored"});
  }

  const std::string& path_;
  const std::string_view bytes_;
  const CsvDialect& dialect_;
  Log* const log_;
  const char* const end_;
  std::vector<std::vector<double>*> columns_;
  std::size_t row_ = 0, line_ = 1;
  Tally decimal_comma_, comments_, headers_, trailing_;
  std::vector<Tally> missing_, infinite_, words_;
};

}  // namespace

Result<Log> ReadCsv(const std::string& path, std::string_view bytes) {
  GS_RETURN_IF_ERROR(CheckText(path, bytes));
  GS_ASSIGN(const CsvDialect dialect, DetectCsvDialect(path, bytes));
  Log log;
  log.path = path;
  log.header_line = dialect.header_line;
  log.findings = dialect.findings;
  GS_RETURN_IF_ERROR(BodyReader(path, bytes, dialect, &log).Read());
  return log;
}

}  // namespace gapscope
