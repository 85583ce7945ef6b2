// How much of an effect shows in an arm's logs, in sensor floors: as ../gap.h, with one set of columns for many
// questions. All is linear about one plant, in windows that start at the true motion.
#ifndef GAPSCOPE_TESTS_TWIN_ARM_GAP_H_
#define GAPSCOPE_TESTS_TWIN_ARM_GAP_H_

#include <Eigen/Dense>
#include <vector>

#include "tests/twin/arm/arm.h"
#include "tests/twin/arm/recorder.h"
#include "tests/twin/gap.h"

namespace gapscope::twin {

using ArmDirection = DirectionOf<ArmPlant>;
// The free base parameters, relative moves.
std::vector<ArmDirection> ArmBaseDirections(ArmRig rig);

struct ArmGapOptions {
  double step_s = 1e-3;
  double window_s = 1.0;
  double every_s = 2.0;  // from one window's begin to the next's
  double sample_s = 0.01;
  double skipped_s = 0.05;  // at a window's begin, where a late sensor would show what went before it
};

// Records at the coarse step, with the plant at every window's begin.
std::vector<ArmRecord> CoarseArmRecords(const ArmPlant& plant, const std::vector<ArmLog>& logs,
                                        const ArmSensors& sensors, const ArmGapOptions& options);

// How two plants differ in the windows. `beside` is what the directions beside the base leave too.
struct ArmTrace {
  Gap gap;
  double beside = 0;
};

// What a retuning of `center` may change in the records' windows: along the directions, by an offset of each signal, by
// a delay, and by each window's initial state.
class ArmRetuning {
 public:
  ArmRetuning(const std::vector<ArmRecord>& records, const ArmPlant& center, const ArmSensors& sensors,
              const std::vector<ArmDirection>& beside, const ArmGapOptions& options);
  // Null: what was logged.
  struct Pair {
    const ArmPlant *with, *without;
  };
  std::vector<ArmTrace> Measure(const std::vector<Pair>& pairs) const;

 private:
  struct Window {
    const ArmRecord* record;
    std::size_t log, snapshot;
    std::vector<std::size_t> rows;
    Eigen::MatrixXd global, basis;
  };
  Eigen::VectorXd Logged(const Window& window) const;
  Eigen::VectorXd Predicted(const Window& window, const ArmPlant& plant, const ArmCommands& commands, int nudge) const;
  Eigen::VectorXd Rate(const Window& window, const Eigen::VectorXd& y) const;
  void AddColumns(const std::vector<ArmPlant>& moved, const std::vector<ArmCommands>& commands, Window* window) const;

  ArmPlant center_;
  ArmGapOptions options_;
  int joints_;
  Eigen::VectorXd floor_rad_;
  Eigen::Index beside_;
  std::vector<Window> windows_;
  std::size_t logs_;
  Leftover columns_;
};

}  // namespace gapscope::twin

#endif  // GAPSCOPE_TESTS_TWIN_ARM_GAP_H_
