// Intervals of parameters that two search coordinates give together.
#include "src/fit/covariance.h"

#include <gtest/gtest.h>

#include <cmath>

#include "src/fit/optimizers.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

// Size and angle as the two terms that act linearly: the same values and intervals as of size and angle themselves.
TEST(CovarianceTest, CoupledTermsHaveTheIntervalsOfTheirParameters) {
  ThreadPool pool(2);
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  for (const auto& [effect, size, other] : {std::tuple{"cable_spring@arm", "stiffness_n_m_per_rad", "rest_rad"},
                                            std::tuple{"gravity_offset@arm", "torque_n_m", "rest_rad"}}) {
    const Rig rig = LoadRig("qube", {effect});
    const int a = rig.Index(std::string(effect) + "." + size), b = rig.Index(std::string(effect) + "." + other);
    const auto truth =
        rig.Values({{std::string(effect) + "." + size, 2e-3}, {std::string(effect) + "." + other, -0.7}});
    const std::vector<Recording> logs = {MakeLog(rig, truth, command, 4, 0.004, 2e-3, 1)};
    std::vector<TunedParameter> tuned[2];
    for (const bool linear : {false, true}) {
      const FitOptions options{.free = {a, b}, .time_step_s = 0.004, .fit_offsets = false, .linear_terms = linear};
      FitProblem problem(*rig.model, logs, options, truth, pool);
      const FitPoint point = Solve(problem, problem.Start(), {.tolerance = 1e-7}).point;
      tuned[linear] = EstimateUncertainty(problem, point,
                                          Linearize(problem, point, {.columns = DifferenceOptions::Columns::kCentral}))
                          .tuned;
      ASSERT_EQ(tuned[linear].size(), 2u);
      for (const TunedParameter& t : tuned[linear])
        EXPECT_NEAR(t.value, problem.Values(point)[static_cast<std::size_t>(t.index)], 1e-12) << effect;
    }
    for (std::size_t i = 0; i < 2; ++i) {
      const double width = tuned[0][i].high - tuned[0][i].low;
      EXPECT_NEAR(tuned[1][i].value, tuned[0][i].value, 0.05 * width) << effect << i;
      EXPECT_NEAR(tuned[1][i].high - tuned[1][i].low, width, 0.05 * width) << effect << i;
      EXPECT_GT(width, 0);
    }
  }
}

}  // namespace
}  // namespace gapscope::testing
