// An input tried on the model before it goes to the rig: largest angles, speeds, torques and commands against the
// experiment's limits, and the largest amplitude that keeps them.
#ifndef GAPSCOPE_DESIGN_REHEARSAL_H_
#define GAPSCOPE_DESIGN_REHEARSAL_H_

#include <map>
#include <memory>
#include <string>
#include <vector>

#include "replay/replay.h"

namespace gapscope {

// Adds what the limits are about to `measured`, unscored, so that a simulation of the model reads it. The number of
// measured signals before is kept. Errors: a limit on a joint or actuator that no command or signal of the experiment
// names is found by Model::Build, with the nearest name.
Experiment WithLimitSignals(Experiment experiment);

struct RehearsalOptions {
  std::string actuator;                      // which command is driven; empty: the first
  std::map<std::string, double> hold;        // other commands, SI; else the experiment's default, else zero
  std::map<std::string, double> log_values;  // numbers that a log would bring; else the experiment's default
  double rate_hz = 500;
  double offset = 0;  // of the driven command, SI: a constant beside the input, against what drives the rig off
};

// A constant part of a command that a load takes which a model lacks: the model is driven by the rest.
struct LackedLoad {
  std::size_t command = 0;
  double value = 0;
};

// One limited quantity over a simulated input.
struct Extreme {
  std::string name, unit;  // "arm speed", "rad/s"
  double reached = 0, limit = 0;
};

struct Rehearsal {
  Recording recording;            // commands, and the predictions in the place of measurements
  std::vector<Extreme> extremes;  // in the order of the limits; command first
  double worst = 0;               // largest reached / limit; infinity after a divergence
};

// A recording without measurements (NaN) that drives `options.actuator` by `values` and the offset, SI,
// `options.rate_hz` a second.
// Errors: no such actuator, a log value without a number.
Result<Recording> MakeInput(const Experiment& experiment, const RehearsalOptions& options,
                            const std::vector<double>& values);
// The column of a recording's commands that MakeInput drives.
Result<std::size_t> DrivenCommand(const Experiment& experiment, const RehearsalOptions& options);

// Simulates from rest at the model's initial pose. `model` was built from an experiment of WithLimitSignals.
Rehearsal Rehearse(const Model& model, Simulator& simulator, Recording input, const std::vector<double>& values,
                   const LackedLoad& lacks = {});

// The largest amplitude of `unit_wave`, at most `highest`, at which no limit is passed by more than `margin` times
// itself (0.9: a tenth is kept free) for any of the models. Errors: the limits are passed at every amplitude.
struct ModelAndValues {
  const Model* model = nullptr;
  Simulator* simulator = nullptr;
  std::vector<double> values;
  LackedLoad lacks = {};
};
Result<double> LargestAmplitude(const std::vector<ModelAndValues>& models, const RehearsalOptions& options,
                                const std::vector<double>& unit_wave, double highest, double margin);

// The constant command that keeps the models where they begin for so long, against what drives them off: a bias, a
// cable, gravity. Found on the first one. 0: they stay by themselves, or it would not keep all of them.
Result<double> HoldingCommand(const std::vector<ModelAndValues>& models, const RehearsalOptions& options,
                              double duration_s);

// The command limit of the driven actuator; 0: none is stated.
double CommandLimit(const Experiment& experiment, const std::string& actuator);

// The input as a CSV in the experiment's own columns: time, commands (in the units of the log), then predicted.SIGNAL
// and limit.SIGNAL in SI.
std::string InputCsv(const Experiment& experiment, const Rehearsal& rehearsal);

}  // namespace gapscope

#endif  // GAPSCOPE_DESIGN_REHEARSAL_H_
