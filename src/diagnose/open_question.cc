#include <algorithm>
#include <cmath>
#include <functional>
#include <map>
#include <set>
#include <utility>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/diagnose/exchange.h"
#include "src/diagnose/next_experiment.h"
#include "src/diagnose/policy.h"
#include "src/diagnose/rules.h"

namespace gapscope {
namespace {

using Why = NextExperiment::Why;

RunModel ModelOf(const Candidate& candidate) { return RunModelOf(*candidate.model, candidate.values); }

class Asking {
 public:
  Asking(const Workbench& bench, SearchResult& found, const Judgement& judgement)
      : bench_(bench), found_(found), judgement_(judgement) {
    List();
  }

  std::optional<OpenQuestion> Next() {
    while (next_ < asked_.size()) {
      const auto& [why, of] = asked_[next_++];
      if (auto question = Ask(why, *of)) return question;
    }
    return std::nullopt;
  }

 private:
  // Of each kind one question a group.
  void List() {
    std::vector<const Statement*> by_gain = Collect(judgement_.statements, [](const Statement& s) { return &s; });
    std::ranges::stable_sort(by_gain, std::greater(), [](const Statement* s) { return s->numbers.gain; });
    for (const Why why : {Why::kTogether, Why::kUnsure, Why::kOneLog, Why::kUnseen}) {
      std::set<int> groups;
      for (const Statement* s : by_gain) {
        if (IsOpen(why, *s) && (s->group < 0 || groups.insert(s->group).second)) asked_.emplace_back(why, s);
      }
    }
  }

  bool IsOpen(Why why, const Statement& s) const {
    const bool present = s.answer == Answer::kPresent;
    switch (why) {
      case Why::kNothing:
        return false;
      case Why::kTogether:
        return present && s.group >= 0;
      case Why::kUnsure:
        return s.probability > kDiagnosePolicy.next.absent && s.probability < kDiagnosePolicy.next.sure && s.sets;
      case Why::kOneLog:
        return present && IsOfOneLog(s);
      case Why::kUnseen:
        return IsForAnInput(s);
    }
    return false;
  }

  std::optional<OpenQuestion> Ask(Why why, const Statement& s) {
    if (why == Why::kTogether) return Between(why, WithNear(judgement_.groups[static_cast<std::size_t>(s.group)]), s);
    return why == Why::kUnseen ? Unseen(s) : WhetherThere(why, s, s.sets->with, s.sets->without);
  }

  // With what costs hardly more than what ties: beside a further log it may tie.
  std::vector<EffectUse> WithNear(const std::vector<EffectUse>& group) const {
    std::vector<EffectUse> all = group;
    for (const Statement& s : judgement_.statements) {
      if (!Has(group, s.use)) continue;
      for (const Rival& rival : s.rivals) {
        const bool near = rival.behind < kDiagnosePolicy.next.beyond_tie * TieOf(s.numbers.gain) &&
                          !IsLessLikely(rival.use, s.use, *found_.base->model);
        if (near && !Has(all, rival.use)) all.push_back(rival.use);
      }
    }
    return all;
  }

  OpenQuestion Empty(Why why) const {
    OpenQuestion question{.next = {.why = why}};
    for (const auto& recording : bench_.data->train) question.seconds += recording.duration_s();
    const auto residuals = static_cast<double>(found_.chosen->problem->residuals());
    question.remaining = std::max(1.0, 2 * found_.chosen->train_cost / residuals);
    return question;
  }

  // One of several explanations that stand in for each other. Nothing: only one can be simulated.
  std::optional<OpenQuestion> Between(Why why, const std::vector<EffectUse>& uses, const Statement& of) {
    constexpr std::size_t kMost = 3;
    OpenQuestion question = Empty(why);
    EffectSet members;
    for (const EffectUse& use : uses) {
      if (Has(found_.chosen->effects, use)) members = With(members, use);
    }
    const Candidate* first = nullptr;
    const EffectUse* asked = nullptr;  // the first one
    std::vector<Explanation> never;    // told from it, by any log of these signals
    for (const EffectUse& use : uses) {
      if (asked && AreOneMotion(*asked, use, *found_.base->model, found_.logged)) {
        never.emplace_back(use);
        continue;
      }
      std::optional<RunModel> tried = Beyond(members, use);
      if (!tried) {
        const Candidate* fitted =
            members == EffectSet{use} ? found_.chosen : RefitInPlace(bench_, found_, members, use, Effort::kTry);
        if (!fitted) continue;
        tried = ModelOf(*fitted);
        if (question.next.models.size() == 1 && first) question.behind = Gain(*fitted, *first);
        if (question.next.models.empty()) first = fitted;
      }
      if (!asked) asked = &use;
      question.next.separates.emplace_back(use);
      question.next.models.push_back(*std::move(tried));
      if (question.next.models.size() == kMost) break;
    }
    auto& separates = question.next.separates;
    if (separates.size() == 1 && !never.empty()) {
      separates.insert(separates.end(), never.begin(), never.end());
      question.next.problem = "as long as the same signals are logged they are one motion. Another signal may tell.";
    }
    if (separates.size() < 2) return std::nullopt;
    question.together = of.probability;
    question.next.probability = of.probability / static_cast<double>(separates.size());
    question.tie = TieOf(of.numbers.gain);
    return question;
  }

  // A richer effect in the only member's place, as it usually is: fitted it would be what the simpler one is.
  std::optional<RunModel> Beyond(const EffectSet& members, const EffectUse& use) const {
    if (members.size() != 1 || !Contains(use, members.front(), *bench_.rig)) return std::nullopt;
    const auto usual = UsualBeyond(bench_, *found_.chosen, members.front(), use);
    if (usual.empty()) return std::nullopt;
    return WithValues(With(Without(found_.chosen->effects, members), use), use, usual.front());
  }

  // The chosen set's values, and those of an effect that it lacks, in the order of PlacedParameters.
  std::optional<RunModel> WithValues(const EffectSet& set, const EffectUse& use,
                                     const std::vector<double>& of_use) const {
    auto made = MakeCandidate(bench_, set);
    if (!made.ok()) return std::nullopt;
    const Candidate candidate = std::move(made).value();
    const Candidate& chosen = *found_.chosen;
    std::vector<double> values = candidate.values;
    for (std::size_t i = 0; i < chosen.values.size(); ++i) {
      const int index = candidate.model->IndexOf(chosen.model->parameters()[i].name);
      if (index >= 0) values[static_cast<std::size_t>(index)] = chosen.values[i];
    }
    const auto placed = PlacedParameters(use, *bench_.rig, bench_.scales);
    for (std::size_t i = 0; i < placed.size(); ++i)
      values[static_cast<std::size_t>(candidate.model->IndexOf(placed[i].name))] = of_use[i];
    return RunModelOf(*candidate.model, values);
  }

  // Whether an effect is there at all.
  OpenQuestion WhetherThere(Why why, const Statement& s, const RunModel& with, const RunModel& without) const {
    OpenQuestion question = Empty(why);
    question.next.separates = {s.use, std::nullopt};
    question.next.models = {with, without};
    question.next.probability = s.probability;
    question.numbers = s.numbers;
    question.nested = true;
    return question;
  }

  bool IsOfOneLog(const Statement& s) const {
    if (bench_.data->held_out.size() < 2 || !s.sets) return false;
    std::map<std::string, double> logs;
    for (const BlockGain& block : s.sets->blocks) logs[block.log] += block.share;
    return std::ranges::any_of(logs, [](const auto& log) { return log.second > kDiagnosePolicy.next.of_one_log; });
  }

  // At the size in the middle of those that a search tries.
  std::optional<OpenQuestion> Unseen(const Statement& s) {
    const auto middle = Collect(PlacedParameters(s.use, *bench_.rig, bench_.scales), [](const PlacedParameter& p) {
      return p.trials.empty() ? p.start : p.trials[p.trials.size() / 2];
    });
    const auto with = WithValues(With(found_.chosen->effects, s.use), s.use, middle);
    if (!with) return std::nullopt;
    OpenQuestion question = WhetherThere(Why::kUnseen, s, *with, ModelOf(*found_.chosen));
    question.numbers.dry = EffectOf(s.use, *bench_.rig).character == EffectCharacter::kDryFriction;
    question.numbers.smooth = EffectOf(s.use, *bench_.rig).of_motion;
    return question;
  }

  const Workbench& bench_;
  SearchResult& found_;
  const Judgement& judgement_;
  std::vector<std::pair<Why, const Statement*>> asked_;
  std::size_t next_ = 0;
};

}  // namespace

AskNext OpenQuestions(const Workbench& bench, SearchResult& found, const Judgement& judgement) {
  return [asking = Asking(bench, found, judgement)]() mutable { return asking.Next(); };
}

}  // namespace gapscope
