#include "src/report/sentences.h"

#include <fmt/format.h>

#include <algorithm>
#include <cmath>
#include <set>

#include "src/core/collect.h"
#include "src/diagnose/policy.h"
#include "src/report/words.h"

namespace gapscope {
namespace {

// Seconds that are short are read as milliseconds; a share has no unit.
std::string SizeText(const EffectEstimate& size) {
  constexpr double kShort = 0.5;
  const bool is_short = size.unit == "s" && std::abs(size.value) < kShort;
  const double factor = is_short ? 1000 : 1;
  const auto number = [&](double value) { return ShortNumber(factor * value, 3); };
  const bool hardly_known = size.low <= 0 && size.high >= 0;
  return fmt::format("{} ({} .. {}){}{}", number(size.value), number(size.low), number(size.high),
                     UnitAfter(is_short ? "ms" : size.unit), hardly_known ? ", a size hardly known" : "");
}

std::string NamesOf(const std::vector<EffectUse>& uses) {
  const bool one_place =
      std::all_of(uses.begin(), uses.end(), [&](const EffectUse& use) { return use.on == uses.front().on; });
  if (!one_place || uses.size() == 1) return Listed(Collect(uses, [](const auto& use) { return Words(use); }), "or");
  std::vector<std::string> names;
  for (std::size_t i = 0; i + 1 < uses.size(); ++i) names.push_back(EffectTitle(uses[i].effect));
  names.push_back(Words(uses.back()));
  return Listed(names, "or");
}

// The input that tells an effect from what resembles it, by its own file; empty: a candidate of the user's own.
std::string InputThatTells(const EffectUse& use) {
  const auto effect = std::ranges::find(Catalogue(), use.effect, &Effect::name);
  return effect == Catalogue().end() ? "" : effect->told_apart;
}

// What would tell the members of a group apart; empty: one member, or nothing is known.
std::string WhatWouldTell(const std::vector<const Statement*>& members) {
  if (members.size() == 1) return "";
  std::vector<std::string> inputs;
  for (const Statement* s : members) {
    const std::string input = InputThatTells(s->use);
    if (!input.empty() && std::ranges::find(inputs, input) == inputs.end()) inputs.push_back(input);
  }
  return inputs.empty() ? "" : fmt::format("what would tell: {}", fmt::join(inputs, "; "));
}

Sentence SentenceOf(const std::vector<const Statement*>& members) {
  const Statement& first = *members.front();
  Sentence sentence{.what = NamesOf(Collect(members, [](const Statement* s) { return s->use; }))};
  for (const Statement* s : members) {
    sentence.share_of_gap = std::max(sentence.share_of_gap, s->share_of_gap.value);
    sentence.probability = std::max(sentence.probability, s->probability);
    if (s->parameters.empty()) continue;
    const std::string name = members.size() > 1 ? EffectTitle(s->use.effect) + " " : "";
    sentence.size += (sentence.size.empty() ? "" : "; ") + name + SizeText(s->parameters.front());
  }
  std::set<std::string> caveats;
  if (first.beside) caveats.insert("seen only beside " + Words(*first.beside));
  for (const Statement* s : members) {
    if (!s->caveat.empty()) caveats.insert(s->caveat);
  }
  sentence.caveat = fmt::format("{}", fmt::join(caveats, "; "));
  sentence.told_apart = WhatWouldTell(members);
  return sentence;
}

bool LeavesMuch(const Diagnosis& d) { return d.evidence.floors_left > kDiagnosePolicy.verdict.much_missing; }

// What is open, and what the proposed log would tell of it.
std::vector<std::string> OfTheQuestion(const NextExperiment& next) {
  using Why = NextExperiment::Why;
  if (next.why == Why::kNothing) return {};
  const std::vector<std::string> names = Collect(next.separates, [](const auto& one) { return Words(one); });
  const std::string& first = names.front();
  std::vector<std::string> sentences;
  switch (next.why) {
    case Why::kTogether:
      sentences.push_back("These logs do not tell " + first + " from " +
                          Listed({names.begin() + 1, names.end()}, "or") + ".");
      break;
    case Why::kUnsure:
      sentences.push_back(fmt::format("Whether {} is there is not sure: P {:.2f}.", first, next.probability));
      break;
    case Why::kOneLog:
      sentences.push_back("Only one log shows " + first + ".");
      break;
    default:
      sentences.push_back("These logs cannot show " + first + ".");
  }
  if (next.input_csv.empty()) {
    sentences.push_back("No experiment is proposed: " + next.problem);
  } else {
    sentences.push_back(
        fmt::format("With the proposed log beside these, P would be about {:.2f} if it is {}, and {:.2f} if not.",
                    next.if_present, next.why == Why::kTogether ? first : "there", next.if_absent));
  }
  return sentences;
}

}  // namespace

std::string Sentence::Text() const {
  std::string text = what;
  if (!size.empty()) text += ", " + size;
  text += fmt::format(", {:.0f} % of what closes, P {:.2f}", 100 * share_of_gap, probability);
  if (!caveat.empty()) text += ", " + caveat;
  return told_apart.empty() ? text : text + "; " + told_apart;
}

std::string WhyOf(const Statement& s) {
  const std::string input = IsForAnInput(s) ? InputThatTells(s.use) : "";
  return s.rule + (input.empty() ? "" : "; what would show it: " + input);
}

std::vector<Sentence> SentencesOf(const Diagnosis& d) {
  std::vector<Sentence> sentences;
  std::vector<int> told;
  for (const Statement& s : d.statements) {
    if (s.answer != Answer::kPresent || std::find(told.begin(), told.end(), s.group) != told.end()) continue;
    std::vector<const Statement*> members = {&s};
    if (s.group >= 0) {
      told.push_back(s.group);
      for (const Statement& other : d.statements) {
        if (&other != &s && other.group == s.group && other.answer == Answer::kPresent) members.push_back(&other);
      }
    }
    sentences.push_back(SentenceOf(members));
  }
  std::stable_sort(sentences.begin(), sentences.end(),
                   [](const auto& a, const auto& b) { return a.share_of_gap > b.share_of_gap; });
  return sentences;
}

bool MuchRemains(const Diagnosis& d) { return !d.effects.empty() && LeavesMuch(d); }

std::string GapInWindows(const Diagnosis& d) {
  return fmt::format(
      "in windows: nominal {} -> retuned {} -> with what was found {}, the sensors' floor {}; {:.0f} % closed",
      ShortNumber(d.nominal, 3), ShortNumber(d.refit, 3), ShortNumber(d.final, 3), ShortNumber(d.floor, 3),
      100 * d.closed);
}

std::string GapByLog(const Diagnosis& d) {
  const std::optional<ClosedByLog> closed = ClosedOf(d.by_log);
  if (d.effects.empty() || !closed) return "";
  return fmt::format(
      "each of {} logs or parts of a log, left out of the fit: {:.0f} .. {:.0f} % closed, the median {:.0f} %",
      closed->logs, 100 * closed->least, 100 * closed->most, 100 * closed->median);
}

std::string GapInFreeRuns(const Diagnosis& d) {
  const VerdictEvidence& e = d.evidence;
  if (d.effects.empty() || !std::isfinite(e.free_run_before) || !std::isfinite(e.free_run_left)) return "";
  if (AreLost(e.free_run_before, e.free_run_left)) {
    return fmt::format("over whole logs in one run: the motion is lost, errors {} and {}: that shows nothing",
                       ShortNumber(e.free_run_before, 3), ShortNumber(e.free_run_left, 3));
  }
  return fmt::format("over whole logs in one run: retuned {} -> with what was found {}; {:.0f} % closed",
                     ShortNumber(e.free_run_before, 3), ShortNumber(e.free_run_left, 3), 100 * e.free_run_removed);
}

std::vector<Part> PartsOf(const Remainder& remainder) {
  std::vector<Part> parts;
  for (const auto& [name, share] :
       {std::pair("explained", remainder.explained), std::pair("systematic", remainder.systematic),
        std::pair("not repeatable", remainder.not_repeatable), std::pair("sensors", remainder.sensors)}) {
    if (std::isfinite(share)) parts.push_back({name, share});
  }
  return parts;
}

std::vector<std::string> NextSentences(const Diagnosis& d) {
  std::vector<std::string> sentences = OfTheQuestion(d.next);
  if (d.next.input_csv.empty() && LeavesMuch(d) && !std::isfinite(d.remainder.not_repeatable)) {
    sentences.emplace_back(
        "No two of these logs have the same commands. Send those of one log again: only that tells how much of what is "
        "left no model could mend.");
  }
  return sentences;
}

std::string BoundText(const Statement& statement) {
  if (statement.bounds.empty()) return "";
  const EffectEstimate& bound = statement.bounds.front();
  return ShortNumber(bound.value, 2) + UnitAfter(bound.unit);
}

}  // namespace gapscope
