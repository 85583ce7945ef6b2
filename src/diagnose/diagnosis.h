// Which unmodelled effect causes the gap between prediction and measurement, and how far the gap shrinks with it.
// Method: docs/explanation/method.md.
#ifndef GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_
#define GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_

#include <atomic>
#include <map>
#include <memory>
#include <optional>
#include <set>
#include <span>
#include <string>
#include <vector>

#include "src/compare/conditions.h"
#include "src/core/enum_names.h"
#include "src/diagnose/free_runs.h"
#include "src/model/run_model.h"
#include "src/tune/tune.h"

namespace gapscope {

enum class Verdict { kNone, kParameters, kEffects, kAmbiguous, kUnknown };
std::string VerdictName(Verdict verdict);

struct EffectEstimate {
  std::string key, unit;
  double value = 0, low = 0, high = 0;
  // The size over a base parameter, where that is known much better than the size alone; empty: it is not.
  struct Ratio {
    std::string to;
    double value = 0, low = 0, high = 0;
  } ratio = {};
};

// An effect of the verdict.
struct FoundEffect {
  EffectUse use;
  std::string meaning, signature;  // of the catalogue, for where it acts
  double probability = 0;
  std::vector<EffectEstimate> parameters;
  double error_before = 0, error_after = 0;  // held out, normalised
  double share_of_gap = 0;                   // averaged over the order of adding; of `together` as one
  std::vector<EffectUse> together;           // the others of its group that are in the final model
};

// " together with cogging@arm"; empty: it stands alone.
std::string TogetherWith(const FoundEffect& found);

// What may explain the logs alone: an effect, or nothing but the base model.
using Explanation = std::optional<EffectUse>;
std::string NameOf(const Explanation& explanation);        // "cable_spring@arm", "none"
std::string NameOfSet(const std::vector<EffectUse>& set);  // "cable_spring@arm + cogging@arm", "none"

// An explanation that was tried.
struct CandidateReport {
  Explanation effect;
  double probability = 0;     // over single explanations; adds up to one
  double held_out_error = 0;  // normalised; NaN: not refitted
  double promise = 0;         // share of the refitted base model's cost that it takes away, by arithmetic
  bool refitted = false, converged = false;
  double bic = 0;      // lower is better
  std::string reason;  // why it was, or was not, accepted
};

enum class Answer { kPresent, kAbsent, kUnseen };
std::string AnswerName(Answer answer);

// The numbers that a statement rests on. Gains are ln(cost without / cost with).
struct StatementNumbers {
  double gain = 0;           // training logs, the set refitted without the effect
  double gain_held_out = 0;  // the same two fits on logs that they did not see
  double gain_free = 0;      // likewise, each log one free run; NaN: it tells nothing
  double discrepancy = 0;    // gain in log marginal likelihood beside random torques
  double clear = 0;          // held-out gain over its standard error, by half seconds
  bool smooth = false;       // a function of a joint's own motion: what roughness looks like
  bool dry = false;          // dry friction: of these the one with a jump
};

// Part of a held-out log, and its part of what an effect gains there: negative where the motion is told worse with it.
struct BlockGain {
  std::string log;
  double from_s = 0, to_s = 0;
  double share = 0;  // of the squared error that the effect takes from all held-out logs
};

// Two sets that differ by an effect or a group, both refitted: what a statement's numbers were taken from.
struct ComparedSets {
  RunModel with, without;
  std::vector<BlockGain> blocks;  // the largest first; empty: the effect takes nothing away
};

// Something that was tried in an effect's place.
struct Rival {
  EffectUse use;
  double behind = 0;  // ln(cost with it / cost of the set)
};

// Share of the gap that closes, with the interval that 95 of 100 draws of the held-out logs' half seconds are in.
struct ShareOfGap {
  double value = 0, low = 0, high = 0;
};

// The rule of an effect that no replay ran through with.
inline constexpr char kNotSimulated[] = "the model with it cannot be simulated at this time step";
// The rule of an effect that by its columns is worth a fit, and got none.
inline constexpr char kNotTried[] = "the budget ended before it was tried";
// The rule of an effect on a joint that is out of sight (JointsOutOfSight).
inline constexpr char kOutOfSight[] = "nothing that is measured follows the joint or what it carries; log its angle";

// What is said of one effect.
struct Statement {
  EffectUse use;
  Answer answer = Answer::kAbsent;
  double probability = 0;  // that it is there: prior odds times evidence
  double prior = 0.5;      // before the logs were seen: even odds, or as the user says
  double evidence = 0;     // what the probability is at even odds
  std::vector<EffectEstimate> parameters;
  std::vector<EffectEstimate> bounds;  // absent: the value is the size below (of a limit: above) which it stays
  ShareOfGap share_of_gap;
  int group = -1;                        // statements of one group are told together
  std::optional<EffectUse> beside = {};  // the other one of two that are there both or neither
  StatementNumbers numbers;
  std::shared_ptr<const ComparedSets> sets = {};  // null: it was not refitted
  std::vector<Rival> rivals = {};                 // the nearest first
  std::string rule;
  std::string caveat = {};  // what the logs' clocks leave open of it; empty: nothing
};
// Whether it is unseen in these logs for want of an input that shows it.
inline bool IsForAnInput(const Statement& s) {
  return s.answer == Answer::kUnseen && s.rule != kNotSimulated && s.rule != kNotTried && s.rule != kOutOfSight;
}

// Shares of the refitted base model's squared misfit, held out. NaN: these logs do not say.
struct Remainder {
  double explained = 0, systematic = 0, sensors = 0;
  double not_repeatable = 0;  // between logs of the same commands, above the sensors' noise
  double reachable = 0;       // what the named effects and a free-form torque of angle, speed and command would explain
};

// A base parameter of the final model that ended on a bound of the experiment file other than its nominal value, or
// beyond it.
struct AtBound {
  std::string name, unit;
  double value = 0;
};

// What these logs leave open, and the input that would settle it.
struct NextExperiment {
  enum class Why { kNothing, kTogether, kUnsure, kOneLog, kUnseen };
  Why why = Why::kNothing;
  std::vector<Explanation> separates;    // told apart; the first one is what the probabilities are of
  std::vector<RunModel> models;          // of each, fitted to the logs
  double probability = 0;                // by these logs
  double if_present = 0, if_absent = 0;  // foretold: after the experiment, if it holds and if it does not
  std::string input_csv;                 // in the experiment's own columns; empty: there is none
  std::string command;                   // makes it again
  std::string problem;                   // why there is none
};
std::string WhyName(NextExperiment::Why why);

// What a signal misses, over its sensor's noise, root mean square.
struct SignalFloors {
  std::string signal;
  double floors = 0;
};

// What the verdict rests on as a whole.
struct VerdictEvidence {
  // Residual over the sensors' noise, root mean square, held out: refitted base model, final model.
  double floors_before = 0, floors_left = 0;
  std::vector<SignalFloors> signals;  // of the final model, the largest first
  double removed = 0;                 // share of what exceeds the noise that went away, in windows
  // Normalised errors of one free run a log, and the share that went away; infinity, 0: it diverges.
  double free_run_before = 0, free_run_left = 0, free_run_removed = 0;
  std::vector<FreeRun> free_runs = {};  // the final model's
};

// Of the errors of two free runs: both are further off than the signals' mean. Unstable plants end so, and runs that
// swing over at another time: nothing can be seen there.
inline bool AreLost(double before, double after) { return before > 1 && after > 1; }

// Pieces that logs are fitted in; of long logs those that say most.
struct FittedWindows {
  std::size_t fitted = 0, all = 0;  // of the training logs
  std::size_t of_sizes = 0;         // that the final set's sizes are fitted to
  double length_s = 0;
};

// Of one log, or of one part of it, by parameters fitted without it: the refitted base model's error, the final one's,
// and what the sensors' noise is of it.
struct LogGap {
  std::string log;
  double refit = 0, final = 0, floor = 0;
  double from_s = 0, until_s = 0;  // since the log's first row
};
// (refit - final) / (refit - floor), 0 .. 1; 0 where nothing is above the floor.
double ClosedShare(double refit, double final, double floor);
// What closes on one log and another: what to expect of a further one.
struct ClosedByLog {
  double median = 0, least = 0, most = 0;  // shares
  std::size_t logs = 0;
};
// Of those that the base model can be simulated on; where the final one cannot, nothing closes. None: fewer than two.
std::optional<ClosedByLog> ClosedOf(std::span<const LogGap> gaps);

struct Diagnosis {
  Verdict verdict = Verdict::kNone;
  double probability = 0;
  std::vector<FoundEffect> effects;
  std::vector<Statement> statements;  // of every effect that was looked at, the surest first
  Remainder remainder;
  std::vector<AtBound> at_bounds;
  std::vector<std::vector<EffectUse>> ambiguous;  // groups that these logs cannot tell apart
  // Held-out errors, normalised: see ReplayError; in windows.
  double nominal = 0, refit = 0, final = 0, floor = 0, closed = 0;
  std::vector<LogGap> by_log;
  VerdictEvidence evidence;
  std::vector<ConditionShare> where;    // the refitted base model's error, by condition
  std::vector<ConditionShare> remains;  // the final model's
  std::vector<CandidateReport> candidates;
  NextExperiment next;
  std::vector<std::string> train_logs, held_out_logs;
  std::string split, explanation;
  bool by_windows = false;  // of each log every third window is held out, no log as a whole
  double data_s = 0;        // of all logs
  double time_step_s = 0;
  FittedWindows windows;
  double wall_s = 0;
  Work work;                           // spent
  std::size_t most_steps = 0;          // the budget, simulator steps
  std::vector<std::string> cut;        // what the budget or an interruption left out
  bool interrupted = false;            // DiagnoseOptions::stop was set before the end
  bool uneven = false;                 // train and held-out logs show the gap very differently
  std::shared_ptr<const Model> model;  // with the effects found
  std::vector<double> values;
  std::vector<double> nominal_values;        // of refit_model: where its fit started
  std::shared_ptr<const Model> refit_model;  // the base model, refitted
  std::vector<double> refit_values;
};

// How much work the search may take: SearchPolicy::replays times 0.3, 1, 4.
enum class SearchEffort { kQuick, kNormal, kThorough };
template <>
std::span<const EnumName<SearchEffort>> EnumNames<SearchEffort>();

// What a diagnosis does, and of the search's work how much is done: simulated steps; 0: no limit.
struct DiagnoseProgress {
  std::string stage;
  std::size_t steps = 0, most_steps = 0;
};

struct DiagnoseOptions {
  double budget_s = 0;  // 0: no limit of time
  SearchEffort effort = SearchEffort::kNormal;
  double window_s = 1.0;
  double sample_s = 0.004;  // logs are searched on stamps at least this far apart
  unsigned long seed = 0;
  std::size_t replay_steps = 20000;  // of the training windows: of longer logs those that say most are taken
  // What is known of effects beforehand: probabilities by "EFFECT" or "EFFECT@PLACE", which goes first. Others: 0.5.
  std::map<std::string, double> priors;
  // What the base model has beside the experiment's own: effects, and values to start from by the parameters' names.
  std::vector<EffectUse> known;
  std::map<std::string, double> values;
  std::set<std::string> frozen;  // names of parameters that are held at their value
  std::function<void(const DiagnoseProgress&)> progress;
  const std::atomic<bool>* stop = nullptr;  // set: the best verdict so far
  // Folder of a DiagnosisJournal, empty: none; whether the run recorded there goes on. It stays when the run has ended:
  // what it led to is to be written first (DiagnosisJournal::Remove).
  std::string journal;
  bool resume = false;
  bool next_experiment = true;  // design one
  std::function<void(const std::string&)> warn;
};

Result<Diagnosis> Diagnose(const Experiment& experiment, const DataSplit& data, const DiagnoseOptions& options,
                           ThreadPool& pool);

}  // namespace gapscope

#endif  // GAPSCOPE_DIAGNOSE_DIAGNOSIS_H_
