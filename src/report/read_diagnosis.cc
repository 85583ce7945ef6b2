#include "src/report/read_diagnosis.h"

#include <algorithm>
#include <charconv>
#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/core/names.h"
#include "src/log/text.h"
#include "src/report/diagnose_report.h"
#include "src/report/read_json.h"

namespace gapscope {
namespace {

using nlohmann::ordered_json;

EffectUse UseFrom(const ordered_json& json) { return {json.at("name"), json.at("on")}; }

Answer AnswerFrom(const std::string& name) {
  return name == AnswerName(Answer::kPresent)  ? Answer::kPresent
         : name == AnswerName(Answer::kAbsent) ? Answer::kAbsent
                                               : Answer::kUnseen;
}

StatementNumbers NumbersFrom(const ordered_json& json) {
  return {.gain = NumberFrom(json.at("gain")),
          .gain_held_out = NumberFrom(json.at("gain_held_out")),
          .gain_free = NumberFrom(json.at("gain_free")),
          .discrepancy = NumberFrom(json.at("discrepancy")),
          .clear = NumberFrom(json.at("clear")),
          .smooth = json.at("smooth") != 0,
          .dry = json.at("dry") != 0};
}

// What the statement's numbers were taken from, where there is something.
void ReadSets(const ordered_json& json, Statement* statement) {
  if (!json.contains("numbers")) return;
  statement->numbers = NumbersFrom(json.at("numbers"));
  ComparedSets sets{.with = RunModelFrom(json.at("with")), .without = RunModelFrom(json.at("without")), .blocks = {}};
  for (const auto& block : json.at("blocks"))
    sets.blocks.push_back({block.at("log"), block.at("from_s"), block.at("to_s"), block.at("share")});
  statement->sets = std::make_shared<const ComparedSets>(std::move(sets));
  for (const auto& rival : json.at("rivals")) statement->rivals.push_back({UseFrom(rival), rival.at("behind")});
}

Statement StatementFrom(const ordered_json& json) {
  Statement statement{.use = UseFrom(json),
                      .answer = AnswerFrom(json.at("answer")),
                      .probability = json.at("probability"),
                      .prior = json.at("prior"),
                      .evidence = json.at("evidence"),
                      .group = json.at("group").is_null() ? -1 : WholeFrom<int>(json.at("group")),
                      .rule = json.at("rule"),
                      .caveat = json.value("caveat", "")};
  for (const auto& [key, size] : json.at("parameters").items())
    statement.parameters.push_back({.key = key,
                                    .value = NumberFrom(size.at("value")),
                                    .low = NumberFrom(size.at("low")),
                                    .high = NumberFrom(size.at("high"))});
  const auto& share = json.at("share_of_gap");
  statement.share_of_gap = {NumberFrom(share.at("value")), NumberFrom(share.at("low")), NumberFrom(share.at("high"))};
  if (json.contains("bound")) {
    for (const auto& [key, value] : json.at("bound").items())
      statement.bounds.push_back({.key = key, .value = NumberFrom(value)});
  }
  ReadSets(json, &statement);
  return statement;
}

EarlierDiagnosis DiagnosisFrom(const ordered_json& json) {
  const auto& logs = json.at("logs");
  return {.train_logs = logs.at("train"),
          .held_out_logs = logs.at("held_out"),
          .while_column = json.value("while", ""),
          .model = ResultModelFrom(json),
          .statements = Collect(json.at("statements"), StatementFrom)};
}

}  // namespace

Result<EarlierDiagnosis> ReadDiagnosis(const ordered_json& json, const std::string& where) {
  constexpr char kAllowed[] = "the folder that gapscope diagnose --out wrote, or its result.json";
  const std::string schema = TextIn(json, "schema");
  if (schema != kDiagnosisSchema)
    return Error{.what = "not a diagnosis", .where = where, .actual = Quoted(schema), .allowed = kAllowed};
  const nlohmann::json policy = json.value("policy", ordered_json());  // whatever the order of its keys
  if (!json.contains("experiment") || policy != nlohmann::json(JsonPolicy())) {
    return Error{.what = "a diagnosis of another version of gapscope, which weighs evidence differently",
                 .where = where,
                 .actual = json.value("versions", ordered_json()).dump(),
                 .allowed = "one with this version's policy",
                 .cure = "diagnose again"};
  }
  return ReadGuarded([&] { return DiagnosisFrom(json); }, where, kAllowed);
}

Result<std::size_t> FindStatement(const EarlierDiagnosis& diagnosis, const std::string& word,
                                  const std::string& where) {
  const auto& all = diagnosis.statements;
  std::size_t number = 0;
  const auto [end, code] = std::from_chars(word.data(), word.data() + word.size(), number);
  if (code == std::errc() && end == word.data() + word.size()) {
    if (number >= 1 && number <= all.size()) return number - 1;
    return Error{.what = "no such statement",
                 .where = where,
                 .actual = word,
                 .allowed = "1 .. " + std::to_string(all.size()) + ", in the order of `statements`"};
  }
  const auto found = std::find_if(all.begin(), all.end(), [&](const Statement& s) { return s.use.Text() == word; });
  if (found != all.end()) return static_cast<std::size_t>(found - all.begin());
  return NoSuch("no such statement", word, Collect(all, [](const Statement& s) { return s.use.Text(); }), where);
}

}  // namespace gapscope
