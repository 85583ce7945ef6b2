#include "src/diagnose/left_out.h"

#include <algorithm>
#include <cmath>

#include "src/core/statistics.h"
#include "src/diagnose/policy.h"

namespace gapscope {
namespace {

// Training logs number `fold`, and each `folds`th after it, kept back from the fit.
DataSplit WithoutLogs(const DataSplit& data, std::size_t fold, std::size_t folds) {
  DataSplit split;
  for (std::size_t l = 0; l < data.train.size(); ++l)
    (l % folds == fold ? split.held_out : split.train).push_back(data.train[l]);
  if (!data.asked) split.train.insert(split.train.end(), data.held_out.begin(), data.held_out.end());
  return split;
}

// The same of the training windows.
Workbench WithoutWindows(const Workbench& bench, std::size_t fold, std::size_t folds) {
  std::vector<LogWindow> kept;
  for (std::size_t w = 0; w < bench.windows->size(); ++w) {
    if (w % folds != fold) kept.push_back((*bench.windows)[w]);
  }
  Workbench without = bench;
  without.windows = std::make_shared<const std::vector<LogWindow>>(std::move(kept));
  return without;
}

// The model of `fitted`, its parameters fitted anew to what `bench` trains with. Empty: it cannot be simulated.
std::optional<Candidate> FitAgain(const Workbench& bench, const Candidate& fitted) {
  auto made = MakeCandidate(bench, fitted.effects);
  if (!made.ok()) return std::nullopt;
  Candidate& candidate = made.value();
  const double share = static_cast<double>(candidate.problem->residuals()) /
                       static_cast<double>(std::max<std::size_t>(1, fitted.problem->residuals()));
  const EvidencePolicy& policy = kDiagnosePolicy.evidence;
  FitCandidate(bench, &candidate, candidate.problem->At(fitted.values, candidate.problem->Start()),
               {.iterations = policy.left_out_iterations,
                .tolerance = policy.left_out_tolerance,
                .least_known = share * fitted.train_cost});
  if (!std::isfinite(candidate.train_cost)) return std::nullopt;
  return std::move(candidate);
}

// On the held-out logs of `bench`.
BlockErrors ErrorsOf(const Workbench& bench, std::optional<Candidate> candidate) {
  if (!candidate) return {};
  ScoreCandidate(bench, &*candidate);
  return std::move(candidate->held_out);
}

void Append(const std::vector<Recording>& logs, const BlockErrors& before, const BlockErrors& after,
            const std::vector<double>& noise, std::vector<LogGap>* gaps) {
  const std::vector<double> refits = NormalisedErrors(before), finals = NormalisedErrors(after);
  for (std::size_t l = 0; l < logs.size(); ++l) {
    const double refit = l < refits.size() ? refits[l] : kInfinity, final = l < finals.size() ? finals[l] : kInfinity;
    const std::span left = std::span(after).subspan(std::min(l, after.size())).first(l < after.size() ? 1 : 0);
    gaps->push_back({.log = logs[l].log_path,
                     .refit = refit,
                     .final = final,
                     .floor = std::min(FloorError({&logs[l], 1}, left, noise), final),
                     .from_s = logs[l].start_s,
                     .until_s = logs[l].start_s + logs[l].duration_s()});
  }
}

// How many parts are left out, of so many logs or windows.
std::size_t Folds(std::size_t parts) { return std::min(kDiagnosePolicy.evidence.folds, parts); }

void LeaveLogsOut(const Workbench& bench, const Candidate& base, const Candidate& final,
                  const std::vector<double>& noise, LeftOut* result) {
  // The held-out logs were left out of the first fit.
  if (!bench.data->asked) result->values.push_back(final.values);
  const std::size_t folds = Folds(bench.data->train.size());
  for (std::size_t fold = 0; fold < folds && !bench.TimeIsOver(); ++fold) {
    const DataSplit split = WithoutLogs(*bench.data, fold, folds);
    if (split.train.empty()) return;
    const Workbench without = WithLogs(bench, split, *base.model);
    std::optional<Candidate> again = FitAgain(without, final);
    if (again) result->values.push_back(again->values);
    Append(split.held_out, ErrorsOf(without, FitAgain(without, base)), ErrorsOf(without, std::move(again)), noise,
           &result->gaps);
  }
}

void LeaveWindowsOut(const Workbench& bench, const Candidate& final, LeftOut* result) {
  if (bench.windows->size() < 2) return;
  const std::size_t folds = Folds(bench.windows->size());
  for (std::size_t fold = 0; fold < folds && !bench.TimeIsOver(); ++fold) {
    if (const auto again = FitAgain(WithoutWindows(bench, fold, folds), final)) result->values.push_back(again->values);
  }
}

}  // namespace

double FloorError(std::span<const Recording> logs, std::span<const BlockErrors::value_type> errors,
                  const std::vector<double>& noise) {
  double sum = 0, signals = 0;
  for (std::size_t l = 0; l < logs.size(); ++l) {
    for (std::size_t s = 0; s < logs[l].measured.size(); ++s) {
      const auto& measured = logs[l].measured[s];
      const double error = l < errors.size() ? errors[l][s].Rms() : kInfinity,
                   share = std::min(noise[measured.index], error) / MomentsOf(measured.values).deviation;
      if (measured.spec.scored && std::isfinite(share)) sum += share * share, signals += 1;
    }
  }
  return std::sqrt(sum / std::max(1.0, signals));
}

double ClosedShare(double refit, double final, double floor) {
  return refit > floor ? std::clamp((refit - final) / (refit - floor), 0.0, 1.0) : 0;
}

std::optional<ClosedByLog> ClosedOf(std::span<const LogGap> gaps) {
  std::vector<double> shares;
  for (const LogGap& gap : gaps) {
    if (std::isfinite(gap.refit)) shares.push_back(ClosedShare(gap.refit, gap.final, gap.floor));
  }
  if (shares.size() < 2) return std::nullopt;
  std::sort(shares.begin(), shares.end());
  const double median = (shares[(shares.size() - 1) / 2] + shares[shares.size() / 2]) / 2;
  return ClosedByLog{.median = median, .least = shares.front(), .most = shares.back(), .logs = shares.size()};
}

LeftOut LeaveOut(const Workbench& bench, const Candidate& base, const Candidate& final,
                 const std::vector<double>& noise) {
  LeftOut result;
  Append(bench.data->held_out, base.held_out, final.held_out, noise, &result.gaps);
  if (final.effects.empty()) return result;
  if (bench.by_windows)
    LeaveWindowsOut(bench, final, &result);
  else
    LeaveLogsOut(bench, base, final, noise, &result);
  return result;
}

}  // namespace gapscope
