// One recording simulated by one worker: commands held from stamp to stamp, the state read at each stamp exactly. No
// allocation after construction.
#ifndef GAPSCOPE_REPLAY_SIMULATOR_H_
#define GAPSCOPE_REPLAY_SIMULATOR_H_

#include <functional>
#include <span>
#include <vector>

#include "replay/initial_state.h"
#include "replay/servo_damping.h"
#include "src/core/mujoco_handles.h"
#include "src/experiment/recording.h"
#include "src/model/model.h"
#include "src/model/parameter_writer.h"

namespace gapscope {

// Rows [begin, end) of a recording.
struct Window {
  std::size_t begin = 0, end = 0;
  std::size_t rows() const { return end - begin; }
};

enum class Outcome { kCompleted, kDiverged };

struct RunResult {
  Outcome outcome = Outcome::kCompleted;
  double diverged_at_s = 0;  // the recording's time at the last good stamp
  std::size_t steps = 0;     // each of four evaluations, as Runge-Kutta's: four of another integrator's are one
};

// How a window's motion is made.
enum class StepKind {
  kOwn,    // exact to second order at least. Where the integrator is of first order, it makes whole and half steps, and
           // twice the motion by halves less that by whole ones is without that order's error (Richardson). Euler's is
           // the implicit one then, which nears the same motion, and bears a stiff servo's damping.
  kQuick,  // a third of that work, for differences of motions that are both made so (Model::HasQuickSteps):
           // semi-implicit Euler in place of Runge-Kutta, whole steps alone
  kPlain,  // as the integrator makes it: what an engine does with the model
};

// A smooth torque that no catalogue holds: amplitude sin(per_rad q + per_speed w + per_command u + phase) on one joint,
// held over each step. What a model may miss is judged beside such torques.
struct ProbeTorque {
  int joint = -1;  // hinge or slide
  double amplitude_n_m = 0, per_rad = 0, s_per_rad = 0, phase_rad = 0;
  int actuator = -1;  // whose command u is; -1: none
  double per_command = 0;
  bool operator==(const ProbeTorque&) const = default;
};

// How far a log's stamps lie from what happened, common to all logs of a rig.
struct StampShift {
  double commands_s = 0;  // commands act this much later, beside the model's own delay; of either sign
  double forces_s = 0;    // forces and accelerations were read this much later
};

class Simulator {
 public:
  // `model` must outlive the simulator. Steps are at most `max_step_s` long (0: the model's own time step).
  Simulator(const Model& model, double max_step_s);

  // Writes parameters (see ParameterWriter::Write); false: they make no model.
  bool SetParameters(std::span<const double> values, const Recording& recording);

  // Simulates the window from `start`. `predicted` receives rows() x recording.measured.size() numbers, row by row: at
  // each stamp the value before that stamp's command acts; NaN after a divergence. A signal's filter, delay and offset
  // are applied. `qpos`, when it is not empty, receives the pose at each stamp: rows() x model nq numbers; NaN after a
  // divergence.
  RunResult Run(const Recording& recording, Window window, const InitialState& start, std::span<double> predicted,
                std::span<double> qpos = {});

  // Drags the model along the window: at each row the measured joints stand and move as the log says, under the mean
  // command of the sample around it, and delays, lags and a supply remember what went before. `see` leaves positions
  // and speeds of data() as they are. Where the drag cannot begin (see PreRoll) it is not called.
  void Drag(const Recording& recording, Window window, const std::function<void(std::size_t row)>& see);

  // Takes effect with the next SetParameters.
  void set_stamps(StampShift stamps) { stamps_ = stamps; }
  void set_probes(std::span<const ProbeTorque> probes) { probes_.assign(probes.begin(), probes.end()); }
  void set_steps(StepKind steps);
  const mjModel& mujoco_model() const { return *mujoco_; }
  mjData& data() { return *data_; }

 private:
  // What acts beside the model's own forces; a step under it.
  void Apply(std::span<const ProbeTorque> probes);
  void Step(std::span<const ProbeTorque> probes);
  double Probed(const ProbeTorque& probe) const;
  // What went before the window, in all that remembers. False: as PreRoll.
  bool Recall(const Recording& recording, Window window);
  // Even steps of at most max_step_s, before they are divided.
  int StepsOver(double interval_s) const;
  bool RunsAway() const;
  bool IsSane() const;
  // Each step in so many.
  void DivideSteps(int parts);
  // As Run, without what sensors make of it, and as the steps are divided.
  RunResult RunOnce(const Recording& recording, Window window, const InitialState& start, std::span<double> predicted,
                    std::span<double> qpos);
  // Everything as a window's run finds it: pre-rolled, at `start`, at its first stamp. False: as PreRoll.
  bool Begin(const Recording& recording, Window window, const InitialState& start);
  // From a row's stamp to the next one's, under its commands. Returns the steps that it took.
  int StepToNext(const Recording& recording, std::size_t row);
  // False: a transmission's motor side does not follow, but runs away.
  bool PreRoll(const Recording& recording, Window window);
  // On from a row, where the model stands, in so many steps under the mean commands up to the next row.
  void DragOn(const Recording& recording, std::size_t row, int steps);
  // How far back the states of a run remember.
  double Past() const;
  // Measured joints as the log has them at a row.
  void Follow(const Recording& recording, std::size_t row);
  // The same, each transmission's motor side with its load.
  void StandAt(const Recording& recording, std::size_t row);
  void FindEarlierCommands(const Recording& recording);
  // Whether the log begins to move at its first stamp as the model does, where it stands.
  bool MovesAtOnce(const Recording& recording) const;
  void SetCommands(const Recording& recording, std::size_t row, double from_s, double to_s);
  // Each command's mean over a time near the row.
  void SetMeanCommands(const Recording& recording, std::size_t row, double from_s, double to_s);
  // Mean of what acts of a command over a time. `row` is a hint that moves with it.
  double MeanCommand(const Recording& recording, std::size_t command, double from_s, double to_s,
                     std::size_t& row) const;
  double Read(const SignalSource& source) const;
  // What signals beside the state are at a stamp: forces jump where commands do, and no stamp says on which side of a
  // jump they were read. They are those of the mean command over the sample that ends there.
  void ComputeSignals(const Recording& recording, std::size_t row);
  // The sensor's orientation at a row, as turn from the log's reference, nearest to the one before.
  void ReadTurn(const Recording& recording, std::size_t row, std::size_t signal, double* out, const double* before);
  // Turns become what compares with the measured ones (src/experiment/orientation.h), the mount's parameters in them.
  void CompareTurns(const Recording& recording, Window window, std::size_t signal, std::span<double> predicted);
  // What the sensors make of the states: filter, delay, offset.
  void ApplySensors(const Recording& recording, Window window, std::span<double> predicted);

  const Model& model_;
  ModelPtr mujoco_;
  DataPtr data_;
  ParameterWriter writer_;
  double max_step_s_;
  int parts_ = 1;        // of each step
  bool halves_ = false;  // whole and half steps
  ServoDamping damping_;
  bool plain_ = false;  // steps of StepKind::kPlain
  StampShift stamps_;
  std::vector<double> delays_s_;  // per command: how late it acts
  bool late_ = false;             // one of them does not act at its stamp
  double latest_s_ = 0;
  double native_delay_s_ = 0;  // the MJCF's own, of any actuator
  std::vector<int> passive_;   // actuators on joints that no control drives: what they give is no drive's torque
  std::vector<ProbeTorque> probes_;
  SignalStage reads_ = SignalStage::kState;  // the latest stage of any signal of the log
  std::vector<std::size_t> orientations_;    // the log's orientations: the first signal of each
  bool remembers_ = false;                   // has states beside position and speed
  std::vector<std::pair<double, double>>
      apart_;  // per mirrored joint: angle and speed beside its load at the start of a run
  std::vector<double> values_;
  std::vector<double> column_, shaped_;  // scratch of ApplySensors
  std::vector<double> by_whole_;         // scratch of Run
  std::vector<bool> moves_;              // per command: drives, and does not supply or enable
  std::vector<double> earlier_;          // per command: before the log began
  bool from_nothing_ = false;            // nothing was commanded then, and something is at the first stamp
  std::vector<std::size_t> held_;        // per command: row held at the start of the step
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_SIMULATOR_H_
