// Windows that start where no joint's own signal says: an elastic link seen by a gyro alone, against the closed form of
// two discs on a torsional spring.
#include <gtest/gtest.h>

#include <cmath>

#include "src/fit/fit_problem.h"
#include "src/fit/optimizers.h"
#include "tests/experiment/scratch.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

constexpr double kHub_kg_m2 = 0.02, kLink_kg_m2 = 0.01, kStiffness = 6, kPeriod_s = 0.005;

const char kDiscs[] = R"(<mujoco>
  <option timestep="0.001" integrator="RK4" gravity="0 0 0"><flag contact="disable"/></option>
  <worldbody><body name="hub"><joint name="hub" axis="0 0 1"/>
    <inertial pos="0 0 0" mass="1" diaginertia="0.02 0.02 0.02"/>
    <body name="link"><joint name="link" axis="0 0 1" stiffness="6"/>
      <inertial pos="0 0 0" mass="1" diaginertia="0.01 0.01 0.01"/><site name="imu"/></body>
  </body></worldbody>
  <sensor><gyro name="gyro" site="imu"/></sensor>
</mujoco>)";

const char kYaml[] = R"(schema: gapscope.experiment/1
model: robot.xml
log: {time: {column: t, unit: s}}
measured:
)";

// Both discs about their common axis: the spring's mode, and the drift of all.
struct Motion {
  double hub = 0, hub_speed = 0, link = 0, link_speed = 0;  // the link's relative to the hub
  double gyro() const { return hub_speed + link_speed; }
};
Motion Exact(double t) {
  constexpr double kSwing = 0.05, kPhase = 0.7, kDrift = 0.3;
  const double w = std::sqrt(kStiffness * (1 / kHub_kg_m2 + 1 / kLink_kg_m2));
  const double share = kLink_kg_m2 / (kHub_kg_m2 + kLink_kg_m2);
  Motion at{.link = kSwing * std::cos(w * t + kPhase), .link_speed = -w * kSwing * std::sin(w * t + kPhase)};
  at.hub = kDrift * t - share * at.link;
  at.hub_speed = kDrift - share * at.link_speed;
  return at;
}

class UnseenStatesTest : public ::testing::Test {
 protected:
  // `columns` of `measured`; each is filled from the closed form.
  void Load(const std::string& measured) {
    scratch_.Write("robot.xml", kDiscs);
    scratch_.Write("experiment.yaml", kYaml + measured);
    rig_.experiment = LoadExperiment(scratch_.Path("experiment.yaml")).value();
    rig_.model = Model::Load(rig_.experiment).value();
    Recording log{.log_path = "made"};
    for (int k = 0; k <= 200; ++k) log.time_s.push_back(k * kPeriod_s);
    log.timeline.median_step_s = kPeriod_s;
    for (std::size_t s = 0; s < rig_.experiment.measured.size(); ++s) {
      const MeasuredSpec& spec = rig_.experiment.measured[s];
      log.measured.push_back({.spec = spec, .index = s, .column = "made", .values = {}});
      for (const double t : log.time_s) {
        const Motion at = Exact(t);
        log.measured.back().values.push_back(spec.kind == SignalKind::kPosition ? at.hub : at.gyro());
      }
    }
    logs_ = {log};
  }
  FitOptions Options() const { return {.window_s = 0.25, .lead_in_s = 0, .fit_offsets = false, .fit_shift = false}; }

  Scratch scratch_;
  Rig rig_;
  std::vector<Recording> logs_;
  ThreadPool pool_{1};
};

FitPoint Solved(FitProblem& problem) {
  ProblemObjective objective(problem);
  Work work;
  return SolveStates(problem, objective, problem.Start(), 6, &work);
}

TEST_F(UnseenStatesTest, ALinkSeenByAGyroStartsWhereItReallyWas) {
  constexpr double kDeflection_rad = 2e-4, kSpeed_rad_per_s = 5e-3;  // of 0.05 rad and 1.5 rad/s
  Load(
      "  - {signal: hub, column: hub, joint: hub, unit: rad}\n  - {signal: gyro, sensor: gyro, element: 2, column: "
      "g}\n");
  FitProblem problem(*rig_.model, logs_, Options(), rig_.Values(), pool_);
  ASSERT_EQ(problem.windows().size(), 4u);
  const FitPoint found = Solved(problem);
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const Motion at = Exact(logs_[0].time_s[problem.windows()[w].rows.begin]);
    ASSERT_EQ(found.states[w].size(), 4) << "two of the hub, two of the link";
    EXPECT_NEAR(found.states[w][2], at.link, kDeflection_rad) << w;
    EXPECT_NEAR(found.states[w][3], at.link_speed, kSpeed_rad_per_s) << w;
  }
  const double at_rest = problem.Evaluate(problem.Start(), Keep::kCost).cost;
  EXPECT_LT(problem.Evaluate(found, Keep::kCost).cost, 1e-3 * at_rest);
}

// The hub's angle alone is in nothing that a gyro sees: it stays where the model has it.
TEST_F(UnseenStatesTest, AGyroAloneFindsAllThatItCanSee) {
  constexpr double kTolerance = 3e-3;
  Load("  - {signal: gyro, sensor: gyro, element: 2, column: g}\n");
  FitProblem problem(*rig_.model, logs_, Options(), rig_.Values(), pool_);
  const FitPoint found = Solved(problem);
  for (std::size_t w = 0; w < problem.windows().size(); ++w) {
    const Motion at = Exact(logs_[0].time_s[problem.windows()[w].rows.begin]);
    ASSERT_EQ(found.states[w].size(), 4);
    EXPECT_NEAR(found.states[w][0], 0, 1e-12);
    EXPECT_NEAR(found.states[w][1], at.hub_speed, kTolerance * 1.5) << w;
    EXPECT_NEAR(found.states[w][2], at.link, kTolerance * 0.05) << w;
    EXPECT_NEAR(found.states[w][3], at.link_speed, kTolerance * 1.5) << w;
  }
}

TEST_F(UnseenStatesTest, AJointWithASpeedColumnIsMeasured) {
  Load(
      "  - {signal: hub, column: hub, joint: hub, unit: rad}\n"
      "  - {signal: link, kind: velocity, joint: link, column: g}\n");
  const FitProblem problem(*rig_.model, logs_, Options(), rig_.Values(), pool_);
  EXPECT_TRUE(problem.layout().unseen[0].dofs.empty());
  EXPECT_EQ(problem.windows()[0].prior.size(), 2);
}

TEST_F(UnseenStatesTest, NoneIsAddedWhereStatesAreNotFitted) {
  Load("  - {signal: gyro, sensor: gyro, element: 2, column: g}\n");
  FitOptions options = Options();
  options.fit_states = false;
  FitProblem problem(*rig_.model, logs_, options, rig_.Values(), pool_);
  EXPECT_EQ(problem.windows()[0].prior.size(), 0);
  EXPECT_TRUE(std::isfinite(problem.Evaluate(problem.Start(), Keep::kCost).cost));
}

}  // namespace
}  // namespace gapscope::testing
