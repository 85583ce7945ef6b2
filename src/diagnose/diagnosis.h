// Which unmodelled effect causes the gap between prediction and measurement, and how far the gap shrinks with it.
// Method: docs/diagnosis.md.
#ifndef GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_
#define GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_

#include <optional>
#include <string>
#include <vector>

#include "src/compare/conditions.h"
#include "src/tune/tune.h"

namespace gapscope {

enum class Verdict { kNone, kParameters, kEffects, kAmbiguous, kUnknown };
std::string VerdictName(Verdict verdict);

struct EffectEstimate {
  std::string key, unit;
  double value = 0, low = 0, high = 0;
};

// An effect of the verdict.
struct FoundEffect {
  EffectUse use;
  std::string meaning, signature;  // of the catalogue, for where it acts
  double probability = 0;
  std::vector<EffectEstimate> parameters;
  double error_before = 0, error_after = 0;  // held out, normalised
  double share_of_gap = 0;                   // averaged over the order of adding
};

// What may explain the logs alone: an effect, or nothing but the base model.
using Explanation = std::optional<EffectUse>;
std::string NameOf(const Explanation& explanation);  // "cable_spring@arm", "none"

// An explanation that was tried.
struct CandidateReport {
  Explanation effect;
  double probability = 0;     // over single explanations; adds up to one
  double held_out_error = 0;  // normalised; NaN: not refitted
  double screen_drop = 0;     // share of the baseline's cost that the score test promises
  double absorbed = 0;        // share of its trace that the baseline can imitate
  bool refitted = false, converged = false;
  double bic = 0;      // lower is better
  std::string reason;  // why it was, or was not, accepted
};

// What the verdict and its probability rest on.
struct VerdictEvidence {
  double floors_before = 0,
         floors_left =
             0;        // residual over the sensors' noise, root mean square, held out: refitted base model, final model
  double removed = 0;  // share of what exceeds the noise that went away, in windows
  double free_run_before = 0, free_run_left = 0,
         free_run_removed =
             0;  // normalised errors of one free run a log, and the share that went away; infinity, 0: it diverges
  double gain_train = 0,
         gain_held_out = 0;  // of the last effect (or the best one that was not accepted): shares of its parent's cost
  double z = 0;              // over its standard error
  double rival_lead = 0, rival_z = 0;  // lead over the nearest rival: share of that gain, standard errors
};

struct Diagnosis {
  Verdict verdict = Verdict::kNone;
  double probability = 0;
  std::vector<FoundEffect> effects;
  std::vector<std::vector<EffectUse>> ambiguous;  // groups that these logs cannot tell apart
  // Held-out errors, normalised: see ReplayError; in windows.
  double nominal = 0, refit = 0, final = 0, floor = 0, closed = 0;
  VerdictEvidence evidence;
  std::vector<ConditionShare> where;    // the refitted base model's error, by condition
  std::vector<ConditionShare> remains;  // the final model's
  std::vector<CandidateReport> candidates;
  std::vector<CandidateReport>
      seconds;  // tried beside the first effect, the most promising by the score test first; without probabilities
  std::string next_command;
  std::vector<Explanation> next_separates;
  std::vector<std::string> train_logs, held_out_logs;
  std::string split, explanation;
  double wall_s = 0;
  bool budget_spent = false;
  bool uneven = false;                 // train and held-out logs show the gap very differently
  std::shared_ptr<const Model> model;  // with the effects found
  std::vector<double> values;
  std::shared_ptr<const Model> refit_model;  // the base model, refitted
  std::vector<double> refit_values;
};

struct DiagnoseOptions {
  double budget_s = 60;
  double window_s = 1.0;
  double sample_s = 0.004;  // logs are searched on stamps at least this far apart
  unsigned long seed = 0;
  std::size_t max_windows = 36;  // of the training logs
  std::function<void(const std::string&)> progress;
};

Result<Diagnosis> Diagnose(const Experiment& experiment, const DataSplit& data, const DiagnoseOptions& options,
                           ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_
