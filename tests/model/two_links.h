// The experiment of a double pendulum on two drives, whose links the tests make.
#ifndef GAPSCOPE_TESTS_MODEL_TWO_LINKS_H_
#define GAPSCOPE_TESTS_MODEL_TWO_LINKS_H_

namespace gapscope::testing {

inline constexpr const char* kTwoLinks = R"(commands:
  - {actuator: first, column: u, unit: N m}
  - {actuator: second, column: v, unit: N m}
measured:
  - {signal: q, column: q, joint: shoulder, unit: rad}
  - {signal: p, column: p, joint: elbow, unit: rad}
)";

}  // namespace gapscope::testing

#endif  // GAPSCOPE_TESTS_MODEL_TWO_LINKS_H_
