// One explanation of the logs: the base model with a set of effects, refitted on the training logs and scored on the
// held-out ones.
#ifndef GAPSCOPE_DIAGNOSE_CANDIDATE_H_
#define GAPSCOPE_DIAGNOSE_CANDIDATE_H_

#include <algorithm>
#include <functional>
#include <map>
#include <memory>
#include <set>
#include <string>
#include <vector>

#include "src/diagnose/block_errors.h"
#include "src/diagnose/diagnosis_journal.h"
#include "src/diagnose/free_runs.h"
#include "src/diagnose/limb_cost.h"
#include "src/tune/tune.h"

namespace gapscope {

struct Candidate {
  std::vector<EffectUse> effects;
  std::shared_ptr<const Model> model;
  std::unique_ptr<FitProblem> problem;  // on the training logs
  FitPoint point;
  std::shared_ptr<const Derivatives> derivatives;  // there, as far as they were kept up; null: not at hand
  double train_cost = 0;
  std::vector<LimbCost> train_limbs;  // the same by limbs
  bool converged = false;
  bool scored = false;
  std::vector<double> values;
  StampShift stamps;
  double held_out_cost = 0;
  std::vector<LimbCost> held_out_limbs;
  double held_out_floors = 0;  // root mean square of residual over noise
  double held_out_error = 0;   // normalised: see ReplayError; in windows
  BlockErrors held_out;
  FitPoint held_out_point;     // of the problem there: initial states and offsets
  std::size_t parameters = 0;  // of the effects
  std::string Name() const;
};

// Finite differences of a fit's Jacobians, in search coordinates. The first ones look ahead as far as steps go. The
// last ones are as fine as replays, which are exact, allow: a coarser Jacobian is bent, and fits end early in curved
// valleys.
inline constexpr double kCoarseStep = 0.03, kFineStep = 3e-4;

using Say = std::function<void(const std::string&)>;

// What all candidates share.
struct Workbench {
  std::shared_ptr<const Rig> rig;
  const DataSplit* data;
  const ScaleTable& scales;
  ThreadPool& pool;
  std::vector<double> weights;  // per experiment signal: 1 / noise
  double window_s = 1;
  double time_step_s = 0;
  double sample_s = 0;                                    // of the logs as they are: what a delay must exceed
  std::size_t max_windows = 0;                            // to fit; of held-out logs half as many
  std::size_t all_windows = 0;                            // that the training logs have
  std::shared_ptr<const std::vector<LogWindow>> windows;  // of the training logs: the same for all candidates
  Deadline deadline;
  std::shared_ptr<Work> work = std::make_shared<Work>();  // done so far
  std::size_t most_steps = 0;                             // of the simulator; 0: no limit
  std::map<std::string, double> priors;                   // DiagnoseOptions::priors
  std::vector<EffectUse> known;                           // in every model
  std::map<std::string, double> values;                   // DiagnoseOptions::values
  std::set<std::string> frozen;                           // DiagnoseOptions::frozen
  // Of base parameters, where they were widened.
  std::shared_ptr<std::map<std::string, std::pair<double, double>>> bounds =
      std::make_shared<std::map<std::string, std::pair<double, double>>>();
  // Of the base model: as it is given, then where it is fitted.
  std::shared_ptr<Coupling> coupling = std::make_shared<Coupling>();
  Contacts contacts = Contacts::kAsTheMjcf;
  bool by_windows = false;              // train and held-out logs are the same: every third window is held out
  DiagnosisJournal* journal = nullptr;  // null: none

  FitOptions Options(const Model& model, bool train) const;
  // What fits move: indices of parameters.
  std::vector<int> FreeParameters(const Model& model) const;
  // Where fits start: nominal values, and those that are known better; known effects where an effect's trial starts.
  std::vector<double> Nominal(const Model& model) const;
  // A statement's probability before the logs were seen: even odds, or as the user says.
  double PriorOf(const EffectUse& use) const;
  // By limb, whether it can move by the effect.
  std::vector<char> LimbsOf(const EffectUse& use) const { return coupling->LimbsOf(coupling->OfPlace(use.on, *rig)); }
  // `share` of the work is spent, or the time where one was asked for.
  bool Late(double share) const {
    return (most_steps > 0 && static_cast<double>(work->steps) > share * static_cast<double>(most_steps)) ||
           TimeIsOver();
  }
  // What was done in time before an interruption is not cut afterwards.
  bool TimeIsOver() const { return !(journal && journal->replaying()) && IsLate(deadline); }
};

// The windows to fit are chosen once, not by every candidate: of long logs that is a look at every row.
void ChooseWindows(const Model& model, std::size_t max_windows, Workbench* bench);
// The same work on other logs, which must outlive what is made of it.
Workbench WithLogs(const Workbench& bench, const DataSplit& data, const Model& model);

bool Has(const std::vector<EffectUse>& set, const EffectUse& use);

// The model of `effects`, unfitted. Errors: effects that do not go together.
Result<Candidate> MakeCandidate(const Workbench& bench, const std::vector<EffectUse>& effects);
// Fills train_limbs. Of one limb that needs no replay.
void SplitTrainCost(const Workbench& bench, Candidate* candidate);
// Cost on the training logs.
double CostAt(const Workbench& bench, const Candidate& candidate, const FitPoint& point);
// How far a fit goes.
struct FitLimits {
  int iterations = 0;
  double tolerance = 0;
  double least_known = 0;  // a cost that the effects are known to reach
};
// Fits from `start` on the training logs, until `give_up` says to. `from`: whose Jacobian, if it has one, the first
// steps are made with; null: none.
void FitCandidate(const Workbench& bench, Candidate* candidate, const FitPoint& start, const FitLimits& limits,
                  GiveUp give_up = {}, const Candidate* from = nullptr);
// With as many windows as intervals of sizes need, where the logs have them: half seconds, counted in each limb, some
// for each fitted parameter (EvidencePolicy); of a set without effects there are none to tell. What a search is made
// with is enough but for robots of many joints.
Workbench ForSizes(const Workbench& bench, const Candidate& candidate);
// Undamped steps at the end of a fit, in the windows of the bench: directions that the logs leave open go to where the
// prior pulls them.
void PolishCandidate(const Workbench& bench, Candidate* candidate);
// Fills the held-out fields, once.
void ScoreCandidate(const Workbench& bench, Candidate* candidate);
// What a candidate that was scored predicts of the held-out logs; empty: it cannot be simulated there.
std::vector<LogReplay> PredictHeldOut(const Workbench& bench, const Candidate& candidate);

// The held-out logs, each one free run, with zero offsets and the initial state fitted; of long logs parts.
FreeRuns RunFree(const Workbench& bench, const Candidate& candidate);

// Where a value lies in its range, 0 .. 1 within it: on a positive range by its logarithm, as it is searched.
double PlaceInRange(double value, double low, double high);
// Which bound a value lies on, 0.1 % of the range near.
enum class OnBound { kNo, kLow, kHigh };
OnBound BoundOf(double value, double low, double high);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_CANDIDATE_H_
