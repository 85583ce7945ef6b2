// A tuned model for people and programs: console table, JSON (gapscope.tune/1).
#ifndef GAPSCOPE_REPORT_TUNE_REPORT_H_
#define GAPSCOPE_REPORT_TUNE_REPORT_H_

#include <nlohmann/json_fwd.hpp>
#include <string>
#include <utility>
#include <vector>

#include "src/report/console.h"
#include "src/report/json.h"
#include "src/report/run.h"
#include "src/tune/each_log.h"
#include "src/tune/tune.h"

namespace gapscope {

// All that tune's result says, by names: what ReadTuneRun gives back of a result.json. Numbers that do not exist are
// NaN.
struct TuneRun {
  struct Parameter {
    std::string name, unit;
    double nominal = 0, value = 0, low = 0, high = 0;  // low, high: 95 % interval
    bool at_bound = false, identifiable = true;
  };
  struct Flat {
    std::vector<std::pair<std::string, double>> direction;  // see FlatDirection
    std::string text;                                       // what it leaves, in words
  };
  struct Correlated {
    std::string a, b;
    double correlation = 0;
  };
  struct Log {
    std::string log;
    Outcome outcome = Outcome::kCompleted;
    std::vector<SignalScore> signals;
  };
  struct LogFit {
    std::string log, termination;
    std::vector<Parameter> parameters;  // those that all logs together know
    Spread spread;                      // of them; empty: a result of an earlier version
  };

  RunInfo info;
  std::string optimizer, termination;
  bool starts_agree = true;
  std::size_t starts = 0;
  double cost = 0;  // the least of all starts, of what the optimizer minimises
  std::size_t evaluations = 0, replays = 0;
  double wall_s = 0, solve_s = 0;  // all; the optimiser alone
  std::vector<Parameter> parameters;
  std::vector<std::string> left_frozen;  // parameters that would be tuned if the logs knew them
  std::vector<Flat> flat;
  std::vector<Correlated> correlated;
  double error_nominal = 0, error_train = 0, error_held_out = 0;
  std::string held_out_by;  // how logs were held out, for the user
  std::vector<Log> train, held_out;
  RunModel model;
  double time_step_s = 0, command_shift_s = 0, force_shift_s = 0;
  Spread spread;                // of `parameters`; empty: a result of an earlier version
  std::vector<LogFit> per_log;  // fits to each log alone; empty: none was asked for
};
TuneRun TuneRunOf(const TuneSummary& summary, const Model& model, std::uint64_t seed);
std::vector<TuneRun::LogFit> PerLogOf(const LogFits& fits, const Model& model);

inline constexpr const char* kTuneSchema = "gapscope.tune/1";
nlohmann::ordered_json ToJson(const TuneRun& run, Timing timing = Timing::kInclude);
std::string ToTable(const TuneRun& run, const Console& console = {});

// The parts that a merge of many results repeats.
nlohmann::ordered_json JsonParameters(const TuneRun& run);
nlohmann::ordered_json JsonErrors(const TuneRun& run);

// What the logs leave open about the parameters, a line each: flat directions, then pairs that go together.
std::vector<std::string> ParameterNotes(const TuneRun& run);
// "only motor.kt / motor.resistance is known": what a flat direction leaves, in words.
std::string FlatText(const FlatDirection& flat, const Model& model);

}  // namespace gapscope

#endif  // GAPSCOPE_REPORT_TUNE_REPORT_H_
