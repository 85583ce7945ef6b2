// Experiments from inline MJCF and YAML, and recordings made up in memory: no log file is needed to try a model.
#ifndef GAPSCOPE_TESTS_MODEL_SYNTHETIC_H_
#define GAPSCOPE_TESTS_MODEL_SYNTHETIC_H_

#include <functional>
#include <map>
#include <string>
#include <vector>

#include "replay/replay.h"
#include "replay/simulator.h"
#include "src/experiment/experiment.h"
#include "src/model/model.h"
#include "tests/experiment/scratch.h"

namespace gapscope::testing {

// Writes robot.xml and experiment.yaml ("model: robot.xml" goes in front) and loads them. Fails the test on an error.
Experiment MakeExperiment(const Scratch& scratch, const std::string& mjcf, const std::string& yaml);

// models/RIG/experiment.yaml.
Experiment ShippedExperiment(const std::string& rig);

// Rows every `step_s`; command c of the experiment is command(c, t); every measured signal is there and zero.
Recording MakeRecording(const Experiment& experiment, int rows, double step_s,
                        const std::function<double(int command, double t_s)>& command,
                        const std::map<std::string, double>& values = {});

// Fails the test on an error; null then.
std::shared_ptr<const Model> MakeModel(const Experiment& experiment, const std::vector<EffectUse>& effects = {},
                                       const ScaleTable& scales = {});

// Predicted signals [signal][row] of a run from rest at qpos0 (or from `start`), at nominal values with `set` written
// over them.
std::vector<std::vector<double>> Predict(const Model& model, const Recording& recording,
                                         const std::map<std::string, double>& set = {},
                                         const InitialState* start = nullptr, double max_step_s = 0);
// Nominal values with `set` written over them; fails the test on an unknown name.
std::vector<double> ValuesWith(const Model& model, const std::map<std::string, double>& set);

double LargestDifference(const std::vector<double>& a, const std::vector<double>& b);
double Largest(const std::vector<double>& a);

// A chirp with steps on top, of that amplitude.
double Exciting(double t_s, double amplitude, double from_hz = 0.5, double to_hz = 4);

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_MODEL_SYNTHETIC_H_
