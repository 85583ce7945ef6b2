// A log bound to an experiment: commands and measurements in SI on one time axis.
#ifndef GAPSCOPE_EXPERIMENT_RECORDING_H_
#define GAPSCOPE_EXPERIMENT_RECORDING_H_

#include <map>
#include <memory>
#include <optional>
#include <string>
#include <vector>

#include "src/core/rotation.h"
#include "src/experiment/experiment.h"

namespace gapscope {

struct Recording {
  struct Command {
    std::string actuator;
    std::optional<std::string> column = {};  // the log's; nothing: it has none, and the command is a constant
    std::vector<double> values;              // one per stamp, held to the next stamp
    std::string clock = {};                  // Column::clock
  };
  struct Measured {
    MeasuredSpec spec;
    std::size_t index = 0;  // in experiment.measured
    std::string column;
    std::vector<double> values;          // one per stamp; NaN where the log has no value and the policy keeps that
    Quaternion reference = kNoRotation;  // of an orientation (orientation.h): the values are the turn from here
    std::string clock = {};              // Column::clock
  };

  std::string log_path;
  std::string rig;             // that the log says it is of; empty: it does not say
  std::vector<double> time_s;  // from zero, strictly increasing
  double start_s = 0;          // of a part of a log: how much later than the log it begins
  std::vector<Command> commands;
  std::vector<Measured> measured;  // only those that the log has
  std::map<std::string, double> values;
  Timeline timeline;
  std::vector<Finding> findings;  // of reading, timeline and binding
  std::size_t rows_in_log = 0;    // before repairs
  // What this one's rows were picked of (src/diagnose/coarsen.h), if forces at its stamps follow commands that it has
  // means of alone.
  std::shared_ptr<const Recording> finer;

  std::size_t rows() const { return time_s.size(); }
  double duration_s() const { return time_s.empty() ? 0 : time_s.back() - time_s.front(); }
};

// Reads one log and binds it. Errors: those of reading; a column that is neither there nor optional (with the nearest
// name); no scored signal at all; fewer than two rows.
Result<Recording> LoadRecording(const Experiment& experiment, const std::string& log_path);
// The same of a log that was read as experiment.read says.
Result<Recording> BindLog(const Experiment& experiment, const Log& log);

}  // namespace gapscope

#endif  // GAPSCOPE_EXPERIMENT_RECORDING_H_
