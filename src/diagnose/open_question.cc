#include <algorithm>
#include <array>
#include <cmath>

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
      : bench_(bench), found_(found), judgement_(judgement) {}

  std::optional<OpenQuestion> Next() {
    constexpr std::array kKinds{&Asking::Together, &Asking::Unsure, &Asking::OfOneLog, &Asking::Unseen};
    while (kind_ < kKinds.size()) {
      if (auto question = (this->*kKinds[kind_++])()) return question;
    }
    return std::nullopt;
  }

 private:
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
    for (const EffectUse& use : uses) {
      std::optional<RunModel> tried = Beyond(members, use);
      if (!tried) {
        const Candidate* fitted =
            members == EffectSet{use} ? found_.chosen : RefitInPlace(bench_, found_, members, use, Effort::kTry);
        if (!fitted) continue;
        tried = ModelOf(*fitted);
        if (question.next.models.size() == 1 && first) question.behind = Gain(*fitted, *first);
        if (question.next.models.empty()) first = fitted;
      }
      question.next.separates.emplace_back(use);
      question.next.models.push_back(*std::move(tried));
      if (question.next.models.size() == kMost) break;
    }
    if (question.next.models.size() < 2) return std::nullopt;
    question.together = of.probability;
    question.next.probability = of.probability / static_cast<double>(question.next.models.size());
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

  std::optional<OpenQuestion> Together() {
    const Statement* first = nullptr;
    for (const Statement& s : judgement_.statements) {
      if (s.group < 0 || s.answer != Answer::kPresent) continue;
      if (!first || s.numbers.gain > first->numbers.gain) first = &s;
    }
    if (!first) return std::nullopt;
    return Between(Why::kTogether, judgement_.groups[static_cast<std::size_t>(first->group)], *first);
  }

  std::optional<OpenQuestion> Unsure() {
    const Statement* first = nullptr;
    for (const Statement& s : judgement_.statements) {
      const bool open =
          s.probability > kDiagnosePolicy.next.absent && s.probability < kDiagnosePolicy.next.sure && s.sets;
      if (open && (!first || s.numbers.gain > first->numbers.gain)) first = &s;
    }
    if (!first) return std::nullopt;
    return WhetherThere(Why::kUnsure, *first, first->sets->with, first->sets->without);
  }

  std::optional<OpenQuestion> OfOneLog() {
    if (bench_.data->held_out.size() < 2) return std::nullopt;
    for (const Statement& s : judgement_.statements) {
      if (s.answer != Answer::kPresent || !s.sets || s.sets->blocks.empty()) continue;
      std::map<std::string, double> logs;
      for (const BlockGain& block : s.sets->blocks) logs[block.log] += block.share;
      if (std::any_of(logs.begin(), logs.end(),
                      [](const auto& log) { return log.second > kDiagnosePolicy.next.of_one_log; }))
        return WhetherThere(Why::kOneLog, s, s.sets->with, s.sets->without);
    }
    return std::nullopt;
  }

  // At the size in the middle of those that a search tries.
  std::optional<OpenQuestion> Unseen() {
    for (const Statement& s : judgement_.statements) {
      if (s.answer != Answer::kUnseen) continue;
      const auto middle = Collect(PlacedParameters(s.use, *bench_.rig, bench_.scales), [](const PlacedParameter& p) {
        return p.trials.empty() ? p.start : p.trials[p.trials.size() / 2];
      });
      const auto with = WithValues(With(found_.chosen->effects, s.use), s.use, middle);
      if (!with) continue;
      OpenQuestion question = WhetherThere(Why::kUnseen, s, *with, ModelOf(*found_.chosen));
      question.numbers.dry = EffectOf(s.use, *bench_.rig).character == EffectCharacter::kDryFriction;
      question.numbers.smooth = EffectOf(s.use, *bench_.rig).of_motion;
      return question;
    }
    return std::nullopt;
  }

  const Workbench& bench_;
  SearchResult& found_;
  const Judgement& judgement_;
  std::size_t kind_ = 0;
};

}  // namespace

AskNext OpenQuestions(const Workbench& bench, SearchResult& found, const Judgement& judgement) {
  return [asking = Asking(bench, found, judgement)]() mutable { return asking.Next(); };
}

}  // namespace gapscope
