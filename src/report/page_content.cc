#include "src/report/page_content.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/file.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostConditions = 10;

std::vector<ConditionShare> First(std::vector<ConditionShare> shares) {
  shares.resize(std::min(shares.size(), kMostConditions));
  return shares;
}

// What is left on each log, the most first.
PageContent::Table ByLogTable(std::vector<LogGap> gaps) {
  PageContent::Table table{.title = "What is left on each log",
                           .heads = {"log", "from, s", "to, s", "retuned", "with what was found", "noise", "closed"},
                           .note =
                               "Errors over each signal's own spread, by parameters fitted without that log or "
                               "part. Noise: what the sensors' own is of it."};
  std::ranges::stable_sort(gaps, std::ranges::greater{}, &LogGap::final);
  const std::vector<std::string> logs = ShortPaths(Collect(gaps, &LogGap::log));
  for (std::size_t i = 0; i < gaps.size(); ++i) {
    const LogGap& gap = gaps[i];
    const double closed = ClosedShare(gap.refit, gap.final, gap.floor);
    table.rows.push_back({logs[i], ShortNumber(gap.from_s, 4), ShortNumber(gap.until_s, 4), ShortNumber(gap.refit, 3),
                          ShortNumber(gap.final, 3), ShortNumber(gap.floor, 3),
                          std::isfinite(gap.refit) ? fmt::format("{:.0f} %", 100 * closed) : "–"});
  }
  return table;
}

// Every effect that was looked at, the most probable first.
void AddStatements(const Diagnosis& d, PageContent* page) {
  for (const Statement& s : d.statements) {
    page->statements.push_back({.title = Words(s.use),
                                .answer = AnswerName(s.answer),
                                .why = WhyOf(s),
                                .bound = BoundText(s),
                                .probability = s.probability,
                                .prior = s.prior,
                                .numbers = s.sets ? std::optional(s.numbers) : std::nullopt});
  }
  std::ranges::stable_sort(page->statements, std::ranges::greater{}, &PageContent::Looked::probability);
}

}  // namespace

PageContent PageOf(const ReplayRun& run) {
  PageContent page{.headline = HeadlineOf(run), .mapped = "model", .values = run.model.values};
  const auto& logs = run.comparison.logs;
  if (!logs.empty()) page.where = {{.title = {}, .shares = TellOfWorst(logs.front(), {.limit = kMostConditions})}};
  return page;
}

PageContent PageOf(const TuneRun& run) {
  PageContent page{.headline = HeadlineOf(run), .mapped = "nominal model", .values = run.model.values};
  for (const auto& p : run.parameters)
    page.fitted.push_back({p.name, p.value, p.low, p.high, p.at_bound, p.identifiable});
  return page;
}

PageContent PageOf(const DiagnoseRun& run) {
  const Diagnosis& d = run.diagnosis;
  PageContent page{.headline = HeadlineOf(run), .mapped = d.effects.empty() ? "retuned model" : "diagnosed model"};
  if (d.model) page.values = RunModelOf(*d.model, d.values).values;
  page.where = {{.title = {}, .shares = First(d.where)}};
  if (MuchRemains(d)) {
    const auto found = Collect(d.effects, [](const auto& effect) { return Words(effect.use); });
    page.where.push_back(
        {.title = "Of what " + Listed(found) + (found.size() > 1 ? " leave" : " leaves"), .shares = First(d.remains)});
  }
  page.findings = SentencesOf(d);
  // The headline says how it went in windows.
  const std::string by_log = GapByLog(d), free = GapInFreeRuns(d);
  page.gap = by_log + (by_log.empty() || free.empty() ? "" : "; ") + free;
  if (!d.effects.empty() && d.by_log.size() > 1) page.tables.push_back(ByLogTable(d.by_log));
  page.remainder = PartsOf(d.remainder);
  page.reachable = d.remainder.reachable;
  AddStatements(d, &page);
  for (const auto& effect : d.effects) {
    for (const auto& p : effect.parameters)
      page.fitted.push_back({.name = effect.use.Text() + "." + p.key, .value = p.value, .low = p.low, .high = p.high});
  }
  for (const std::string& sentence : NextSentences(d)) page.next_text += (page.next_text.empty() ? "" : " ") + sentence;
  page.next_command = d.next.command;
  return page;
}

}  // namespace gapscope
