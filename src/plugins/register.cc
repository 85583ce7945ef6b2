// Registers every gapscope plugin when the library is loaded.
#include <mujoco/mujoco.h>

namespace gapscope::plugins {
void RegisterMotor();
void RegisterFriction();
void RegisterSpring();
void RegisterEncoder();
void RegisterExpression();
}  // namespace gapscope::plugins

mjPLUGIN_LIB_INIT(gapscope) {
  gapscope::plugins::RegisterMotor();
  gapscope::plugins::RegisterFriction();
  gapscope::plugins::RegisterSpring();
  gapscope::plugins::RegisterEncoder();
  gapscope::plugins::RegisterExpression();
}
