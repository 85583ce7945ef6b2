#include "src/diagnose/explain.h"

#include <fmt/core.h>

#include <algorithm>
#include <cmath>

#include "src/diagnose/rules.h"

namespace gapscope {

std::string Reason(const Candidate& candidate, const SearchResult& found) {
  const Candidate &base = *found.base, &chosen = *found.chosen;
  if (&candidate == &base) {
    return &chosen == &base ? "no effect explains the logs better by more than chance"
                            : fmt::format("{} removes {:.1f} % of its held-out cost", chosen.Name(),
                                          100 * Compare(base, chosen).held_out);
  }
  if (candidate.held_out_blocks.empty()) return "its fit cannot be simulated along the held-out logs";
  const std::string converged = candidate.converged ? "" : " (fit not converged)";
  const Evidence gain = Compare(base, candidate);
  if (chosen.effects.size() == 2 && candidate.effects.front() == chosen.effects.back()) {
    const Evidence more = Compare(*found.single, chosen);
    return fmt::format("accepted beside {}: removes {:.1f} % of what that leaves ({:.1f} standard errors)",
                       found.single->Name(), 100 * more.held_out, more.z);
  }
  if (std::find(chosen.effects.begin(), chosen.effects.end(), candidate.effects.front()) != chosen.effects.end()) {
    return fmt::format("accepted: removes {:.1f} % of the held-out cost ({:.1f} standard errors){}",
                       100 * gain.held_out, gain.z, converged);
  }
  if (!Convincing(gain, FirstLimits(base))) {
    const char* why =
        Convincing(gain, kFirst) ? "too little where the base model is near the noise" : "not more than chance";
    return fmt::format("removes {:.2f} % of the held-out cost ({:.1f} standard errors): {}{}", 100 * gain.held_out,
                       gain.z, why, converged);
  }
  const Evidence behind = Compare(candidate, chosen);
  return fmt::format(
      "removes {:.1f} % of the held-out cost, but {} removes {:.1f} % of what it leaves ({:.1f} standard errors){}",
      100 * gain.held_out, chosen.Name(), 100 * behind.held_out, behind.z, converged);
}

namespace {

// What was accepted and how far it goes, without the last full stop.
std::string ExplainEffects(const Diagnosis& d) {
  std::string text;
  for (const auto& found : d.effects) {
    text += fmt::format("{} explains {:.0f} % of the gap that closes ({}; signature: {}). ", found.use.Text(),
                        100 * found.share_of_gap, found.meaning, found.signature);
  }
  return text + fmt::format("With {} the held-out error is {:.3g}, {:.1f} times the noise",
                            d.effects.size() > 1 ? "them" : "it", d.final, d.evidence.floors_left);
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
          "see.";
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
      text +=
          d.effects.empty()
              ? fmt::format("No known effect explains what remains: the best leaves {:.1f} times the sensors' noise.",
                            d.evidence.floors_left)
              : ExplainEffects(d) + ", and no known effect explains what remains.";
      if (!d.remains.empty())
        text += " It lies mostly at: " + d.remains.front().signal + ", " + d.remains.front().condition + ".";
      break;
  }
  const VerdictEvidence& e = d.evidence;
  if (!d.effects.empty() && std::isfinite(e.free_run_before) && std::isfinite(e.free_run_left)) {
    text += fmt::format(" Over whole logs in one run the error goes from {:.3g} to {:.3g}.", e.free_run_before,
                        e.free_run_left);
  }
  if (d.budget_spent) text += " The time budget ended the search early.";
  return text;
}

}  // namespace gapscope
