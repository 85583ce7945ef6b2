#include "src/report/page_content.h"

#include <algorithm>

#include "src/core/collect.h"

namespace gapscope {
namespace {

constexpr std::size_t kMostConditions = 10, kMostCandidates = 24;

std::vector<ConditionShare> First(std::vector<ConditionShare> shares) {
  shares.resize(std::min(shares.size(), kMostConditions));
  return shares;
}

// The explanations that were tried, the most probable first.
void AddCandidates(const Diagnosis& d, PageContent* page) {
  for (const auto& c : d.candidates) {
    page->candidates.push_back({.title = Words(c.effect),
                                .reason = c.reason,
                                .probability = c.probability,
                                .held_out_error = c.held_out_error});
  }
  std::ranges::stable_sort(page->candidates, std::ranges::greater{}, &PageContent::Candidate::probability);
  const std::size_t shown = std::min(page->candidates.size(), kMostCandidates);
  page->more_candidates = page->candidates.size() - shown;
  page->candidates.resize(shown);
}

}  // namespace

PageContent PageOf(const ReplayRun& run) {
  PageContent page{.headline = HeadlineOf(run), .mapped = "model", .values = run.model.values};
  const auto& logs = run.comparison.logs;
  if (!logs.empty())
    page.where = {{.title = {}, .shares = MostTelling(logs.front().where, {.limit = kMostConditions})}};
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
  PageContent page{.headline = HeadlineOf(run), .mapped = "nominal model"};
  if (d.model) page.values = RunModelOf(*d.model, d.values).values;
  page.where = {{.title = {}, .shares = First(d.where)}};
  if (d.verdict == Verdict::kUnknown && !d.effects.empty()) {
    const auto found = Collect(d.effects, [](const auto& effect) { return Words(effect.use); });
    page.where.push_back(
        {.title = "Of what " + Listed(found) + (found.size() > 1 ? " leave" : " leaves"), .shares = First(d.remains)});
  }
  AddCandidates(d, &page);
  for (const auto& effect : d.effects) {
    for (const auto& p : effect.parameters)
      page.fitted.push_back({.name = effect.use.Text() + "." + p.key, .value = p.value, .low = p.low, .high = p.high});
  }
  if (!d.next_command.empty()) {
    const std::vector<std::string> rivals = Collect(d.next_separates, [](const auto& rival) { return Words(rival); });
    page.next_command = d.next_command;
    page.next_text =
        rivals.empty() ? "It would tell more about what is left." : "It tells " + Listed(rivals, "from") + " apart.";
  }
  return page;
}

}  // namespace gapscope
