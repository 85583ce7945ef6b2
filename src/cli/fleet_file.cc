#include "src/cli/fleet_file.h"

#include <algorithm>
#include <charconv>
#include <filesystem>
#include <map>
#include <optional>
#include <set>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/diagnose/diagnosis.h"
#include "src/experiment/yaml_reader.h"
#include "src/log/text.h"

namespace gapscope::cli {
namespace {

namespace fs = std::filesystem;

bool IsWild(const std::string& part) { return part.find_first_of("*?{") != std::string::npos; }

// What a part of a path is made of: a letter, '?', '*' or '{' with its name.
struct Piece {
  char letter = 0, wild = 0;  // wild: 0 for a letter
  std::string name = {};
};

std::vector<Piece> PiecesOf(const std::string& part) {
  std::vector<Piece> pieces;
  for (std::size_t i = 0; i < part.size(); ++i) {
    const char c = part[i];
    if (c == '*' && !pieces.empty() && pieces.back().wild == '*') continue;
    if (c == '{') {
      const std::size_t end = part.find('}', i);
      pieces.push_back({.wild = c, .name = part.substr(i + 1, end - i - 1)});
      i = end;
    } else {
      pieces.push_back(c == '*' || c == '?' ? Piece{.wild = c} : Piece{.letter = c});
    }
  }
  return pieces;
}

// The texts of the names in `pieces`, each as short as it can be, what '*' stands for as long as it can be; nothing:
// `name` does not fit. In time pieces x letters: a search that goes back would never end on "*a*a*a*a*a*b".
std::optional<std::vector<std::string>> TextsOf(const std::vector<Piece>& pieces, const std::string& name) {
  const std::size_t letters = name.size(), columns = letters + 1;
  const auto stars = std::ranges::count(pieces, '*', &Piece::wild);
  if (pieces.size() - static_cast<std::size_t>(stars) > letters) return std::nullopt;
  // Whether the pieces from p on can be what the name holds from its n-th letter on.
  std::vector<bool> fits((pieces.size() + 1) * columns);
  const auto at = [&](std::size_t p, std::size_t n) { return fits[p * columns + n]; };
  at(pieces.size(), letters) = true;
  for (std::size_t p = pieces.size(); p-- > 0;) {
    const char wild = pieces[p].wild;
    for (std::size_t n = columns; n-- > 0;) {
      const bool more = n < letters;
      if (wild == '*') at(p, n) = at(p + 1, n) || (more && at(p, n + 1));
      if (wild == '{') at(p, n) = more && (at(p + 1, n + 1) || at(p, n + 1));
      if (wild == '?') at(p, n) = more && at(p + 1, n + 1);
      if (wild == 0) at(p, n) = more && pieces[p].letter == name[n] && at(p + 1, n + 1);
    }
  }
  if (!at(0, 0)) return std::nullopt;
  std::vector<std::string> texts;
  for (std::size_t p = 0, n = 0; p < pieces.size(); ++p) {
    std::size_t end = pieces[p].wild == '*' ? letters : n + 1;
    while (!at(p + 1, end)) pieces[p].wild == '*' ? --end : ++end;
    if (pieces[p].wild == '{') texts.push_back(name.substr(n, end - n));
    n = end;
  }
  return texts;
}

using Texts = std::map<std::string, std::string>;

void MatchBelow(const fs::path& folder, fs::path::iterator part, const fs::path::iterator& end, const Texts& texts,
                std::vector<std::pair<std::string, Texts>>* found) {
  std::error_code failure;
  if (part == end) {
    if (fs::is_regular_file(folder, failure)) found->emplace_back(folder.lexically_normal().string(), texts);
    return;
  }
  const std::string pattern = part->string();
  const auto next = std::next(part);
  if (!IsWild(pattern)) return MatchBelow(folder / pattern, next, end, texts, found);
  const std::vector<Piece> pieces = PiecesOf(pattern);
  std::vector<std::string> entries;
  for (fs::directory_iterator entry(folder, failure), last; !failure && entry != last; entry.increment(failure))
    entries.push_back(entry->path().filename().string());
  std::sort(entries.begin(), entries.end());
  for (const auto& entry : entries) {
    const auto found_texts = TextsOf(pieces, entry);
    if (!found_texts) continue;
    Texts known = texts;
    bool same = true;
    std::size_t i = 0;
    for (const Piece& piece : pieces) {
      if (piece.wild != '{') continue;
      const std::string& text = (*found_texts)[i++];
      same = same && known.emplace(piece.name, text).first->second == text;
    }
    if (same) MatchBelow(folder / entry, next, end, known, found);
  }
}

// The logs of all patterns as units, those of one robot together, in time.
Result<std::vector<PlanUnit>> UnitsOf(const std::string& file, const std::vector<std::string>& patterns, Plan* plan) {
  std::map<std::vector<std::string>, std::set<std::string>> groups;
  for (const auto& pattern : patterns) {
    GS_ASSIGN(std::vector<std::string> columns, PatternColumns(pattern));
    std::sort(columns.begin(), columns.end());
    std::vector<std::string> expected = plan->columns;
    std::sort(expected.begin(), expected.end());
    if (columns != expected)
      return Error{.what = "patterns of different columns",
                   .where = file,
                   .actual = pattern,
                   .allowed = "the columns of the first pattern: " + gapscope::Join(plan->columns)};
    const auto logs = MatchLogs((fs::path(file).parent_path() / pattern).string(), plan->columns);
    if (logs.empty())
      return Error{.what = "no log fits the pattern",
                   .where = file,
                   .actual = pattern,
                   .cure = "patterns are relative to this file; {robot} and * stand for any text between slashes"};
    for (const auto& log : logs) {
      // Without columns each log is a unit of its own.
      const bool alone = log.columns.empty();
      groups[alone ? std::vector<std::string>{log.path} : log.columns].insert(log.path);
    }
  }
  return Collect(groups, [&](const auto& unit) {
    const auto& [group, logs] = unit;
    return PlanUnit{.id = {},
                    .group = plan->columns.empty() ? std::vector<std::string>{} : group,
                    .logs = {logs.begin(), logs.end()}};
  });
}

// The tables of a merge have these of their own.
Status CheckColumns(const std::string& file, const std::vector<std::string>& columns) {
  static const std::set<std::string> kTaken = {"task", "log",       "state",   "error",  "verdict",   "probability",
                                               "left", "gap",       "nominal", "report", "statement", "answer",
                                               "unit", "parameter", "value",   "low",    "high"};
  for (const auto& column : columns) {
    if (kTaken.contains(column))
      return Error{.what = "a column's name that the tables of merge have already",
                   .where = file,
                   .actual = "{" + column + "}",
                   .cure = "call it otherwise in the pattern"};
  }
  return Ok();
}

// The column of time last: it is what goes along a robot's units.
void MoveTimeLast(Plan* plan) {
  const auto at = std::find(plan->columns.begin(), plan->columns.end(), plan->time);
  std::rotate(at, at + 1, plan->columns.end());
}

void SortUnits(std::vector<PlanUnit>* units) {
  std::stable_sort(units->begin(), units->end(), [](const PlanUnit& a, const PlanUnit& b) {
    return std::lexicographical_compare(a.group.begin(), a.group.end(), b.group.begin(), b.group.end(), TextBefore);
  });
}

Status ReadOptions(YamlMap& map, const fs::path& folder, Plan* plan) {
  const std::vector<std::string> whats = {"tune", "diagnose"}, efforts = NamesOf<SearchEffort>();
  plan->what = whats[map.Choice("what", whats, 1)];
  const auto absolute = [&](const std::string& path) { return (folder / path).lexically_normal().string(); };
  plan->options = {{"with", map.TextList("with")},
                   {"set", map.TextList("set")},
                   {"params", Collect(map.TextList("params"), absolute)},
                   {"while", map.Text("while", "")}};
  const double starts = map.Number("starts", 1), seed = map.Number("seed", 0);
  const std::size_t effort = map.Choice("effort", efforts, 1);
  const auto whole = [](double x, double low, double high) { return x == std::floor(x) && x >= low && x <= high; };
  if (map.failed()) return Ok();  // Finish() says why; the numbers may be any
  if (!(whole(starts, 1, 1000) && whole(seed, 0, 1e15)))
    return Error{.what = "not a whole number in its range",
                 .where = map.file(),
                 .actual = whole(starts, 1, 1000) ? "seed" : "starts",
                 .allowed = "starts: 1 .. 1000; seed: 0 or more"};
  if (plan->what == "tune") plan->options["starts"] = static_cast<int>(starts);
  if (plan->what == "diagnose") plan->options["effort"] = efforts[effort];
  plan->options["seed"] = static_cast<std::uint64_t>(seed);
  plan->reports = map.Flag("reports", true) && plan->what == "diagnose";
  return Ok();
}

}  // namespace

bool TextBefore(const std::string& a, const std::string& b) {
  double x = 0, y = 0;
  const auto number = [](const std::string& text, double* value) {
    const auto parsed = std::from_chars(text.data(), text.data() + text.size(), *value);
    // "nan" is a name: nothing is before it or behind it.
    return parsed.ec == std::errc() && parsed.ptr == text.data() + text.size() && !std::isnan(*value);
  };
  const bool a_number = number(a, &x), b_number = number(b, &y);
  if (a_number != b_number) return a_number;
  return a_number && x != y ? x < y : a < b;
}

Result<std::vector<std::string>> PatternColumns(const std::string& pattern) {
  constexpr std::size_t kLongest = 4096;  // of a path, too
  if (pattern.size() > kLongest)
    return Error{.what = "a pattern too long for a path",
                 .where = Quoted(pattern),
                 .actual = std::to_string(pattern.size()) + " characters",
                 .allowed = "at most " + std::to_string(kLongest)};
  std::vector<std::string> columns;
  for (std::size_t at = pattern.find('{'); at != std::string::npos; at = pattern.find('{', at + 1)) {
    const std::size_t end = pattern.find_first_of("}/", at);
    const std::string name = end == std::string::npos ? "" : pattern.substr(at + 1, end - at - 1);
    const bool good =
        !name.empty() && pattern[end] == '}' &&
        std::all_of(name.begin(), name.end(), [](unsigned char c) { return std::isalnum(c) || c == '_'; });
    if (!good)
      return Error{.what = "not a column's name in a pattern",
                   .where = pattern,
                   .actual = "'" + pattern.substr(at, end == std::string::npos ? end : end - at + 1) + "'",
                   .allowed = "{NAME} of letters, digits and _"};
    if (std::find(columns.begin(), columns.end(), name) == columns.end()) columns.push_back(name);
  }
  return columns;
}

std::vector<MatchedLog> MatchLogs(const std::string& pattern, const std::vector<std::string>& columns) {
  const fs::path path = fs::absolute(pattern).lexically_normal();
  std::vector<std::pair<std::string, Texts>> found;
  const fs::path below = path.relative_path();
  MatchBelow(path.root_path(), below.begin(), below.end(), {}, &found);
  std::sort(found.begin(), found.end());
  return Collect(found, [&](const auto& log) {
    return MatchedLog{log.first, Collect(columns, [&](const auto& name) { return log.second.at(name); })};
  });
}

Result<Plan> LoadFleet(const std::string& path) {
  GS_ASSIGN(const YAML::Node root, ReadYaml(path));
  const fs::path folder = fs::absolute(path).parent_path();
  YamlMap map(root, path, "fleet");
  map.Choice("schema", {kFleetSchema}, 0);
  Plan plan{.experiment = (folder / map.Text("experiment")).lexically_normal().string(),
            .options = {},
            .columns = {},
            .time = {},
            .units = {}};
  const std::vector<std::string> patterns = map.TextList("logs");
  GS_RETURN_IF_ERROR(ReadOptions(map, folder, &plan));
  plan.time = map.Text("time", "");
  GS_RETURN_IF_ERROR(map.Finish());
  if (patterns.empty()) return Error{.what = "no logs", .where = path, .allowed = "logs: PATTERN, or a list of them"};
  GS_ASSIGN(plan.columns, PatternColumns(patterns.front()));
  GS_RETURN_IF_ERROR(CheckColumns(path, plan.columns));
  if (plan.time.empty() && !plan.columns.empty()) plan.time = plan.columns.back();
  if (!plan.time.empty() && std::find(plan.columns.begin(), plan.columns.end(), plan.time) == plan.columns.end())
    return Error{.what = "the time is not a column",
                 .where = path,
                 .actual = "time: " + plan.time,
                 .allowed = plan.columns.empty() ? "a pattern with {NAME}" : gapscope::Join(plan.columns)};
  if (!plan.time.empty()) MoveTimeLast(&plan);
  GS_ASSIGN(plan.units, UnitsOf(fs::absolute(path).string(), patterns, &plan));
  SortUnits(&plan.units);
  return plan;
}

}  // namespace gapscope::cli
