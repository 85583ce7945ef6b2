#include "src/experiment/yaml_reader.h"

#include <algorithm>
#include <charconv>
#include <cmath>

#include "src/core/file.h"
#include "src/core/names.h"
#include "src/log/text.h"

namespace gapscope {
namespace {

constexpr std::size_t kMaxBytes = 1 << 20;
constexpr int kMaxNesting = 64;

// Whatever a hostile file holds, a message is one readable line.
std::string OneLine(const std::string& text) {
  constexpr std::size_t kLongest = 400;
  const std::string quoted = Quoted(text, kLongest);
  return quoted.size() == text.size() + 2 ? text : quoted;
}

std::optional<double> ParseFinite(const std::string& text) {
  double value = 0;
  const char* begin = text.data() + (text.starts_with('+') && !text.starts_with("+-") ? 1 : 0);
  const auto [end, code] = std::from_chars(begin, text.data() + text.size(), value);
  if (code != std::errc() || end != text.data() + text.size() || !std::isfinite(value)) return std::nullopt;
  return value;
}

// yaml-cpp recurses on nesting: refuse what could exhaust the stack before it sees it.
bool NestsTooDeep(const std::string& bytes) {
  int flow = 0, deepest = 0;
  for (const char c : bytes) {
    if (c == '[' || c == '{') deepest = std::max(deepest, ++flow);
    if ((c == ']' || c == '}') && flow > 0) --flow;
  }
  std::size_t line_start = 0, indent_levels = 0, dashes = 0;
  while (line_start < bytes.size()) {
    const std::size_t end = std::min(bytes.find('\n', line_start), bytes.size());
    const std::size_t first = std::min(bytes.find_first_not_of(" -?\t", line_start), end);
    indent_levels = std::max(indent_levels, first - line_start);
    const std::string_view indent = std::string_view(bytes).substr(line_start, first - line_start);
    dashes = std::max<std::size_t>(
        dashes, std::count_if(indent.begin(), indent.end(), [](char c) { return c == '-' || c == '?'; }));
    line_start = end + 1;
  }
  return deepest > kMaxNesting || indent_levels > 4 * kMaxNesting || dashes > kMaxNesting;
}

// The line (1-based) of a "---" that follows content; 0: none. At a line's start it ends a document wherever it stands.
std::size_t SecondDocument(const std::string& bytes) {
  bool content = false;
  std::size_t line = 1;
  for (std::size_t begin = 0; begin < bytes.size(); ++line) {
    const std::size_t end = std::min(bytes.find('\n', begin), bytes.size());
    const std::string_view text = std::string_view(bytes).substr(begin, end - begin);
    const bool marker =
        text.starts_with("---") && (text.size() == 3 || text[3] == ' ' || text[3] == '\t' || text[3] == '\r');
    if (marker && content) return line;
    const std::size_t first = text.find_first_not_of(" \t\r");
    content = content || marker || (first != std::string_view::npos && text[first] != '#' && text[0] != '%');
    begin = end + 1;
  }
  return 0;
}

}  // namespace

std::string YamlPlace(const std::string& file, const YAML::Node& node) {
  const YAML::Mark mark = node.IsDefined() ? node.Mark() : YAML::Mark::null_mark();
  if (mark.is_null()) return file + ":1:1";
  return file + ":" + std::to_string(mark.line + 1) + ":" + std::to_string(mark.column + 1);
}

Result<YAML::Node> ReadYaml(const std::string& path) {
  GS_ASSIGN(const std::string bytes, ReadFile(path));
  if (bytes.size() > kMaxBytes) {
    return Error{.what = "too large for a YAML file",
                 .where = path + ":1",
                 .actual = std::to_string(bytes.size()) + " bytes",
                 .allowed = "at most " + std::to_string(kMaxBytes),
                 .cure = "is this a log?"};
  }
  if (bytes.find('\0') != std::string::npos) {
    return Error{.what = "not a YAML file", .where = path + ":1", .actual = "binary data", .allowed = "text"};
  }
  if (NestsTooDeep(bytes)) {
    return Error{.what = "nested too deep", .where = path + ":1", .allowed = std::to_string(kMaxNesting) + " levels"};
  }
  try {
    // Not YAML::LoadAll: some broken files make it yield documents for ever.
    YAML::Node node = YAML::Load(bytes);
    if (!node.IsDefined() || node.IsNull())
      return Error{.what = "the file holds no keys", .where = path + ":1", .allowed = "key: value pairs"};
    if (const std::size_t line = SecondDocument(bytes); line > 0) {
      return Error{.what = "more than one document in the file",
                   .where = path + ":" + std::to_string(line) + ":1",
                   .cure = "delete what follows '---'"};
    }
    return node;
  } catch (const YAML::Exception& e) {
    const std::string place =
        e.mark.is_null() ? ":1:1" : ":" + std::to_string(e.mark.line + 1) + ":" + std::to_string(e.mark.column + 1);
    return Error{.what = "not valid YAML: " + OneLine(e.msg), .where = path + place};
  }
}

YamlMap::YamlMap(const YAML::Node& node, std::string file, std::string what)
    : node_(node), file_(std::move(file)), what_(std::move(what)) {
  if (!node.IsMap()) {
    Fail(node, {.what = what_ + " is not a map",
                .actual = node.IsScalar() ? "'" + node.Scalar() + "'" : "",
                .allowed = "key: value pairs"});
    node_ = YAML::Node(YAML::NodeType::Map);
    return;
  }
  std::vector<std::string> seen;
  for (const auto& pair : node) {
    if (!pair.first.IsScalar()) {
      Fail(pair.first, {.what = "a key of " + what_ + " is not a text"});
      continue;
    }
    if (std::find(seen.begin(), seen.end(), pair.first.Scalar()) != seen.end()) {
      Fail(pair.first,
           {.what = "the key '" + pair.first.Scalar() + "' stands twice in " + what_, .cure = "delete one"});
    }
    seen.push_back(pair.first.Scalar());
  }
}

YAML::Node YamlMap::Take(const char* key) {
  known_.emplace_back(key);
  for (const auto& pair : node_) {
    if (pair.first.IsScalar() && pair.first.Scalar() == key) return pair.second;
  }
  return YAML::Node(YAML::NodeType::Undefined);
}

bool YamlMap::Has(const char* key) { return Take(key).IsDefined(); }
YAML::Node YamlMap::Child(const char* key) { return Take(key); }

std::string YamlMap::Text(const char* key, const std::optional<std::string>& fallback) {
  const YAML::Node node = Take(key);
  if (!node.IsDefined() || node.IsNull()) {
    if (!fallback) {
      Fail(node_, {.what = what_ + " has no '" + key + "'", .cure = std::string("add '") + key + ": ...'"});
    }
    return fallback.value_or("");
  }
  if (!node.IsScalar()) {
    Fail(node, {.what = std::string("'") + key + "' of " + what_ + " is not a text"});
    return "";
  }
  return node.Scalar();
}

double YamlMap::Number(const char* key, std::optional<double> fallback) {
  const YAML::Node node = Take(key);
  if (!node.IsDefined()) {
    if (!fallback) {
      Fail(node_, {.what = what_ + " has no '" + key + "'",
                   .allowed = "a number",
                   .cure = std::string("add '") + key + ": ...'"});
    }
    return fallback.value_or(0);
  }
  const auto value = node.IsScalar() ? ParseFinite(node.Scalar()) : std::nullopt;
  if (!value) {
    Fail(node, {.what = std::string("'") + key + "' of " + what_ + " is not a finite number",
                .actual = node.IsScalar() ? "'" + node.Scalar() + "'" : ""});
  }
  return value.value_or(0);
}

bool YamlMap::Flag(const char* key, bool fallback) { return Choice(key, {"false", "true"}, fallback ? 1 : 0) == 1; }

std::size_t YamlMap::Choice(const char* key, const std::vector<std::string>& allowed, std::size_t fallback) {
  const YAML::Node node = Take(key);
  if (!node.IsDefined()) return fallback;
  const std::string text = node.IsScalar() ? node.Scalar() : "";
  const auto found = std::find(allowed.begin(), allowed.end(), text);
  if (found == allowed.end()) {
    Fail(node, NoSuch(std::string("'") + key + "' of " + what_, text, allowed, ""));
    return fallback;
  }
  return static_cast<std::size_t>(found - allowed.begin());
}

std::vector<std::string> YamlMap::TextList(const char* key) {
  const YAML::Node node = Take(key);
  std::vector<std::string> items;
  if (!node.IsDefined() || node.IsNull()) return items;
  if (node.IsScalar()) return {node.Scalar()};
  for (const auto& item : node) {
    if (!node.IsSequence() || !item.IsScalar()) {
      Fail(node, {.what = std::string("'") + key + "' of " + what_ + " is not a text or a list of texts"});
      return {};
    }
    items.push_back(item.Scalar());
  }
  return items;
}

std::vector<double> YamlMap::NumberList(const char* key, std::size_t size) {
  const YAML::Node node = Take(key);
  std::vector<double> numbers;
  if (!node.IsDefined()) return numbers;
  if (node.IsSequence()) {
    for (const auto& item : node) {
      const auto value = item.IsScalar() ? ParseFinite(item.Scalar()) : std::nullopt;
      if (!value) break;
      numbers.push_back(*value);
    }
  }
  if (!node.IsSequence() || numbers.size() != size || node.size() != size) {
    Fail(node, {.what = std::string("'") + key + "' of " + what_ + " is not a list of " + std::to_string(size) +
                        " finite numbers"});
    return {};
  }
  return numbers;
}

std::vector<YAML::Node> YamlMap::List(const char* key) {
  const YAML::Node node = Take(key);
  if (!node.IsDefined()) return {};
  if (!node.IsSequence()) {
    Fail(node, {.what = std::string("'") + key + "' is not a list", .allowed = "items that begin with '- '"});
    return {};
  }
  return {node.begin(), node.end()};
}

std::string YamlMap::Name(const YAML::Node& key) {
  const std::string name = key.IsScalar() ? key.Scalar() : "";
  const auto is_letter = [](char c) { return (c >= 'a' && c <= 'z') || (c >= 'A' && c <= 'Z') || c == '_'; };
  const bool good =
      !name.empty() && is_letter(name[0]) && name != "pi" &&
      std::all_of(name.begin(), name.end(), [&](char c) { return is_letter(c) || (c >= '0' && c <= '9') || c == '.'; });
  if (!good) {
    Fail(key, {.what = "not a name in " + what_,
               .actual = "'" + name + "'",
               .allowed = "letters, digits, '_' and '.', a letter first, not 'pi': expressions use it"});
  }
  return name;
}

void YamlMap::Fail(const YAML::Node& at, Error error) {
  if (error_) return;
  if (error.where.empty()) error.where = YamlPlace(file_, at);
  error.what = OneLine(error.what);
  error.actual = OneLine(error.actual);
  error.cure = OneLine(error.cure);
  error_ = std::move(error);
}

Status YamlMap::Finish() {
  if (!error_) {
    for (const auto& pair : node_) {
      if (std::find(known_.begin(), known_.end(), pair.first.Scalar()) != known_.end()) continue;
      Fail(pair.first, NoSuch("unknown key in " + what_, pair.first.Scalar(), known_, ""));
      break;
    }
  }
  if (error_) return *error_;
  return Ok();
}

}  // namespace gapscope
