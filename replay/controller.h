// The rig's own controller, as the experiment file's `controller:` section describes it: closes the loop in a replay,
// or recomputes what the rig sent from what it measured.
#ifndef GAPSCOPE_REPLAY_CONTROLLER_H_
#define GAPSCOPE_REPLAY_CONTROLLER_H_

#include <map>
#include <optional>
#include <span>
#include <string>
#include <vector>

#include "replay/observer.h"
#include "src/experiment/recording.h"

namespace gapscope {

struct ControllerInput {
  std::string name, signal;
  double scale = 1, offset = 0;  // input = scale * signal (SI, as its sensor counts) + offset
};
// command += proportional e + integral of e dt + derivative D(e), e = reference - input; D: y[k] = (N (e[k] - e[k-1]) +
// y[k-1]) / (1 + N T), the backward-difference form of N s / (s + N). State feedback u = -K x with filtered speeds is a
// term per angle.
struct ControllerTerm {
  std::string input;
  double proportional = 0, integral = 0, derivative = 0, filter_rad_per_s = 100;
  double integral_limit = 0;  // largest magnitude of the integral's part; 0: none
  std::string to;             // an outer loop: its output is added to this input's reference; empty: to the command
};
// Until |angle| (an input, zero upright) is below `catch_rad` the command is gain (-E) sign(da cos a), E = inertia da^2
// / 2 + torque (cos a - 1): zero at rest upright. Then the terms act, until |angle| passes `drop_rad`. Astrom and
// Furuta, "Swinging up a pendulum by energy control", Automatica 36, 2000. The law asks for a torque: on a voltage
// drive `arm_speed` times the speed of the input `arm` makes up for the back-EMF. `terms` of its own are added, to keep
// the arm about its middle, or do it alone: swing-up by state feedback, as an arm's loop whose reference moves with the
// pendulum.
struct SwingUp {
  std::string input, arm;  // arm: empty where `arm_speed` is zero
  double catch_rad = 0, drop_rad = 0, gain = 0, inertia_kg_m2 = 0, torque_n_m = 0, filter_rad_per_s = 100, limit = 0,
         arm_speed = 0;
  std::vector<ControllerTerm> terms;
};
struct ControllerSpec {
  std::string actuator;
  double sample_s = 0;  // 0: at every row of the log
  double limit = 0;     // of what is sent; 0: none
  std::vector<ControllerInput> inputs;
  std::map<std::string, std::string> references;  // input -> column of the log, or a number; none: zero
  std::string feedforward;                        // column added to the law's output, or a number; empty: none
  std::vector<ControllerTerm> terms;
  std::optional<SwingUp> swing_up;
  std::optional<ObserverSpec> observer;  // its state feedback is added to the terms
};

// The section of the experiment's file. Errors: no such section; unknown keys, inputs, signals (file:line:column).
Result<ControllerSpec> LoadController(const Experiment& experiment);

class Controller {
 public:
  // `recording` must outlive it; columns that the law takes from the log are read again. Errors: a signal that this log
  // lacks; a reference that is neither a column of it nor a number.
  static Result<Controller> Make(const ControllerSpec& spec, const Experiment& experiment, const Recording& recording);

  // Back to the start of a run: filters at zero, or settled at the first errors (a log that begins in the middle of a
  // run).
  enum class Start { kZero, kSettled };
  void Reset(Start start);

  // The command sent at `row`, SI: law, feedforward, saturation. `readings[i]`: recording.measured[i] as the sensor
  // gives it. Between samples of its own the last command stays.
  double Step(std::size_t row, std::span<const double> readings);
  double law() const { return law_; }               // of the last step, before feedforward and saturation
  std::size_t command() const { return command_; }  // index in recording.commands
  bool caught() const { return caught_; }

 private:
  struct Source {
    std::vector<double> column;  // per row; empty: the constant
    double constant = 0;
    double At(std::size_t row) const { return column.empty() ? constant : column[row]; }
  };
  struct Input {
    std::size_t signal = 0;
    double scale = 1, offset = 0;
    Source reference;
  };
  struct Term {
    ControllerTerm spec;
    std::size_t input = 0;
    int to = -1;
    double last_error = 0, derivative = 0, integral = 0;
  };
  class Binder;  // texts of a spec to sources

  Controller() = default;
  double Evaluate(Term& term, double error, double period_s) const;
  // Outer loops first: what they ask for moves the inner references.
  double Sum(std::vector<Term>& terms, double period_s);
  double Swing(const SwingUp& swing, double angle, double period_s);

  ControllerSpec spec_;
  const Recording* recording_ = nullptr;
  std::vector<Input> inputs_;
  std::vector<Term> terms_, swing_terms_;
  Source feedforward_;
  std::size_t command_ = 0, swing_input_ = 0, arm_input_ = 0;
  std::optional<Observer> observer_;
  std::vector<double> errors_, asked_, inputs_now_, references_now_;
  double law_ = 0, sent_ = 0, next_s_ = 0, last_s_ = 0, swing_angle_ = 0, swing_speed_ = 0, arm_angle_ = 0,
         arm_speed_ = 0;
  bool first_ = true, caught_ = false;
  Start start_ = Start::kZero;
};

}  // namespace gapscope

#endif  // GAPSCOPE_REPLAY_CONTROLLER_H_
