#include "src/log/list_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>
#include <filesystem>
#include <optional>

#include "src/core/file.h"
#include "src/core/statistics.h"
#include "src/log/csv_fields.h"
#include "src/log/text.h"

namespace gapscope {
namespace {

constexpr std::string_view kState = "state_motor.csv", kControl = "control.csv", kJoints = "joint_list.txt";

// A column of the file: one of the log's, or several where its cells are lists.
struct FileColumn {
  std::string name;
  std::optional<std::size_t> length;  // of its lists; none: numbers
  std::size_t first = 0;              // of the log's columns
  bool words = false;
};

bool IsList(std::string_view cell) { return !cell.empty() && cell.front() == '['; }

char DelimiterOf(std::string_view header) {
  for (const char c : {'\t', ';'}) {
    if (header.find(c) != std::string_view::npos) return c;
  }
  return ',';
}

// The numbers of "[1, 2.5, nan]". Error text without a place: not closed, not a number.
Result<std::vector<double>> ParseList(std::string_view cell) {
  if (cell.back() != ']') return Error{.what = "a list without its ']'", .actual = Quoted(cell)};
  cell = TrimBlanks(cell.substr(1, cell.size() - 2));
  std::vector<double> numbers;
  while (!cell.empty()) {
    const std::size_t end = std::min(cell.find(','), cell.size());
    const std::string_view item = TrimBlanks(cell.substr(0, end));
    const FieldValue value = ParseField(item, false);
    if (value.kind == FieldKind::kText || value.kind == FieldKind::kTooLarge)
      return Error{.what = "not a number in a list", .actual = Quoted(item), .allowed = "numbers between commas"};
    numbers.push_back(value.kind == FieldKind::kNumber ? value.value : kNaN);
    cell.remove_prefix(std::min(end + 1, cell.size()));
  }
  return numbers;
}

// Names of a file beside the log, one a line; empty: there is none.
std::vector<std::string> JointsBeside(const std::string& path) {
  const auto bytes = ReadFile((std::filesystem::path(path).parent_path() / kJoints).string());
  std::vector<std::string> names;
  for (std::size_t offset = 0; bytes.ok() && offset < bytes.value().size();) {
    const Line line = LineAt(bytes.value(), offset);
    if (const auto name = TrimBlanks(line.text); !name.empty() && IsUtf8(name)) names.emplace_back(name);
    offset = line.next;
  }
  return names;
}

class Reader {
 public:
  Reader(const std::string& path, std::string_view bytes) : path_(path), bytes_(bytes), joints_(JointsBeside(path)) {
    log_.path = path;
  }

  Result<Log> Read() {
    Line line = LineAt(bytes_, BomSize(bytes_));
    delimiter_ = DelimiterOf(line.text);
    if (!IsUtf8(line.text)) return Error{.what = "names that are not UTF-8", .where = At(path_, 1)};
    for (std::string& name : SplitLine(line.text, delimiter_, nullptr))
      columns_.push_back({.name = std::string(TrimBlanks(name)), .length = std::nullopt});
    std::size_t number = 1;
    for (std::size_t offset = line.next; offset < bytes_.size(); offset = line.next) {
      line = LineAt(bytes_, offset);
      ++number;
      if (TrimBlanks(line.text).empty()) continue;
      GS_RETURN_IF_ERROR(ReadRow(line.text, number));
    }
    if (rows_ == 0) return Error{.what = "no rows after the line of names", .where = At(path_, 1)};
    std::erase_if(log_.columns, [](const Column& column) { return column.values.empty(); });
    return std::move(log_);
  }

 private:
  Status ReadRow(std::string_view text, std::size_t line) {
    bool unterminated = false;
    const std::vector<std::string> cells = SplitLine(text, delimiter_, &unterminated);
    if (unterminated) return Error{.what = "a quote without its partner", .where = At(path_, line)};
    if (cells.size() != columns_.size()) {
      return Error{.what = "wrong number of fields",
                   .where = At(path_, line),
                   .actual = std::to_string(cells.size()),
                   .allowed = std::to_string(columns_.size()) + ", as on line 1"};
    }
    if (rows_ == 0) GS_RETURN_IF_ERROR(MakeColumns(cells, line));
    for (std::size_t c = 0; c < cells.size(); ++c) GS_RETURN_IF_ERROR(ReadCell(cells[c], columns_[c], line));
    if (log_.lines.empty() || line != log_.lines.back().line + (rows_ - log_.lines.back().row))
      log_.lines.push_back({rows_, line});
    ++rows_;
    return Ok();
  }

  // By the first row.
  Status MakeColumns(const std::vector<std::string>& cells, std::size_t line) {
    for (std::size_t c = 0; c < cells.size(); ++c) {
      FileColumn& column = columns_[c];
      column.first = log_.columns.size();
      if (!IsList(cells[c])) {
        column.words = ParseField(cells[c], false).kind == FieldKind::kText;
        if (column.words) {
          log_.findings.push_back({"text_column", column.name, 1, 0, "holds words; the column cannot be used"});
        } else {
          log_.columns.push_back({column.name, "", {}});
        }
        continue;
      }
      const auto numbers = ParseList(cells[c]);
      if (!numbers.ok()) return Here(numbers.error(), column, line);
      column.length = numbers.value().size();
      if (!joints_.empty() && joints_.size() != *column.length) {
        return Error{
            .what = "the lists of '" + column.name + "' and " + std::string(kJoints) + " differ in length",
            .where = At(path_, line),
            .actual = std::to_string(*column.length) + " numbers, " + std::to_string(joints_.size()) + " names",
            .allowed = "one name a line for each number"};
      }
      for (std::size_t i = 0; i < *column.length; ++i) {
        const std::string end = joints_.empty() ? fmt::format("[{}]", i) : "/" + joints_[i];
        log_.columns.push_back({column.name + end, "", {}});
      }
    }
    if (std::ranges::none_of(columns_, [](const FileColumn& column) { return column.length.has_value(); })) {
      return Error{.what = "no cell holds a list",
                   .where = At(path_, line),
                   .allowed = "cells as \"[0.1, 0.2]\"",
                   .cure = "read it as format csv"};
    }
    return Ok();
  }

  Error Here(Error error, const FileColumn& column, std::size_t line) const {
    error.where = At(path_, line) + ": " + column.name;
    return error;
  }

  Status ReadCell(const std::string& cell, const FileColumn& column, std::size_t line) {
    if (column.words) return Ok();
    if (!column.length) {
      const FieldValue value = ParseField(cell, false);
      if (value.kind == FieldKind::kText || value.kind == FieldKind::kTooLarge)
        return Here({.what = "not a number", .actual = Quoted(cell)}, column, line);
      log_.columns[column.first].values.push_back(value.kind == FieldKind::kNumber ? value.value : kNaN);
      return Ok();
    }
    // A cell without its list: those values are missing.
    std::vector<double> numbers(*column.length, kNaN);
    if (ParseField(cell, false).kind != FieldKind::kMissing) {
      Result<std::vector<double>> parsed =
          IsList(cell) ? ParseList(cell)
                       : Result<std::vector<double>>(Error{.what = "not a list", .actual = Quoted(cell)});
      if (!parsed.ok()) return Here(parsed.error(), column, line);
      numbers = std::move(parsed).value();
    }
    if (numbers.size() != *column.length) {
      return Here({.what = "a list changes its length",
                   .actual = std::to_string(numbers.size()) + " numbers",
                   .allowed = std::to_string(*column.length) + ", as in the first row",
                   .cure = "was the robot or the recorder changed? Split the file there"},
                  column, line);
    }
    for (std::size_t i = 0; i < numbers.size(); ++i) log_.columns[column.first + i].values.push_back(numbers[i]);
    return Ok();
  }

  const std::string& path_;
  const std::string_view bytes_;
  const std::vector<std::string> joints_;
  char delimiter_ = ',';
  std::vector<FileColumn> columns_;
  std::size_t rows_ = 0;
  Log log_;
};

const Column* StampColumn(const Log& log) {
  for (const char* name : {"timestamp", "time", "t"}) {
    if (const Column* column = log.Find(name)) return column;
  }
  return nullptr;
}

}  // namespace

bool LooksLikeLists(const std::string&, std::string_view bytes) {
  const Line header = LineAt(bytes, BomSize(bytes));
  const std::string_view first = LineAt(bytes, header.next).text;
  const std::string_view head = first.substr(0, 1 << 16);
  return head.find("\"[") != std::string_view::npos || head.starts_with('[') ||
         head.find(";[") != std::string_view::npos || head.find("\t[") != std::string_view::npos;
}

Result<Log> ReadCsvLists(const std::string& path, std::string_view bytes) {
  GS_RETURN_IF_ERROR(CheckText(path, bytes));
  return Reader(path, bytes).Read();
}

std::string StateFileOf(const std::string& path) {
  const std::filesystem::path inside = std::filesystem::path(path) / kState;
  std::error_code failed;
  return std::filesystem::is_directory(path, failed) && std::filesystem::exists(inside, failed) ? inside.string()
                                                                                                : path;
}

std::vector<std::string> FilesBesideLists(const std::string& path) {
  std::vector<std::string> files;
  std::error_code failed;
  for (const std::string_view name : {kJoints, kControl}) {
    const auto beside = std::filesystem::path(path).parent_path() / name;
    const bool read = name != kControl || std::filesystem::path(path).filename() == kState;
    if (read && std::filesystem::is_regular_file(beside, failed)) files.push_back(beside.string());
  }
  return files;
}

Status JoinControl(Log* log) {
  const std::filesystem::path path(log->path), other = path.parent_path() / kControl;
  std::error_code failed;
  if (path.filename() != kState || !std::filesystem::exists(other, failed)) return Ok();
  const std::string name = other.string();
  GS_ASSIGN(const std::string bytes, ReadFile(name));
  GS_ASSIGN(const Log control, ReadCsvLists(name, bytes));
  const Column *own = StampColumn(*log), *theirs = StampColumn(control);
  if (!own || !theirs) {
    return Error{.what = "no stamps to pair commands and states by",
                 .where = own ? control.WhereHeader() : log->WhereHeader(),
                 .allowed = "a column 'timestamp' in both files"};
  }
  const std::vector<double> stamps = own->values;
  for (const Column& column : control.columns) {
    if (&column == theirs) continue;
    Column held{.name = "control/" + column.name, .unit = column.unit, .values = {}};
    std::size_t next = 0;
    for (const double stamp : stamps) {
      while (next < theirs->values.size() && !(theirs->values[next] > stamp)) ++next;
      held.values.push_back(next > 0 ? column.values[next - 1] : kNaN);
    }
    log->columns.push_back(std::move(held));
  }
  return Ok();
}

}  // namespace gapscope
