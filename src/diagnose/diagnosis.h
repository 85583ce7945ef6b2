// Which unmodelled effect causes the gap between prediction and measurement, and how far the gap shrinks with it. Method: docs/diagnosis.md.
#ifndef GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_
#define GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_

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
  double probability = 0;
  std::vector<EffectEstimate> parameters;
  double error_before = 0, error_after = 0;  // held out, normalised
  double share_of_gap = 0;                   // averaged over the order of adding
};

// An effect that was tried, or "none".
struct CandidateReport {
  std::string name;             // "cable_spring@arm"
  double probability = 0;       // over single explanations; adds up to one
  double held_out_error = 0;    // normalised; NaN: not refitted
  double screen_drop = 0;       // share of the baseline's cost that the score test promises
  double absorbed = 0;          // share of its trace that the baseline can imitate
  bool refitted = false, converged = false;
  std::string reason;           // why it was, or was not, accepted
};

struct Diagnosis {
  Verdict verdict = Verdict::kNone;
  double probability = 0;
  std::vector<FoundEffect> effects;
  std::vector<std::vector<std::string>> ambiguous;
  // Held-out errors, normalised: see ReplayError; in windows.
  double nominal = 0, refit = 0, final = 0, floor = 0, closed = 0;
  double floors_left = 0;       // residual over the sensors' noise, root mean square, with the final model
  std::vector<ConditionShare> where;
  std::vector<CandidateReport> candidates;
  std::string next_command;
  std::vector<std::string> next_separates;
  std::vector<std::string> train_logs, held_out_logs;
  std::string split, explanation;
  double wall_s = 0;
  bool budget_spent = false;
  bool uneven = false;          // train and held-out logs show the gap very differently
  std::shared_ptr<const Model> model;   // with the effects found
  std::vector<double> values;
};

struct DiagnoseOptions {
  double budget_s = 60;
  double window_s = 1.0;
  unsigned long seed = 0;
  std::size_t max_windows = 36;     // of the training logs
  std::function<void(const std::string&)> progress;
};

Result<Diagnosis> Diagnose(const Experiment& experiment, const DataSplit& data, const DiagnoseOptions& options, ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_
