// Intervals of parameters that two search coordinates give together.
#include "src/fit/covariance.h"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "src/fit/optimizers.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

// Size and angle as the two terms that act linearly: the same values and intervals as of size and angle themselves.
TEST(CovarianceTest, CoupledTermsHaveTheIntervalsOfTheirParameters) {
  ThreadPool pool(2);
  const auto command = [](double t) { return 1.5 * std::sin(6 * t + 2 * t * t); };
  const std::string cable = "cable_spring@arm.", gravity = "gravity_offset@arm.", size = "stiffness_n_m_per_rad";
  struct Case {
    Rig rig;
    std::map<std::string, double> values;
  };
  for (const Case& c :
       {Case{LoadRig("qube", {"cable_spring@arm"}), {{cable + size, 2e-3}, {cable + "rest_rad", -0.7}}},
        Case{LoadRig("qube", {"gravity_offset@arm"}), {{gravity + "torque_n_m", 2e-3}, {gravity + "rest_rad", -0.7}}},
        Case{LoadCubicCable(),
             {{cable + size, 2e-3}, {cable + "rest_rad", -0.3}, {cable + "stiffness_cubic_n_m_per_rad3", 4e-3}}}}) {
    const auto truth = c.rig.Values(c.values);
    const std::vector<Recording> logs = {MakeLog(c.rig, truth, command, 4, 0.004, 2e-3, 1)};
    FitOptions options{.time_step_s = 0.004, .fit_offsets = false};
    for (const auto& [name, value] : c.values) options.free.push_back(c.rig.Index(name));
    std::vector<TunedParameter> tuned[2];
    for (const bool linear : {false, true}) {
      options.linear_terms = linear;
      FitProblem problem(*c.rig.model, logs, options, truth, pool);
      const FitPoint point = Solve(problem, problem.Start(), {.tolerance = 1e-7}).point;
      tuned[linear] = EstimateUncertainty(problem, point,
                                          Linearize(problem, point, {.columns = DifferenceOptions::Columns::kCentral}))
                          .tuned;
      ASSERT_EQ(tuned[linear].size(), c.values.size());
      for (const TunedParameter& t : tuned[linear])
        EXPECT_NEAR(t.value, problem.Values(point)[static_cast<std::size_t>(t.index)], 1e-12);
    }
    for (std::size_t i = 0; i < c.values.size(); ++i) {
      const double width = tuned[0][i].high - tuned[0][i].low;
      const std::string& name = c.rig.model->parameters()[static_cast<std::size_t>(tuned[0][i].index)].name;
      EXPECT_NEAR(tuned[1][i].value, tuned[0][i].value, 0.05 * width) << name;
      EXPECT_NEAR(tuned[1][i].high - tuned[1][i].low, width, 0.05 * width) << name;
      EXPECT_GT(width, 0);
    }
  }
}

// A log that stands still tells nothing of the gain: its interval is what was known beforehand, at that deviation,
// however often a fit counts it and however few blocks there are.
TEST(CovarianceTest, WhereTheLogsAreSilentTheIntervalIsWhatWasKnown) {
  const Rig rig = LoadCart();
  ThreadPool pool(1);
  std::mt19937_64 random(2);
  std::normal_distribution<double> normal(0, 1e-3);
  std::vector<double> q(501);
  for (double& x : q) x = normal(random);
  const std::vector<Recording> logs = {MakeRecording(rig, std::vector<double>(q.size(), 0.0), q, kCartStep_s)};
  const int gain = rig.Index("cart.gain");
  const Parameter& p = rig.model->parameters()[static_cast<std::size_t>(gain)];
  for (const double scale : {1.0, 10.0}) {
    FitProblem problem(*rig.model, logs,
                       {.free = {gain},
                        .time_step_s = kCartStep_s,
                        .fit_shift = false,
                        .weights = {1e3},
                        .prior_share = 0.05,
                        .prior_scale = scale},
                       rig.Values(), pool);
    const FitPoint point = Solve(problem, problem.Start(), {.tolerance = 1e-7}).point;
    const auto found = EstimateUncertainty(problem, point, Linearize(problem, point, {}));
    const double half = 1.96 * 0.05 * (p.high - p.low);
    EXPECT_NEAR(found.tuned[0].high - found.tuned[0].value, half, 0.01 * half) << scale;
    EXPECT_NEAR(found.tuned[0].value - found.tuned[0].low, half, 0.01 * half) << scale;
  }
}

}  // namespace
}  // namespace gapscope::testing
