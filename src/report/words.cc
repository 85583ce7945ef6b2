#include "src/report/words.h"

#include <fmt/format.h>

#include <algorithm>
#include <charconv>
#include <cmath>

#include "src/core/collect.h"
#include "src/core/statistics.h"
#include "src/report/sentences.h"

namespace gapscope {
namespace {

constexpr const char* kUnknown = "–";

std::string WholePercent(double share) {
  return std::isfinite(share) ? fmt::format("{:.0f} %", std::floor(100 * share + 0.5)) : kUnknown;
}

// What happened to the error from one stage to the next.
std::string ChangeText(double before, double after) {
  const double change = after / before - 1;
  if (!(before > 0) || std::abs(change) < 0.005) return "";
  if (change < -0.9) return fmt::format("{} times smaller", ShortNumber(before / after, 2));
  return fmt::format("{}{:.0f} %", change < 0 ? "−" : "+", std::floor(100 * std::abs(change) + 0.5));
}

// A stage whose error is not known is not shown.
void AddStage(std::vector<Stage>* stages, const std::string& name, double error, Stage::Mark mark = Stage::Mark::kNone,
              double share_of_gap = kNaN) {
  if (!std::isfinite(error)) return;
  Stage stage{.name = name, .error = error, .mark = mark, .change = {}};
  if (!stages->empty() && mark != Stage::Mark::kFloor) stage.change = ChangeText(stages->back().error, error);
  if (std::isfinite(share_of_gap))
    stage.change += fmt::format("{}{} of what closes", stage.change.empty() ? "" : ", ", WholePercent(share_of_gap));
  stages->push_back(std::move(stage));
}

std::vector<std::string> WordsOf(const std::vector<EffectUse>& uses) {
  return Collect(uses, [](const EffectUse& use) { return Words(use); });
}

const char* HowItFollows(const ReplayRun& run) {
  const auto& logs = run.result.logs;
  const double error = run.comparison.error;
  if (std::ranges::any_of(logs, [](const LogReplay& log) { return log.outcome == Outcome::kDiverged; }))
    return "runs away";
  if (error < kFollowsClosely) return "follows the measured motion closely";
  if (error < kFollows) return "follows the measured motion";
  if (error < kClearlyOff) return "is clearly off the measured motion";
  return "hardly follows the measured motion";
}

// The signal with the greatest error; null: no signal.
const SignalScore* Worst(const Comparison& comparison) {
  const auto badness = [](const SignalScore& s) { return std::isfinite(s.nrmse) ? s.nrmse : kInfinity; };
  const SignalScore* worst = nullptr;
  for (const auto& log : comparison.logs) {
    for (const auto& signal : log.signals) {
      if (!worst || badness(signal) > badness(*worst)) worst = &signal;
    }
  }
  return worst;
}

std::string TitleOf(const Diagnosis& d, const std::string& found) {
  const Remainder& left = d.remainder;
  const char* most = left.systematic > left.explained ? " Most of the misfit no known effect explains." : "";
  switch (d.verdict) {
    case Verdict::kNone:
      return "Nothing is missing: the model explains these logs down to what the sensors can show.";
    case Verdict::kParameters:
      return "No effect is missing: other parameter values close the gap.";
    case Verdict::kEffects:
      return "The model lacks " + found + "." + most;
    case Verdict::kAmbiguous:
      return "The model lacks " + Listed(Collect(SentencesOf(d), [](const Sentence& s) { return s.what; })) +
             ". These logs cannot tell which, where it says or." + most;
    case Verdict::kUnknown:
      return "Something is missing that no known effect explains.";
  }
  return "";
}

}  // namespace

std::string ShortNumber(double value, int digits) {
  if (!std::isfinite(value)) return kUnknown;
  const std::string rounded = fmt::format("{:.{}e}", value, digits - 1);
  double number = 0;
  std::from_chars(rounded.data(), rounded.data() + rounded.size(), number);
  const double size = std::abs(number);
  char buffer[64];
  const auto format =
      size == 0 || (size >= 1e-7 && size < 1e21) ? std::chars_format::fixed : std::chars_format::scientific;
  return {buffer, std::to_chars(buffer, buffer + sizeof buffer, number, format).ptr};
}

std::string Words(const EffectUse& use) {
  const auto& catalogue = Catalogue();
  const auto effect = std::ranges::find(catalogue, use.effect, &Effect::name);
  const bool of_signals = effect != catalogue.end() && effect->place == EffectPlace::kSignal;
  return EffectTitle(use.effect) + " on " +
         (use.on != kOnAll ? use.on
          : of_signals     ? "all measured signals"
                           : "all drives");
}
std::string Words(const Explanation& explanation) { return explanation ? Words(*explanation) : "none"; }

std::string Listed(const std::vector<std::string>& parts, const std::string& joiner) {
  std::string text;
  for (std::size_t i = 0; i < parts.size(); ++i)
    text += (i == 0 ? "" : i + 1 < parts.size() ? ", " : " " + joiner + " ") + parts[i];
  return text;
}

std::string UnitAfter(const std::string& unit) { return unit.empty() || unit == "1" ? "" : " " + unit; }

Headline HeadlineOf(const ReplayRun& run) {
  const double error = run.comparison.error;
  const std::string effects = Listed(WordsOf(run.model.effects));
  Headline headline{.kind = "Replay"};
  headline.title =
      fmt::format("{} {}.", effects.empty() ? "The model" : "The model with " + effects, HowItFollows(run));
  headline.sentences.push_back(fmt::format(
      "Error {}: root mean square of measured less predicted, over the motion's own spread.", ShortNumber(error, 3)));
  if (const SignalScore* worst = Worst(run.comparison); worst && std::isfinite(worst->nrmse))
    headline.sentences.push_back(fmt::format("Largest in {} ({}).", worst->signal, ShortNumber(worst->nrmse, 3)));
  if (std::isfinite(run.other_error)) {
    const char* other = run.result.mode == ReplayMode::kWindows ? "In one free run over the log"
                                                                : "In windows that each start from the log";
    headline.sentences.push_back(fmt::format("{} it is {}.", other, ShortNumber(run.other_error, 3)));
  }
  if (std::isfinite(run.nominal_error)) {
    AddStage(&headline.stages, "nominal", run.nominal_error);
    AddStage(&headline.stages, effects.empty() ? "with the values given" : "with " + effects, error,
             error < run.nominal_error ? Stage::Mark::kBest : Stage::Mark::kNone);
  }
  return headline;
}

Headline HeadlineOf(const TuneRun& run) {
  constexpr double kLeastGain = 0.05;
  const std::size_t count = run.parameters.size();
  const double gain = run.error_nominal > 0 ? 1 - run.error_held_out / run.error_nominal : 0;
  Headline headline{.kind = "Tuning"};
  headline.title = gain > kLeastGain
                       ? fmt::format("Tuning {} parameters cuts the held-out error by {}.", count, WholePercent(gain))
                       : fmt::format("Tuning {} parameters does not help on held-out data.", count);
  headline.sentences.push_back(fmt::format("From {} to {} on data that the fit did not see ({}); {} on what it saw.",
                                           ShortNumber(run.error_nominal, 3), ShortNumber(run.error_held_out, 3),
                                           run.held_out_by, ShortNumber(run.error_train, 3)));
  const auto open = std::ranges::count(run.parameters, false, &TuneRun::Parameter::identifiable);
  if (open > 0) headline.sentences.push_back(fmt::format("{} of them cannot be known from these logs alone.", open));
  if (!run.starts_agree)
    headline.sentences.push_back("The starting points end in different places: a better fit may exist.");
  AddStage(&headline.stages, "nominal", run.error_nominal);
  AddStage(&headline.stages, "tuned", run.error_held_out, Stage::Mark::kBest);
  headline.notes = ParameterNotes(run);
  return headline;
}

Headline HeadlineOf(const DiagnoseRun& run) {
  const Diagnosis& d = run.diagnosis;
  const auto found = Collect(d.effects, [](const auto& effect) { return Words(effect.use); });
  Headline headline{.kind = "Diagnosis",
                    .title = TitleOf(d, Listed(found)),
                    .confidence = d.probability,
                    .explanation = d.explanation};
  headline.sentences.push_back(
      fmt::format("Held-out error {} with nominal parameters, {} with the best parameters, {} with what was found.",
                  ShortNumber(d.nominal, 3), ShortNumber(d.refit, 3), ShortNumber(d.final, 3)));
  if (std::isfinite(d.closed) && d.verdict != Verdict::kNone) {
    headline.sentences.push_back(fmt::format("That closes {} of the gap down to the floor of {}.",
                                             WholePercent(d.closed), ShortNumber(d.floor, 3)));
  }
  AddStage(&headline.stages, "nominal", d.nominal);
  AddStage(&headline.stages, "best parameters", d.refit);
  // An effect's own error_after is that of the final model: with the others of the verdict. What it reaches alone
  // stands before the next one.
  for (std::size_t i = 0; i < d.effects.size(); ++i) {
    const bool last = i + 1 == d.effects.size();
    const double error =
        last ? (std::isfinite(d.final) ? d.final : d.effects[i].error_after) : d.effects[i + 1].error_before;
    // A group has one share: it stands where the last of its members is added.
    const auto& together = d.effects[i].together;
    const bool goes_on = !last && std::find(together.begin(), together.end(), d.effects[i + 1].use) != together.end();
    AddStage(&headline.stages, "with " + found[i], error, last ? Stage::Mark::kBest : Stage::Mark::kNone,
             goes_on ? kNaN : d.effects[i].share_of_gap);
  }
  if (d.effects.empty() && d.final != d.refit) AddStage(&headline.stages, "final", d.final, Stage::Mark::kBest);
  AddStage(&headline.stages, "floor of the sensors", d.floor, Stage::Mark::kFloor);
  return headline;
}

}  // namespace gapscope
