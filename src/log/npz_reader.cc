#include "src/log/npz_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <map>
#include <nlohmann/json.hpp>
#include <optional>
#include <utility>
#include <vector>

#include "src/core/statistics.h"
#include "src/log/csv_dialect.h"
#include "src/log/npy_array.h"
#include "src/log/text.h"
#include "src/log/time_column.h"
#include "src/log/zip.h"

namespace gapscope {
namespace {

using Json = nlohmann::json;
using namespace std::string_view_literals;

constexpr const char* kSchema = "gapscope.log/1";
constexpr std::size_t kMostNpzColumns = 10'000;
// Unpacked bytes of all arrays together. Deflate packs a constant a thousandfold, a log of sensors two- to tenfold.
constexpr std::size_t kAlwaysAllowed = std::size_t{1} << 28, kMostPacking = 100, kMostBytes = std::size_t{8} << 30;
constexpr std::size_t kLongestMeta = std::size_t{1} << 24;

std::string ArrayAt(const std::string& path, const std::string& name) { return path + ": array " + Quoted(name); }

struct NamedArray {
  std::string name;  // without ".npy"
  NpyArray array;
};

// All arrays of an archive, and the unpacked bytes that they are views of.
struct Archive {
  std::vector<std::string> storage;
  std::vector<NamedArray> arrays;

  const NpyArray* Find(std::string_view name) const {
    const auto found = std::ranges::find(arrays, name, &NamedArray::name);
    return found == arrays.end() ? nullptr : &found->array;
  }
};

Result<Archive> ReadArchive(const std::string& path, std::string_view bytes) {
  GS_ASSIGN(const std::vector<ZipMember> members, ReadZipDirectory(path, bytes));
  const std::size_t allowed = std::min(kMostBytes, std::max(kAlwaysAllowed, kMostPacking * bytes.size()));
  std::size_t claimed = 0;
  for (const ZipMember& member : members) claimed += member.size;
  if (claimed > allowed)
    return Error{.what = "an archive that unpacks to more than a log of its size can hold",
                 .where = path + ": archive",
                 .actual = fmt::format("{} bytes from {}", claimed, bytes.size()),
                 .allowed = fmt::format("at most {}", allowed),
                 .cure = "leave out columns, or save it with numpy.savez, which does not pack"};
  Archive archive;
  archive.storage.resize(members.size());
  for (std::size_t i = 0; i < members.size(); ++i) {
    std::string name = members[i].name;
    if (!name.ends_with(".npy")) continue;
    name.resize(name.size() - 4);
    if (!IsUtf8(name)) name = Quoted(name, name.size());
    GS_ASSIGN(const std::string_view data, Unpack(path, members[i], &archive.storage[i]));
    GS_ASSIGN(NpyArray array, ReadNpy(ArrayAt(path, name), data));
    archive.arrays.push_back({std::move(name), std::move(array)});
  }
  if (archive.arrays.empty())
    return Error{.what = "a ZIP archive without an array",
                 .where = path + ": archive",
                 .actual = fmt::format("{} members, none named *.npy", members.size()),
                 .allowed = "an NPZ file, as numpy.savez writes it",
                 .cure = "is this a spreadsheet? Export the log as CSV"};
  return archive;
}

// Adds a column; what is not finite is missing, and counted as readers of text do.
void AddColumn(std::string name, std::string unit, std::vector<double> values, Log* log) {
  Finding missing{"missing", name}, infinite{"infinite", name};
  for (std::size_t row = 0; row < values.size(); ++row) {
    if (std::isfinite(values[row])) continue;
    Finding& finding = std::isnan(values[row]) ? missing : infinite;
    if (finding.count++ == 0) finding.first_row = row;
    values[row] = kNaN;
  }
  missing.text =
      fmt::format("no value in {} of {} rows (first: row {})", missing.count, values.size(), missing.first_row + 1);
  infinite.text = fmt::format("'inf' in {} of {} rows (first: row {}); taken as missing", infinite.count, values.size(),
                              infinite.first_row + 1);
  for (Finding* finding : {&missing, &infinite}) {
    if (finding->count > 0 && !(log->joined && finding == &missing)) log->findings.push_back(std::move(*finding));
  }
  log->columns.push_back({std::move(name), std::move(unit), std::move(values)});
}

// A user's own arrays: which of them make the table.
class OwnArrays {
 public:
  OwnArrays(const std::string& path, const Archive& archive, Log* log) : path_(path), archive_(archive), log_(log) {}

  Status Read() {
    const std::size_t rows = Rows();
    for (const NamedArray& named : archive_.arrays) {
      const NpyArray& array = named.array;
      if (array.is_text()) {
        if (array.shape.empty() && !array.Texts().empty()) log_->header_text[named.name] = array.Texts().front();
      } else if (array.shape.empty()) {
        if (const double value = array.Column(0).front(); std::isfinite(value)) log_->header[named.name] = value;
      } else if (!IsTable(array)) {
        Ignore(named, "no column: it has no, or more than two axes");
      } else if (array.rows() != rows) {
        Ignore(named, fmt::format("no column: the others have {} rows", rows));
      } else {
        GS_RETURN_IF_ERROR(Take(named));
      }
    }
    if (log_->columns.empty())
      return Error{.what = "no array that could be a column",
                   .where = path_ + ": archive",
                   .actual = fmt::format("{} arrays", archive_.arrays.size()),
                   .allowed = "arrays of numbers, a row a sample: np.savez(FILE, time=t, q=q)",
                   .cure = "was the recording stopped before anything was written?"};
    return Ok();
  }

 private:
  static bool IsTable(const NpyArray& array) {
    return !array.is_text() && !array.shape.empty() && array.shape.size() <= 2 && array.rows() > 0 &&
           array.columns() > 0;
  }

  // As many as the time has; where no array is named like one, the greatest number that two arrays share, or that of
  // the longest.
  std::size_t Rows() const {
    std::map<std::size_t, int> counts;
    for (const NamedArray& named : archive_.arrays) {
      if (!IsTable(named.array)) continue;
      if (named.array.columns() == 1 && IsTimeName(named.name)) return named.array.rows();
      ++counts[named.array.rows()];
    }
    for (auto it = counts.rbegin(); it != counts.rend(); ++it) {
      if (it->second > 1) return it->first;
    }
    return counts.empty() ? 0 : counts.rbegin()->first;
  }

  void Ignore(const NamedArray& named, const std::string& reason) {
    log_->findings.push_back(
        {"ignored_array", named.name, 1, 0,
         fmt::format("the array of shape ({}) is {}", fmt::join(named.array.shape, ", "), reason)});
  }

  // What the elements of a row are called: by NAME_names, joint_names or joint_order, if it has as many.
  std::vector<std::string> ElementNames(const NamedArray& named) const {
    for (const std::string& list : {named.name + "_names", std::string("joint_names"), std::string("joint_order")}) {
      const NpyArray* found = archive_.Find(list);
      if (!found || !found->is_text()) continue;
      if (auto names = found->Texts(); names.size() == named.array.columns()) {
        for (std::string& name : names) name.insert(0, named.name + "/");
        return names;
      }
    }
    std::vector<std::string> names(named.array.columns());
    for (std::size_t k = 0; k < names.size(); ++k) names[k] = fmt::format("{}[{}]", named.name, k);
    return names;
  }

  Status Take(const NamedArray& named) {
    const NpyArray& array = named.array;
    if (log_->columns.size() + array.columns() > kMostNpzColumns)
      return Error{.what = "too many columns",
                   .where = ArrayAt(path_, named.name),
                   .actual = fmt::format("shape ({})", fmt::join(array.shape, ", ")),
                   .allowed = fmt::format("at most {} in all", kMostNpzColumns),
                   .cure = "are rows and columns exchanged? Save x.T"};
    if (array.shape.size() == 1) {
      std::string name, unit;
      SplitHeading(named.name, &name, &unit);
      AddColumn(std::move(name), std::move(unit), array.Column(0), log_);
      return Ok();
    }
    std::vector<std::string> names = ElementNames(named);
    for (std::size_t k = 0; k < names.size(); ++k) AddColumn(std::move(names[k]), "", array.Column(k), log_);
    return Ok();
  }

  const std::string& path_;
  const Archive& archive_;
  Log* const log_;
};

// `gapscope.log/1`: the columns c0, c1 ... and a text of JSON that names them.
class OwnSchema {
 public:
  OwnSchema(const std::string& path, const Archive& archive, Log* log) : path_(path), archive_(archive), log_(log) {}

  Status Read() {
    const NpyArray& meta = *archive_.Find("meta");
    if (meta.kind != NpyKind::kUnsigned || meta.item_size != 1 || meta.shape.size() != 1 ||
        meta.data.size() > kLongestMeta)
      return Broken("'meta' is no text in bytes");
    const Json json = Json::parse(meta.data, nullptr, false);
    if (!json.is_object()) return Broken("'meta' is no JSON object");
    if (json.value("schema", Json()) != kSchema)
      return Broken("schema " + Quoted(json.value("schema", Json()).dump(-1, ' ', true), 60));
    const Json names = json.value("names", Json()), units = json.value("units", Json::array());
    if (!IsTexts(names) || names.empty() || names.size() > kMostNpzColumns)
      return Broken("'names' is no list of names");
    const Json clocks = json.value("clock", Json::array()), missing = json.value("missing", Json(""));
    for (const auto& [list, what] : {std::pair(&units, "units"), std::pair(&clocks, "clock")}) {
      if (!IsTexts(*list) || (!list->empty() && list->size() != names.size()))
        return Broken(fmt::format("'{}' is no list of as many texts as there are names", what));
    }
    if (missing != "" && missing != "keep") return Broken("'missing' is not \"keep\"");
    log_->joined = missing == "keep";
    for (std::size_t c = 0; c < names.size(); ++c) {
      const NpyArray* array = archive_.Find(fmt::format("c{}", c));
      const auto name = names[c].get<std::string>();
      if (!array) return Broken(fmt::format("no array 'c{}' for {}", c, Quoted(name)));
      if (array->is_text() || array->shape.size() != 1 || (c > 0 && array->rows() != log_->rows()))
        return Broken(fmt::format("'c{}' ({}) is no column of {} rows", c, Quoted(name), log_->rows()));
      AddColumn(name, units.empty() ? "" : units[c].get<std::string>(), array->Column(0), log_);
      if (!clocks.empty()) log_->columns.back().clock = clocks[c].get<std::string>();
    }
    if (log_->rows() == 0) return Broken("no rows");
    const Json time = json.value("time", Json(""));
    if (!time.is_string()) return Broken("'time' is no name");
    log_->time_column = time.get<std::string>();
    if (!log_->time_column.empty() && !log_->Find(log_->time_column)) return Broken("'time' names no column");
    return ReadHeader(json.value("header", Json::object())) && ReadFindings(json.value("findings", Json::array()))
               ? Ok()
               : Status(Broken("'header' or 'findings' are not as they should be"));
  }

 private:
  static bool IsTexts(const Json& list) {
    return list.is_array() && std::ranges::all_of(list, [](const Json& item) { return item.is_string(); });
  }

  Error Broken(std::string actual) const {
    return Error{.what = "a table that is not as gapscope.log/1 says",
                 .where = ArrayAt(path_, "meta"),
                 .actual = std::move(actual),
                 .allowed =
                     "meta (JSON: schema, names, units, clock, time, missing, header, findings), columns c0, c1 ... of "
                     "one length",
                 .cure = "write it with the gapscope package of this version, or save plain arrays: np.savez"};
  }

  bool ReadHeader(const Json& header) {
    if (!header.is_object()) return false;
    for (const auto& [key, value] : header.items()) {
      if (value.is_number()) {
        log_->header[key] = value.get<double>();
      } else if (value.is_string()) {
        log_->header_text[key] = value.get<std::string>();
      } else {
        return false;
      }
    }
    return true;
  }

  bool ReadFindings(const Json& findings) {
    if (!findings.is_array()) return false;
    for (const Json& item : findings) {
      if (!item.is_object()) return false;
      const Json kind = item.value("kind", Json()), column = item.value("column", Json("")),
                 text = item.value("text", Json("")), count = item.value("count", Json(1U));
      if (!kind.is_string() || !column.is_string() || !text.is_string() || !count.is_number_unsigned()) return false;
      log_->findings.push_back(
          {kind.get<std::string>(), column.get<std::string>(), count.get<std::size_t>(), 0, text.get<std::string>()});
    }
    return true;
  }

  const std::string& path_;
  const Archive& archive_;
  Log* const log_;
};

}  // namespace

bool LooksLikeZip(const std::string&, std::string_view bytes) {
  return bytes.starts_with("PK\x03\x04"sv) || bytes.starts_with("PK\x05\x06"sv);
}

Result<Log> ReadNpz(const std::string& path, std::string_view bytes) {
  if (!LooksLikeZip(path, bytes))
    return Error{.what = "the log is no NPZ archive",
                 .where = path + ": archive",
                 .actual = Quoted(bytes.substr(0, 8)),
                 .allowed = "what numpy.savez writes",
                 .cure = "leave out 'format' in the experiment file, or name the right log"};
  GS_ASSIGN(const Archive archive, ReadArchive(path, bytes));
  Log log;
  log.path = path;
  log.header_line = 0;
  GS_RETURN_IF_ERROR(archive.Find("meta") && archive.Find("c0") ? OwnSchema(path, archive, &log).Read()
                                                                : OwnArrays(path, archive, &log).Read());
  return log;
}

}  // namespace gapscope
