#include "src/report/explain_report.h"

#include <fmt/core.h>

#include <algorithm>
#include <cctype>
#include <cmath>
#include <nlohmann/json.hpp>

#include "src/core/collect.h"
#include "src/core/file.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/probability.h"
#include "src/report/console.h"
#include "src/report/json.h"
#include "src/report/sentences.h"
#include "src/report/words.h"

namespace gapscope {

using nlohmann::ordered_json;

namespace {

using Table = PageContent::Table;

std::string TitleOf(const Statement& s) {
  const char* is = s.answer == Answer::kPresent  ? "is present"
                   : s.answer == Answer::kAbsent ? "is not told as present"
                                                 : "cannot be told";
  std::string title = fmt::format("{} {}", Words(s.use), is);
  title[0] = static_cast<char>(std::toupper(static_cast<unsigned char>(title[0])));
  return title;
}

// The logistic function's sum, term by term.
Table EvidenceTable(const Statement& s) {
  Table table{.title = "What the probability is made of",
              .heads = {"number", "its value", "counted as", "weight", "adds"},
              .note =
                  "The sum is the logarithm of the odds at even prior odds. A positive number counts by its "
                  "logarithm where it says \"evidence\"; none counts beyond where it says nothing more."};
  double sum = 0;
  for (const EvidenceTerm& term : EvidenceTermsOf(s.numbers)) {
    table.rows.push_back({term.name, ShortNumber(term.value, 3), ShortNumber(term.counted, 3),
                          fmt::format("{:.2f}", term.weight), fmt::format("{:+.2f}", term.Adds())});
    sum += term.Adds();
  }
  table.rows.push_back({"sum", "", "", "", fmt::format("{:+.2f}", sum)});
  return table;
}

Table GainTable(const Statement& s) {
  const auto row = [](const char* where, double gain) {
    const bool known = std::isfinite(gain);
    return std::vector<std::string>{where, known ? fmt::format("{:.3f}", gain) : "says nothing",
                                    known ? fmt::format("{:.2f} times", std::exp(gain)) : ""};
  };
  return {.title = "What leaving it out costs",
          .heads = {"on", "gain", "the squared error without it"},
          .rows = {row("fitted logs", s.numbers.gain), row("logs held out, in windows", s.numbers.gain_held_out),
                   row("logs held out, in free runs", s.numbers.gain_free)},
          .note =
              "Both models are refitted. A gain is the logarithm of the ratio; squared errors count as at least "
              "the sensors' noise."};
}

Table BlockTable(const Statement& s) {
  Table table{.title = "Half seconds of the held-out logs that carry it",
              .heads = {"log", "from, s", "to, s", "share of what it gains"},
              .note = "The last row gains least."};
  const std::vector<BlockGain>& blocks = s.sets->blocks;
  const std::vector<std::string> logs = ShortPaths(Collect(blocks, &BlockGain::log));
  for (std::size_t i = 0; i < blocks.size(); ++i) {
    table.rows.push_back({logs[i], fmt::format("{:g}", blocks[i].from_s), fmt::format("{:g}", blocks[i].to_s),
                          fmt::format("{:.1f} %", 100 * blocks[i].share)});
  }
  return table;
}

Table RivalTable(const Statement& s) {
  const double tie = TieOf(s.numbers.gain);
  Table table{.title = "What was tried in its place",
              .heads = {"effect", "costs more by, %", "so"},
              .note = fmt::format("What costs less than {:.0f} % more is told together with it, unless it is less "
                                  "likely where it acts.",
                                  100 * std::expm1(tie))};
  for (const Rival& rival : s.rivals)
    table.rows.push_back({Words(rival.use), fmt::format("{:.1f}", 100 * std::expm1(rival.behind)),
                          rival.behind > tie ? "it explains less" : "it explains as much"});
  return table;
}

std::vector<Table> TablesOf(const Statement& s) {
  if (!s.sets) return {};
  std::vector<Table> tables = {EvidenceTable(s), GainTable(s)};
  if (!s.sets->blocks.empty()) tables.push_back(BlockTable(s));
  if (!s.rivals.empty()) tables.push_back(RivalTable(s));
  return tables;
}

// The probability, and how it came about, in sentences.
std::vector<std::string> SentencesOn(const Statement& s) {
  std::vector<std::string> sentences;
  if (!s.sets) {
    sentences.push_back("It was not refitted: " + WhyOf(s) + ".");
  } else {
    sentences.push_back(fmt::format(
        "Probability {:.2f}: the logs alone give {:.2f}, the prior is {:.2f}; from {:.2f} on it is told as present.",
        s.probability, s.evidence, s.prior, kDiagnosePolicy.probability.present));
    sentences.push_back("Rule: " + s.rule + ".");
  }
  for (const EffectEstimate& size : s.parameters)
    sentences.push_back(fmt::format("{}: {} (95 %: {} .. {}).", size.key, ShortNumber(size.value, 4),
                                    ShortNumber(size.low, 4), ShortNumber(size.high, 4)));
  for (const EffectEstimate& bound : s.bounds)
    sentences.push_back(fmt::format("With 95 % probability {} is at most {} (of a limit or a compliance: at least).",
                                    bound.key, ShortNumber(bound.value, 3)));
  return sentences;
}

std::string TextOf(const Table& table) {
  std::vector<std::size_t> widths;
  for (std::size_t c = 0; c < table.heads.size(); ++c) {
    std::size_t width = table.heads[c].size();
    for (const auto& row : table.rows) width = std::max(width, row[c].size());
    widths.push_back(width);
  }
  const auto line = [&](const std::vector<std::string>& cells) {
    std::string text;
    for (std::size_t c = 0; c < cells.size(); ++c)
      text += c == 0 ? fmt::format("{:<{}}", cells[c], widths[c]) : fmt::format("  {:>{}}", cells[c], widths[c]);
    return text.substr(0, text.find_last_not_of(' ') + 1) + "\n";
  };
  std::string text = "\n" + table.title + "\n" + line(table.heads);
  for (const auto& row : table.rows) text += line(row);
  return text + Wrapped(table.note, 120) + "\n";
}

}  // namespace

ordered_json ToJson(const ExplainRun& run) {
  const Statement& s = run.statement;
  ordered_json json = {{"schema", "gapscope.explain/1"},
                       {"diagnosis", run.diagnosis},
                       {"number", run.number},
                       {"name", s.use.effect},
                       {"on", s.use.on},
                       {"answer", AnswerName(s.answer)},
                       {"probability", s.probability},
                       {"prior", s.prior},
                       {"evidence", s.evidence},
                       {"rule", s.rule},
                       {"present_from", kDiagnosePolicy.probability.present},
                       {"terms", ordered_json::array()},
                       {"blocks", ordered_json::array()},
                       {"rivals", ordered_json::array()}};
  if (s.sets) {
    for (const EvidenceTerm& term : EvidenceTermsOf(s.numbers))
      json["terms"].push_back({{"name", term.name},
                               {"value", JsonNumber(term.value)},
                               {"counted", JsonNumber(term.counted)},
                               {"weight", term.weight},
                               {"adds", JsonNumber(term.Adds())}});
    json["blocks"] = JsonBlocks(s.sets->blocks);
    json["rivals"] = JsonRivals(s.rivals);
    json["with"] = JsonModel(s.sets->with);
    json["without"] = JsonModel(s.sets->without);
  }
  json["versions"] = JsonVersions(run.info);
  return json;
}

std::string ToText(const ExplainRun& run) {
  std::string text = fmt::format("{}: {}\n", run.number, TitleOf(run.statement));
  for (const std::string& sentence : SentencesOn(run.statement)) text += Wrapped("- " + sentence, 120, "  ") + "\n";
  for (const Table& table : TablesOf(run.statement)) text += TextOf(table);
  return text;
}

PageContent PageOf(const ExplainRun& run) {
  const Statement& s = run.statement;
  return {.headline = {.kind = "Evidence for " + Words(s.use),
                       .title = TitleOf(s) + ".",
                       .sentences = SentencesOn(s),
                       .confidence = s.probability,
                       .confidence_in = "Probability that it is there"},
          .tables = TablesOf(s),
          .mapped = {}};
}

}  // namespace gapscope
