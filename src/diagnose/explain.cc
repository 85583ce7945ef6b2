#include "src/diagnose/explain.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "src/diagnose/candidate.h"
#include "src/diagnose/policy.h"

namespace gapscope {

namespace {

// What was accepted and how far it goes, without the last full stop.
std::string ExplainEffects(const Diagnosis& d) {
  std::string text;
  for (auto found = d.effects.begin(); found != d.effects.end(); ++found) {
    // A group is told once, by its first member.
    const bool told = std::any_of(d.effects.begin(), found, [&](const FoundEffect& earlier) {
      return std::count(found->together.begin(), found->together.end(), earlier.use) > 0;
    });
    if (told) continue;
    text += fmt::format("{} explains {:.0f} % of the gap that closes ({}; signature: {}). ",
                        found->use.Text() + TogetherWith(*found), 100 * found->share_of_gap, found->meaning,
                        found->signature);
  }
  return text + fmt::format("With {} the held-out error is {:.3g}, {:.1f} times the noise",
                            d.effects.size() > 1 ? "them" : "it", d.final, d.evidence.floors_left);
}

// The base model's parameters that retuning moved, the furthest first: "pan.kp from 500 to 575 N m/rad". None: empty.
std::string RetunedText(const Diagnosis& d) {
  constexpr std::size_t kMost = 5;
  constexpr double kLeast = 0.02;  // of its range
  if (!d.refit_model) return "";
  std::vector<std::pair<double, std::string>> moved;
  for (std::size_t i = 0; i < d.refit_model->parameters().size(); ++i) {
    const Parameter& p = d.refit_model->parameters()[i];
    const double from = d.nominal_values[i], to = d.refit_values[i];
    const double share = std::abs(PlaceInRange(to, p.low, p.high) - PlaceInRange(from, p.low, p.high));
    if (from == to || !(share > kLeast)) continue;
    const std::string unit = p.unit == "1" ? "" : " " + p.unit;
    moved.emplace_back(share, fmt::format("{} from {:.3g} to {:.3g}{}", p.name, from, to, unit));
  }
  std::stable_sort(moved.begin(), moved.end(), [](const auto& a, const auto& b) { return a.first > b.first; });
  std::string text;
  for (std::size_t i = 0; i < std::min(kMost, moved.size()); ++i) text += (i > 0 ? ", " : " ") + moved[i].second;
  if (moved.size() > kMost) text += fmt::format(" and {} more", moved.size() - kMost);
  return text.empty() ? "" : " Retuning moves" + text + ".";
}

std::string EarlyEnd(const Diagnosis& d) {
  if (d.interrupted) return " It was interrupted: this is the best so far.";
  if (d.cut.empty()) return "";
  const auto left = std::ranges::count(d.statements, kNotTried, &Statement::rule);
  return left == 0 ? " The budget ended the search early."
                   : fmt::format(" The budget ended the search early: {} that may explain something was not tried.",
                                 left == 1 ? "one effect" : fmt::format("each of {} effects", left));
}

// Of several signals: how much each one misses.
std::string FloorsText(const VerdictEvidence& e) {
  constexpr std::size_t kMost = 3;
  std::string text;
  for (std::size_t i = 0; e.signals.size() > 1 && i < std::min(kMost, e.signals.size()); ++i)
    text += fmt::format("{}{} {:.1f}", i ? ", " : ": ", e.signals[i].signal, e.signals[i].floors);
  return text;
}

std::string FreeRunText(const Diagnosis& d) {
  const VerdictEvidence& e = d.evidence;
  if (d.effects.empty() || !std::isfinite(e.free_run_before) || !std::isfinite(e.free_run_left)) return "";
  if (AreLost(e.free_run_before, e.free_run_left))
    return " Over whole logs in one run the model leaves the logged motion, with what was found as without it.";
  return fmt::format(" Over whole logs in one run the error goes from {:.3g} to {:.3g}.", e.free_run_before,
                     e.free_run_left);
}

}  // namespace

std::string Explain(const Diagnosis& d) {
  std::string text = fmt::format(
      "Held out, the nominal model misses by {:.3g} of the signals' standard deviation; retuning its parameters brings "
      "that to {:.3g} ({:.1f} times the sensors' noise). ",
      d.nominal, d.refit, d.evidence.floors_before);
  switch (d.verdict) {
    case Verdict::kNone:
      text += "The model explains the logs down to their noise: there is no gap to explain.";
      break;
    case Verdict::kParameters:
      text +=
          "Retuned parameters close the gap; no further effect improves the prediction of logs that the fit did not "
          "see." +
          RetunedText(d);
      break;
    case Verdict::kEffects:
    case Verdict::kAmbiguous: {
      text += ExplainEffects(d) + ".";
      if (d.verdict == Verdict::kAmbiguous) {
        text += " But these logs cannot tell";
        for (std::size_t g = 0; g < d.ambiguous.size(); ++g) {
          const auto& group = d.ambiguous[g];
          text += (g ? ", nor " : " ") + group.front().Text() + " from";
          for (std::size_t i = 1; i < group.size(); ++i) text += (i > 1 ? " or " : " ") + group[i].Text();
        }
        text += ": what each leaves unexplained is the same.";
      }
      break;
    }
    case Verdict::kUnknown:
      if (d.interrupted && d.statements.empty())
        text += "No effect was looked at.";
      else
        text += fmt::format("No known effect explains what remains: the best leaves {:.1f} times the sensors' noise{}.",
                            d.evidence.floors_left, FloorsText(d.evidence));
      if (!d.remains.empty())
        text += " It lies mostly at: " + d.remains.front().signal + ", " + d.remains.front().condition + ".";
      text += RetunedText(d);
      break;
  }
  text += FreeRunText(d);
  if (!d.at_bounds.empty()) {
    std::string names;
    for (const auto& p : d.at_bounds)
      names += fmt::format("{}{} ({:.3g} {})", names.empty() ? "" : ", ", p.name, p.value, p.unit);
    text += " On a bound of the experiment file or beyond it, which was widened, ended: " + names + ".";
  }
  if (d.data_s < kDiagnosePolicy.evidence.least_data_s)
    text +=
        fmt::format(" The logs hold {:.0f} s in all: on so little, what is absent may only not have shown.", d.data_s);
  if (d.model) {
    for (const LeftOutCandidate& candidate : d.model->rig()->left_out())
      text += " Not asked about: " + candidate.Text() + ".";
  }
  return text + EarlyEnd(d);
}

}  // namespace gapscope
