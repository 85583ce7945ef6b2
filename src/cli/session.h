// What the commands share: common flags, and an experiment with its logs and model, loaded.
#ifndef GAPSCOPE_CLI_SESSION_H_
#define GAPSCOPE_CLI_SESSION_H_

#include <cstdint>
#include <memory>
#include <string>
#include <vector>

#include "replay/replay.h"
#include "src/core/options.h"
#include "src/core/thread_pool.h"
#include "src/experiment/recording.h"
#include "src/model/model.h"

namespace gapscope::cli {

// Exit statuses of the program: what scripts rely on.
inline constexpr int kDone = 0, kBelowThreshold = 1, kBadInput = 2, kBug = 3;

enum class ProgressForm { kText, kJson };

struct CommonFlags {
  ProgressForm progress = ProgressForm::kText;
  bool json = false, quiet = false, verbose = false, profile = false;
  int jobs = 0;
  std::uint64_t seed = 0;
  std::string out;
};

// As --jobs says; without it one a processor.
int WorkersOf(const CommonFlags& flags);

// --json, --quiet and --progress.
std::vector<Option> PrintOptions(CommonFlags& flags);
// Those, --jobs and --seed.
std::vector<Option> CommonOptions(CommonFlags& flags);
// --out for a command that writes a folder; `holds`: what is in it.
Option FolderOption(CommonFlags& flags, const std::string& holds);

struct ModelFlags {
  std::string experiment;
  std::vector<std::string> logs;
  std::string from;                 // an earlier result, whose effects and values --with and --params go over
  std::vector<std::string> with;    // EFFECT[@ON]
  std::vector<std::string> set;     // NAME=VALUE
  std::vector<std::string> params;  // files of values, results
  std::string while_column;         // over the experiment's own
};
// EXPERIMENT alone; EXPERIMENT LOG... and --while; --with, --set and --params.
Option ExperimentOption(std::string& path);
std::vector<Option> LogOptions(ModelFlags& flags);
std::vector<Option> EffectOptions(ModelFlags& flags);
Option WhileOption(std::string& column);
Option FromOption(std::string& from);
// --set and --params alone, for commands on a model without logs.
std::vector<Option> ValueOptions(std::vector<std::string>& set, std::vector<std::string>& params);
// --window over the experiment's own; 0: not given.
Option WindowOption(double& window_s);
// --time-step; 0: chosen by the program.
Option TimeStepOption(double& time_step_s);

struct Session {
  Experiment experiment;
  std::vector<Recording> recordings;
  ScaleTable scales;
  std::shared_ptr<const Model> model;
  std::vector<double> values;  // nominal with --params and --set written over it
  std::unique_ptr<ThreadPool> pool;
};

// "NAME=VALUE" with a finite value. Error: it is not; `flag` is where.
Result<std::pair<std::string, double>> ParseAssignment(const std::string& text, const std::string& flag);
// Writes --params files and --set assignments over `values` (as model.Nominal()).
Status OverrideValues(const Model& model, const std::vector<std::string>& params, const std::vector<std::string>& set,
                      std::vector<double>* values);

Result<Session> LoadSession(const ModelFlags& flags, const CommonFlags& common);

// Reads all logs, in parallel; the first error in the order of the arguments. Error: they name different rigs.
Result<std::vector<Recording>> LoadRecordings(const Experiment& experiment, const std::vector<std::string>& paths,
                                              ThreadPool& pool);

// The logs of a command with --hold-out: all of them once, as the user spells them, and which files are held out.
// Error: nothing is left to fit.
struct HeldOutLogs {
  std::vector<std::string> all;
  std::vector<std::size_t> held_out;
};
Result<HeldOutLogs> CombineHeldOut(const std::vector<std::string>& logs, const std::vector<std::string>& hold_out);

// Candidates that are left out, on stderr.
void PrintLeftOut(const Rig& rig);

// Every finding of the logs on stderr, one line each, unless quiet.
void PrintFindings(const std::vector<Recording>& recordings, bool quiet);

}  // namespace gapscope::cli

namespace gapscope {

template <>
std::span<const EnumName<cli::ProgressForm>> EnumNames<cli::ProgressForm>();

}  // namespace gapscope

#endif  // GAPSCOPE_CLI_SESSION_H_
