// The coordinates that a fit moves in: terms that act linearly, logarithms of sizes.
#include "src/fit/search_space.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/fit/optimizers.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

// Size and angle as the terms that act linearly: the same parameters, and no curved valley on the way to them.
TEST(LinearTermsTest, ParametersComeBack) {
  ThreadPool pool(1);
  const auto command = [](double t) { return std::sin(6 * t); };
  for (const auto& [effect, size, other] : {std::tuple{"cable_spring@arm", "stiffness_n_m_per_rad", "rest_rad"},
                                            std::tuple{"gravity_offset@arm", "torque_n_m", "rest_rad"},
                                            std::tuple{"cogging@arm", "amplitude_n_m", "phase_rad"}}) {
    const Rig rig = LoadRig("qube", {effect});
    const std::string name = effect;
    const auto values = rig.Values({{name + "." + size, 2e-3}, {name + "." + other, -0.7}});
    const std::vector<Recording> logs = {MakeLog(rig, values, command, 1, 0.004, 0, 1)};
    FitProblem problem(*rig.model, logs,
                       {.free = {rig.Index(name + "." + size), rig.Index(name + "." + other)},
                        .time_step_s = 0.004,
                        .linear_terms = true},
                       values, pool);
    const FitPoint start = problem.Start();
    const std::vector<double> back = problem.Values(start);
    for (std::size_t i = 0; i < values.size(); ++i)
      EXPECT_NEAR(back[i], values[i], 1e-12) << rig.model->parameters()[i].name;
    // The torque is linear in both: twice both is twice the size at the same angle or rest.
    FitPoint doubled = start;
    doubled.y.head(2) *= 2;
    const std::vector<double> twice = problem.Values(doubled);
    EXPECT_NEAR(twice[rig.Index(name + "." + size)], 4e-3, 1e-12) << effect;
    EXPECT_NEAR(twice[rig.Index(name + "." + other)], -0.7, 1e-12) << effect;
  }
}

TEST(LinearTermsTest, GravityIsFoundFromTheWrongSideOfItsRest) {
  const Rig rig = LoadRig("qube", {"gravity_offset@arm"});
  const int torque = rig.Index("gravity_offset@arm.torque_n_m"), rest = rig.Index("gravity_offset@arm.rest_rad");
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::vector<Recording> logs = {
      MakeLog(rig, rig.Values({{"gravity_offset@arm.torque_n_m", 3e-3}, {"gravity_offset@arm.rest_rad", 0.2}}), command,
              3, 0.004, 1e-4, 1)};
  ThreadPool pool(2);
  // From what is nearly a constant torque of the same size about zero.
  FitProblem problem(*rig.model, logs,
                     {.free = {torque, rest},
                      .time_step_s = 0.004,
                      .fit_offsets = false,
                      .linear_terms = true},  // an offset is a rest angle
                     rig.Values({{"gravity_offset@arm.torque_n_m", 1e-3}, {"gravity_offset@arm.rest_rad", 1.57}}),
                     pool);
  const SolveResult solved = Solve(problem, problem.Start(), {.max_iterations = 6, .tolerance = 1e-4});
  EXPECT_NEAR(problem.Values(solved.point)[torque], 3e-3, 3e-5);
  EXPECT_NEAR(problem.Values(solved.point)[rest], 0.2, 0.01);
}

// The cubic starts on its bound, where it does nothing; without a linear part the rest is the cubic's alone.
TEST(LinearTermsTest, ACubicCableIsFoundFromALinearOne) {
  const Rig rig = LoadCubicCable();
  const std::string name = "cable_spring@arm.";
  const int size = rig.Index(name + "stiffness_n_m_per_rad"), rest = rig.Index(name + "rest_rad"),
            cubic = rig.Index(name + "stiffness_cubic_n_m_per_rad3");
  const auto command = [](double t) { return 2.5 * std::sin(6 * t + 2 * t * t); };
  ThreadPool pool(2);
  for (const auto& [k, c] : {std::pair{2e-3, 0.0}, {2e-3, 4e-3}, {0.0, 8e-3}}) {
    const auto truth = rig.Values(
        {{name + "stiffness_n_m_per_rad", k}, {name + "rest_rad", -0.3}, {name + "stiffness_cubic_n_m_per_rad3", c}});
    const std::vector<Recording> logs = {MakeLog(rig, truth, command, 6, 0.004, 1e-4, 1)};
    for (const bool linear : {false, true}) {
      SCOPED_TRACE(std::to_string(k) + " " + std::to_string(c) + (linear ? " linear" : ""));
      const FitOptions options{
          .free = {size, rest, cubic}, .time_step_s = 0.004, .fit_offsets = false, .linear_terms = linear};
      FitProblem there(*rig.model, logs, options, truth, pool);
      EXPECT_NEAR(there.Values(there.Start())[rest], -0.3, 1e-12);
      FitProblem problem(*rig.model, logs, options, rig.Values({{name + "stiffness_n_m_per_rad", 1e-3}}), pool);
      const SolveResult solved = Solve(problem, problem.Start(), {.max_iterations = 30, .tolerance = 1e-6});
      const std::vector<double> found = problem.Values(solved.point);
      EXPECT_NEAR(found[size], k, 1e-5);
      EXPECT_NEAR(found[rest], -0.3, 5e-4);
      EXPECT_NEAR(found[cubic], c, 1e-5);
    }
  }
}

TEST(SearchSpaceTest, ACubicIsNoLogarithmWhereSizesAre) {
  const Rig rig = LoadCubicCable();
  const std::string name = "cable_spring@arm.";
  const int size = rig.Index(name + "stiffness_n_m_per_rad"), cubic = rig.Index(name + "stiffness_cubic_n_m_per_rad3");
  const auto values =
      rig.Values({{name + "stiffness_n_m_per_rad", 2e-3}, {name + "stiffness_cubic_n_m_per_rad3", 1e-6}});
  const SearchSpace space(rig.model->parameters(), {size, cubic}, values, true, false);
  EXPECT_TRUE(space.coordinates()[0].logarithmic);
  EXPECT_FALSE(space.coordinates()[1].logarithmic);
  EXPECT_EQ(space.low()[1], 0);
}

}  // namespace
}  // namespace gapscope::testing
