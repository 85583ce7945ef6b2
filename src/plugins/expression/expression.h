// gapscope.expression: torque on one hinge or slide joint by a formula of one's own, for what no other plugin holds.
//
//   torque = f(angle, speed, command, time, parameters)
//
// f is text, read once by muParser. `command` is what the drive at the joint is sent, `command_delay_s` ago. Every
// other name is a parameter and stands in `<numeric name="INSTANCE.NAME">`. Language and attributes: README.md in this
// folder.
#ifndef GAPSCOPE_PLUGINS_EXPRESSION_EXPRESSION_H_
#define GAPSCOPE_PLUGINS_EXPRESSION_EXPRESSION_H_

#include <muParser.h>
#include <mujoco/mujoco.h>

#include <array>
#include <memory>
#include <string>
#include <vector>

#include "src/plugins/common/parameters.h"
#include "src/plugins/common/parser.h"

namespace gapscope::plugins {

class Expression {
 public:
  static constexpr const char* kName = "gapscope.expression";
  enum Key { kLateCommand, kKeyCount };
  static constexpr std::array<ParameterSpec, kKeyCount> kSpecs = {{
      {kFormulaDelay, "s", 0, 0, 10, Combine::kSum, Needs::kNothing, "", true},
  }};

  // Null when `init` must fail (see refusal.h); an instance that was refused on a finished model does nothing.
  static std::unique_ptr<Expression> Create(const mjModel* m, int instance);
  static int StateSize(const mjModel* m, int instance);

  void Compute(const mjModel* m, mjData* d, int capability) const;
  // The step is over: its command is of the past.
  void Advance(const mjModel* m, mjData* d) const;

 private:
  // State, where commands may be late, before their history.
  enum Slot { kStepOpen, kStepTime, kSlots };

  // Each returns the fault, or an empty text.
  std::string Resolve(const mjModel* m, int instance);
  std::string ResolveDelay(const mjModel* m, int instance);
  std::string ResolveFormula(const mjModel* m, int instance);
  std::string ResolveNames(const mjModel* m, int instance, const std::vector<std::string>& names);
  double Command(const mjModel* m, mjData* d) const;

  mu::Parser parser_;  // bound to the numbers below, which each compute writes: one instance is one mjData's
  mutable std::array<double, kFormulaInputCount> inputs_{};
  mutable std::vector<double> parameters_;
  std::vector<int> addresses_;  // of each parameter in numeric_data
  LiveParameters<kKeyCount> live_;
  double max_delay_s_ = 0;
  int dof_ = -1, angle_address_ = -1, ctrl_address_ = -1, state_ = 0, capacity_ = 0;
};

}  // namespace gapscope::plugins

#endif  // GAPSCOPE_PLUGINS_EXPRESSION_EXPRESSION_H_
