#include "src/log/log.h"

#include <fmt/format.h>

#include <algorithm>
#include <filesystem>
#include <new>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/log/bam_reader.h"
#include "src/log/csv_reader.h"
#include "src/log/foreign.h"
#include "src/log/list_reader.h"
#include "src/log/log_files.h"
#include "src/log/npz_reader.h"
#include "src/log/text.h"

namespace gapscope {
namespace {

// A new format is a reader and a row here, before the last.
constexpr LogReader kReaders[] = {
    {"npz", LooksLikeZip, ReadNpz},
    {"bam_json", LooksLikeJson, ReadBamJson},
    {"csv_lists", LooksLikeLists, ReadCsvLists},
    {"csv", [](const std::string&, std::string_view) { return true; }, ReadCsv},
};

Result<Log> ReadOne(const std::string& path, const LogReader* format) {
  GS_ASSIGN(const MappedFile file, MappedFile::Open(path));
  const std::string_view bytes = file.bytes();
  if (!format) format = std::ranges::find_if(kReaders, [&](const auto& reader) { return reader.matches(path, bytes); });
  try {
    GS_ASSIGN(Log log, format->read(path, bytes));
    log.format = format->name;
    return log;
  } catch (const std::bad_alloc&) {
    return Error{.what = "not enough memory for this log",
                 .where = At(path, 1),
                 .actual = fmt::format("{} bytes", bytes.size()),
                 .allowed = "",
                 .cure = "split it, or leave out columns"};
  }
}

// Pairs the rows of `other` with those of `log`.
Status Join(const Companion& companion, Log other, Log* log) {
  const std::size_t own = log->rows(), theirs = other.rows();
  if (own > theirs + 1 || theirs > own + 1) {
    return Error{.what = "two files that belong together have different numbers of rows",
                 .where = At(log->path, log->header_line),
                 .actual = fmt::format("{} rows here, {} in {}", own, theirs, other.path),
                 .allowed = "equal numbers, or one more in one of them",
                 .cure = "are they of the same run?"};
  }
  if (own != theirs) {
    const std::size_t rows = std::min(own, theirs);
    for (auto& column : log->columns) column.values.resize(rows);
    for (auto& column : other.columns) column.values.resize(rows);
    log->findings.push_back(
        {"companion_rows", "", 1, rows,
         fmt::format("{} rows here, {} in {}; the extra last row was cut off", own, theirs, other.path)});
  }
  for (auto& column : other.columns) {
    column.name = companion.prefix + column.name;
    log->columns.push_back(std::move(column));
  }
  for (const auto& [key, value] : other.header) log->header.emplace(companion.prefix + key, value);
  for (const auto& [key, value] : other.header_text) log->header_text.emplace(companion.prefix + key, value);
  for (auto& finding : other.findings) {
    if (!finding.column.empty()) finding.column = companion.prefix + finding.column;
    finding.text = other.path + ": " + finding.text;
    log->findings.push_back(std::move(finding));
  }
  return Ok();
}

bool EqualApartFromBlanks(std::string_view a, std::string_view b) {
  std::size_t i = 0, j = 0;
  while (true) {
    while (i < a.size() && a[i] == ' ') ++i;
    while (j < b.size() && b[j] == ' ') ++j;
    if (i == a.size() || j == b.size()) return i == a.size() && j == b.size();
    if (a[i++] != b[j++]) return false;
  }
}

}  // namespace

std::span<const LogReader> LogReaders() { return kReaders; }

const Column* Log::Find(std::string_view name) const {
  for (const auto& column : columns) {
    if (column.name == name) return &column;
  }
  for (const auto& column : columns) {
    if (column.unit.empty()) continue;
    if (EqualApartFromBlanks(column.name + "[" + column.unit + "]", name) ||
        EqualApartFromBlanks(column.name + "(" + column.unit + ")", name)) {
      return &column;
    }
  }
  return nullptr;
}

std::vector<std::string> Log::ColumnNames() const { return Collect(columns, &Column::name); }

std::string Log::Where(std::size_t row) const {
  if (header_line == 0) return fmt::format("{}: row {}", path, row + 1);
  const auto after =
      std::upper_bound(lines.begin(), lines.end(), row, [](std::size_t r, const LineAnchor& a) { return r < a.row; });
  if (after == lines.begin()) return At(path, header_line);
  const LineAnchor& anchor = *(after - 1);
  return At(path, anchor.line + (row - anchor.row));
}

std::string Log::WhereHeader() const { return header_line == 0 ? path : At(path, header_line); }

Result<Log> ReadLog(const std::string& given, const ReadOptions& options) {
  const ForeignFormat* foreign = options.format ? nullptr : ForeignFormatOf(given);
  if (foreign) return ReadForeign(given, *foreign, options.source);
  const std::string path = StateFileOf(given);
  GS_ASSIGN(Log log, ReadOne(path, options.format));
  if (options.companions.empty() && log.format == std::string_view("csv_lists")) GS_RETURN_IF_ERROR(JoinControl(&log));
  for (const auto& companion : options.companions) {
    GS_ASSIGN(const std::string other_path, CompanionPath(path, companion));
    Result<Log> other = ReadOne(other_path, options.format);
    if (!other.ok()) {
      Error error = other.error();
      error.what = "the file that belongs to " + path + " cannot be used: " + error.what;
      return error;
    }
    GS_RETURN_IF_ERROR(Join(companion, std::move(other).value(), &log));
  }
  return log;
}

}  // namespace gapscope
