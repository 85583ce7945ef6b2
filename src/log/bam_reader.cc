#include "src/log/bam_reader.h"

#include <fmt/format.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <cstdint>
#include <iterator>
#include <nlohmann/json.hpp>
#include <optional>
#include <set>
#include <span>
#include <unordered_map>
#include <vector>

#include "src/core/statistics.h"
#include "src/log/text.h"

namespace gapscope {
namespace {

using Json = nlohmann::json;

constexpr std::size_t kDeepest = 64;
constexpr std::size_t kMostKeys = 1000;

// Bytes for the parser; keeps the place it has reached where the event handler can see it.
class WatchedBytes {
 public:
  using iterator_category = std::input_iterator_tag;
  using value_type = char;
  using difference_type = std::ptrdiff_t;
  using pointer = const char*;
  using reference = const char&;

  WatchedBytes(const char* at, const char** reached) : at_(at), reached_(reached) {}
  const char& operator*() const { return *at_; }
  WatchedBytes& operator++() {
    *reached_ = ++at_;
    return *this;
  }
  bool operator==(const WatchedBytes& other) const { return at_ == other.at_; }
  bool operator!=(const WatchedBytes& other) const { return at_ != other.at_; }

 private:
  const char* at_;
  const char** reached_;
};

// Python writes NaN, Infinity and -Infinity, which JSON does not have: as null here. `longer` gets the offsets (in the
// result) behind which the text has grown by one byte.
std::string WithoutBareNaN(std::string_view bytes, std::vector<std::size_t>* longer, std::size_t* infinities) {
  std::string result;
  result.reserve(bytes.size() + bytes.size() / 16);
  bool quoted = false;
  for (std::size_t i = 0; i < bytes.size(); ++i) {
    const char c = bytes[i];
    if (quoted && c == '\\' && i + 1 < bytes.size()) {
      result += c;
      result += bytes[++i];
      continue;
    }
    if (c == '"') quoted = !quoted;
    if (!quoted && (c == 'N' || c == 'I' || c == '-')) {
      const std::string_view rest = bytes.substr(i);
      if (rest.starts_with("NaN")) {
        result += "null";
        longer->push_back(result.size() - 1);
        i += 2;
        continue;
      }
      if (const std::size_t sign = c == '-'; rest.substr(sign).starts_with("Infinity")) {
        result += sign ? "null     " : "null    ";
        ++*infinities;
        i += 7 + sign;
        continue;
      }
    }
    result += c;
  }
  return result;
}

class Handler : public nlohmann::json_sax<Json> {
 public:
  Handler(const std::string& path, std::string_view bytes, const std::vector<std::size_t>& longer, Log* log)
      : reached(bytes.data()), path_(path), bytes_(bytes), longer_(longer), log_(log) {}

  const char* reached;  // one byte behind the last token, at most
  std::optional<Error> error;

  bool null() override { return Value(kNaN); }
  bool boolean(bool value) override { return Value(value ? 1 : 0); }
  bool number_integer(number_integer_t value) override { return Value(static_cast<double>(value)); }
  bool number_unsigned(number_unsigned_t value) override { return Value(static_cast<double>(value)); }
  bool number_float(number_float_t value, const string_t&) override { return Value(value); }
  bool binary(binary_t&) override { return Fail("binary data", "", "JSON text", ""); }

  bool string(string_t& text) override {
    if (skip_depth_ > 0) return true;
    if (depth_ == 1 && !in_entries_) {
      if (!CheckHeaderKey()) return false;
      log_->header_text[key_] = text;
      if (key_ == "motor") log_->rig = text;
      return true;
    }
    if (depth_ == 0) return NotAnObject("a text");
    if (depth_ == 1) return NoFlatEntry("the text " + Quoted(text));
    return Fail(fmt::format("not a number in {}", Place()), Quoted(text), "a number, true, false or null",
                "write numbers without quotes");
  }

  bool key(string_t& name) override {
    if (skip_depth_ == 0) key_ = name;
    return true;
  }

  bool start_object(std::size_t) override {
    if (!Deeper()) return false;
    if (skip_depth_ > 0) return true;
    if (in_entries_) {
      if (depth_ == 2)
        return Fail(fmt::format("nested data in {}", Place()), "an object", "a number, true, false or null",
                    "one key per number");
      StartEntry();
    } else if (depth_ == 1) {
      return SkipNested();
    }
    ++depth_;
    return true;
  }

  bool end_object() override {
    --nesting_;
    if (skip_depth_ > 0) return EndSkipped();
    --depth_;
    if (in_entries_ && depth_ == 1) ++rows_;
    return true;
  }

  bool start_array(std::size_t) override {
    if (!Deeper()) return false;
    if (skip_depth_ > 0) return true;
    if (depth_ == 0) return NotAnObject("an array");
    if (in_entries_ && depth_ == 2) {
      return Fail(fmt::format("nested data in {}", Place()), "an array", "a number, true, false or null",
                  "one key per joint: position_1, position_2 ...");
    }
    if (in_entries_) return NoFlatEntry("an array");
    if (key_ != "entries") return SkipNested();
    if (entries_seen_) return Fail("the key 'entries' twice", "", "one array of entries", "");
    in_entries_ = entries_seen_ = true;
    return true;
  }

  bool end_array() override {
    --nesting_;
    if (skip_depth_ > 0) return EndSkipped();
    in_entries_ = false;
    return true;
  }

  bool parse_error(std::size_t position, const std::string&, const Json::exception& failure) override {
    // The library's text repeats the position, then says what it wanted.
    std::string_view text = failure.what();
    if (const auto at = text.find(": "); at != std::string_view::npos && text.find("parse error at") < at)
      text.remove_prefix(at + 2);
    if (const auto at = text.find("] "); text.starts_with('[') && at != std::string_view::npos)
      text.remove_prefix(at + 2);
    const bool ended = position > bytes_.size() || text.find("unexpected end of input") != std::string_view::npos;
    const bool range = text.find("number overflow") != std::string_view::npos;
    error = Error{.what = range ? "a number too large" : "not valid JSON",
                  .where = At(path_, Original(position > 0 ? position - 1 : 0)),
                  .actual = Quoted(text, 160),
                  .allowed = range ? "at most 1.8e308 in size" : "",
                  .cure = ended ? "the file was cut off: record it again, or close its brackets"
                                : "check it: python3 -m json.tool FILE"};
    return false;
  }

  // After the last event.
  Status Finish() {
    if (!entries_seen_) {
      return Error{.what = "no array 'entries'",
                   .where = At(path_, 1),
                   .actual = HeaderKeys(),
                   .allowed = "a bam log: header and \"entries\": [...]",
                   .cure = "is this a file of parameters, not a log?"};
    }
    if (rows_ == 0 || log_->columns.empty()) {
      return Error{.what = "no samples",
                   .where = At(path_, log_->header_line),
                   .actual = fmt::format("{} entries without a value", rows_),
                   .allowed = "one entry per sample",
                   .cure = "was the recording stopped before anything was written?"};
    }
    for (std::size_t c = 0; c < log_->columns.size(); ++c) {
      auto& column = log_->columns[c];
      column.values.resize(rows_, kNaN);
      const auto missing =
          std::count_if(column.values.begin(), column.values.end(), [](double x) { return std::isnan(x); });
      if (missing == 0) continue;
      const auto first =
          std::find_if(column.values.begin(), column.values.end(), [](double x) { return std::isnan(x); }) -
          column.values.begin();
      log_->findings.push_back(
          {"missing", column.name, static_cast<std::size_t>(missing), static_cast<std::size_t>(first),
           fmt::format("no value in {} of {} entries (first: entry {})", missing, rows_, first + 1)});
    }
    return Ok();
  }

 private:
  TextPosition Original(std::size_t offset) const {
    TextPosition position = PositionOf(bytes_, offset);
    const std::size_t line_start = offset + 1 - std::min(position.column, offset + 1);
    const auto grown = [&](std::size_t until) {
      return std::lower_bound(longer_.begin(), longer_.end(), until) - longer_.begin();
    };
    position.column -= std::min(position.column - 1, static_cast<std::size_t>(grown(offset) - grown(line_start)));
    return position;
  }
  std::size_t Offset() const { return static_cast<std::size_t>(reached - bytes_.data()); }

  bool Fail(std::string what, std::string actual, std::string allowed, std::string cure) {
    error = Error{.what = std::move(what),
                  .where = At(path_, Original(Offset() > 0 ? Offset() - 1 : 0)),
                  .actual = std::move(actual),
                  .allowed = std::move(allowed),
                  .cure = std::move(cure)};
    return false;
  }
  bool NotAnObject(const std::string& actual) {
    return Fail("not a bam log", actual, "an object with a header and \"entries\": [...]",
                "wrap the samples: {\"entries\": [...]}");
  }
  bool NoFlatEntry(const std::string& actual) {
    return Fail(fmt::format("entry {} is not an object", rows_ + 1), actual,
                "{\"timestamp\": 0.01, \"position\": 0.2, ...}", "one object per sample");
  }
  std::string Place() const { return fmt::format("entry {}, key {}", rows_ + 1, Quoted(key_)); }
  std::string HeaderKeys() const {
    std::string keys;
    for (const auto& key : header_keys_) {
      if (keys.size() < 200) keys += (keys.empty() ? "keys " : ", ") + Quoted(key);
    }
    return keys.empty() ? "no keys" : keys;
  }

  bool Deeper() {
    if (++nesting_ <= kDeepest) return true;
    return Fail("nested too deeply", fmt::format("level {}", nesting_), fmt::format("at most {} levels", kDeepest),
                "is this a log?");
  }
  bool CheckHeaderKey() {
    if (header_keys_.insert(key_).second) return true;
    return Fail("the key " + Quoted(key_) + " twice in the header", "", "each key once", "delete one of them");
  }
  // Nested data in the header is of no use here, but no error.
  bool SkipNested() {
    if (!CheckHeaderKey()) return false;
    log_->findings.push_back(
        {"ignored_header", key_, 1, 0, "the header's " + Quoted(key_) + " is neither a number nor a text; ignored"});
    skip_depth_ = nesting_;
    return true;
  }
  bool EndSkipped() {
    if (nesting_ < skip_depth_) skip_depth_ = 0;
    return true;
  }

  void StartEntry() {
    // Lines are counted on from the last entry.
    const char* here = reached;
    const char* from = counted_ ? counted_ : bytes_.data();
    line_ += static_cast<std::size_t>(std::count(from, here, '\n'));
    counted_ = here;
    if (rows_ == 0) log_->header_line = line_;
    if (log_->lines.empty() || line_ != log_->lines.back().line + (rows_ - log_->lines.back().row))
      log_->lines.push_back({rows_, line_});
    next_column_ = 0;
  }

  bool Value(double value) {
    if (skip_depth_ > 0) return true;
    if (depth_ == 0) return NotAnObject("a single value");
    if (depth_ == 1 && in_entries_) return NoFlatEntry("a single value");
    if (depth_ == 1) {
      if (key_ == "entries") return Fail("'entries' is not an array", "a single value", "an array of objects", "");
      if (!CheckHeaderKey()) return false;
      if (!std::isnan(value)) log_->header[key_] = value;
      return true;
    }
    // Entries nearly always have the same keys in the same order.
    std::size_t c = next_column_;
    if (c >= log_->columns.size() || log_->columns[c].name != key_) {
      const auto [found, inserted] = index_.try_emplace(key_, log_->columns.size());
      c = found->second;
      if (inserted && !AddColumn()) return false;
    }
    next_column_ = c + 1;
    auto& values = log_->columns[c].values;
    if (values.size() > rows_)
      return Fail(fmt::format("a key twice in {}", Place()), "", "each key once", "delete one of them");
    values.resize(rows_, kNaN);
    values.push_back(value);
    ++values_;
    return true;
  }

  // Keys that come in few entries would make a table far larger than the file.
  bool AddColumn() {
    if (log_->columns.size() == kMostKeys) {
      return Fail("too many different keys in the entries", std::to_string(kMostKeys + 1),
                  fmt::format("at most {}", kMostKeys), "give all entries the same keys");
    }
    const std::size_t cells = (log_->columns.size() + 1) * rows_;
    if (cells > 10'000'000 && cells > 100 * values_) {
      return Fail("the entries have too few keys in common", fmt::format("{} values in a table of {}", values_, cells),
                  "", "give all entries the same keys");
    }
    log_->columns.push_back({key_, "", {}});
    return true;
  }

  const std::string& path_;
  const std::string_view bytes_;
  const std::vector<std::size_t>& longer_;
  Log* const log_;
  std::string key_;
  std::set<std::string> header_keys_;
  std::unordered_map<std::string, std::size_t> index_;
  std::size_t depth_ = 0;       // objects that we are inside of: 1 header, 2 entry
  std::size_t nesting_ = 0;     // all brackets
  std::size_t skip_depth_ = 0;  // nesting of a value of the header that is skipped
  bool in_entries_ = false, entries_seen_ = false;
  std::size_t rows_ = 0, values_ = 0, next_column_ = 0, line_ = 1;
  const char* counted_ = nullptr;
};

}  // namespace

bool LooksLikeJson(const std::string& path, std::string_view bytes) {
  const std::size_t first = bytes.find_first_not_of(" \t\r\n", BomSize(bytes));
  return path.ends_with(".json") || (first != std::string_view::npos && (bytes[first] == '{' || bytes[first] == '['));
}

Result<Log> ReadBamJson(const std::string& path, std::string_view bytes) {
  GS_RETURN_IF_ERROR(CheckText(path, bytes));
  bytes.remove_prefix(BomSize(bytes));
  Log log;
  log.path = path;
  std::string copy;
  std::vector<std::size_t> longer;
  std::size_t infinities = 0;
  if (bytes.find("NaN") != std::string_view::npos || bytes.find("Infinity") != std::string_view::npos) {
    copy = WithoutBareNaN(bytes, &longer, &infinities);
    bytes = copy;
  }
  Handler handler(path, bytes, longer, &log);
  try {
    const std::span<const char> text = bytes;
    const WatchedBytes first(text.data(), &handler.reached), last(text.data() + text.size(), &handler.reached);
    const bool complete = Json::sax_parse(first, last, &handler);
    if (!complete && !handler.error)
      handler.error = Error{.what = "not valid JSON", .where = At(path, 1), .actual = "", .allowed = "", .cure = ""};
  } catch (const Json::exception& failure) {
    return Error{.what = "not valid JSON",
                 .where = At(path, PositionOf(bytes, static_cast<std::size_t>(handler.reached - bytes.data()))),
                 .actual = Quoted(failure.what(), 160),
                 .allowed = "",
                 .cure = ""};
  }
  if (handler.error) return *handler.error;
  GS_RETURN_IF_ERROR(handler.Finish());
  if (infinities > 0) {
    log.findings.push_back(
        {"infinite", "", infinities, 0, fmt::format("'Infinity' in {} places; taken as missing", infinities)});
  }
  return log;
}

}  // namespace gapscope
