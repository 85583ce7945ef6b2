// One explanation of the logs: the base model with a set of effects, refitted on the training logs and scored on the held-out ones.
#ifndef GAPSCOPE_DIAGNOSE_CANDIDATE_H_
#define GAPSCOPE_DIAGNOSE_CANDIDATE_H_

#include <memory>
#include <string>
#include <vector>

#include "src/tune/tune.h"

namespace gapscope {

struct Candidate {
  std::vector<EffectUse> effects;
  std::shared_ptr<const Model> model;
  std::unique_ptr<FitProblem> problem;   // on the training logs
  FitPoint point;
  double train_cost = 0;
  bool converged = false;
  std::vector<double> values;
  double shift_s = 0;
  std::vector<double> held_out_blocks;   // cost per half second; empty: cannot be simulated there
  double held_out_cost = 0;
  std::size_t parameters = 0;            // of the effects
  std::string Name() const;
};

// What all candidates share.
struct Workbench {
  const Experiment& experiment;
  const DataSplit& data;
  const ScaleTable& scales;
  ThreadPool& pool;
  std::vector<double> weights;   // per experiment signal: 1 / noise
  double window_s = 1;
  double time_step_s = 0;
  std::size_t max_windows = 0;
  Deadline deadline;
  bool by_windows = false;       // train and held-out logs are the same: every third window is held out

  FitOptions Options(const Model& model, bool train) const;
};

// The model of `effects`, unfitted. Errors: effects that do not go together.
Result<Candidate> MakeCandidate(const Workbench& bench, const std::vector<EffectUse>& effects);
// Fits from `start` on the training logs.
void FitCandidate(const Workbench& bench, Candidate* candidate, const FitPoint& start, int iterations, double tolerance);
// Fills the held-out fields.
void ScoreCandidate(const Workbench& bench, Candidate* candidate);

// By how much `b` explains the held-out logs better than `a`, block by block.
struct PairedGain {
  double gain = 0;      // cost of a less cost of b
  double relative = 0;  // of a's cost
  double z = 0;         // gain over its standard error, blocks taken as independent
};
PairedGain CompareCandidates(const Candidate& a, const Candidate& b);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_CANDIDATE_H_
