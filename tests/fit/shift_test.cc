// How far a log's stamps are off from what happened: nuisances that must not go into what is fitted beside them.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "src/fit/gram.h"
#include "src/fit/optimizers.h"
#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

// A force jumps with its command, and a log reads it at a stamp just before or just after: here before at every stamp,
// after at every stamp, and before at every other one. What is made of the stamps must not go into the gain.
TEST(FitShiftTest, ForcesReadOnEitherSideOfTheirCommandLeaveTheGainAlone) {
  const Rig rig = LoadCart(-10, 10, true);
  constexpr double kGain = 1.2;
  for (const double after : {0.0, 0.5, 1.0}) {
    std::mt19937_64 random(5);
    std::uniform_real_distribution<double> uniform(-1, 1);
    std::vector<double> command(1500);
    for (std::size_t k = 0; k < command.size(); ++k)
      command[k] = std::sin(0.02 * static_cast<double>(k)) + (k / 100 % 2 == 0 ? 0.5 : -0.5) + uniform(random);
    Recording log = MakeRecording(rig, command, CartMotion(kGain, 0.1, -0.3, command), kCartStep_s);
    log.measured.push_back({.spec = rig.experiment.measured[1], .index = 1, .column = "f", .values = command});
    std::vector<double>& force = log.measured.back().values;
    for (std::size_t k = command.size() - 1; k > 0; --k)
      force[k] = kGain * command[after == 1 || (after == 0.5 && k % 2 == 0) ? k : k - 1];
    FitOptions options{
        .free = {rig.Index("cart.gain")}, .window_s = 0.5, .lead_in_s = 0.02, .time_step_s = kCartStep_s};
    const std::vector<Recording> logs = {log};
    ThreadPool pool(1);
    const auto solved = [&](bool shift) {
      options.fit_shift = shift;
      FitProblem problem(*rig.model, logs, options, rig.model->Nominal(), pool);
      const FitPoint point = Solve(problem, problem.Start(), {.tolerance = 1e-8}).point;
      return std::pair(problem.Values(point)[rig.Index("cart.gain")], problem.Stamps(point));
    };
    const auto [gain, stamps] = solved(true);
    EXPECT_NEAR(gain, kGain, 0.02 * kGain) << after;
    EXPECT_NEAR(stamps.forces_s, after * kCartStep_s, 0.1 * kCartStep_s) << after;
    EXPECT_NEAR(stamps.commands_s, 0, 0.1 * kCartStep_s) << after;
    if (after == 0) continue;
    EXPECT_GT(std::abs(solved(false).first - kGain), 0.05 * kGain) << after;
  }
}

// Where all sensors are late by one time, a shift of the commands is the same motion: the time would be known to a
// sample at best, and by no slope at all. One sensor's time leaves the shift.
TEST(FitShiftTest, ALateMotionTakesTheShiftsPlace) {
  constexpr double kLate_s = 0.012;
  const Rig rig = LoadRig("flexlink", {"sensor_delay@all"}), one = LoadRig("flexlink", {"sensor_delay@hub_rad"});
  const int delay = rig.Index("sensor_delay@all.delay_s");
  const auto command = [](double t) { return 0.4 * std::sin(5 * t + 3 * t * t); };
  const std::vector<Recording> logs = {
      MakeLog(rig, rig.Values({{"sensor_delay@all.delay_s", kLate_s}}), command, 4, 0.004, 2e-4, 1)};
  ThreadPool pool(2);
  const FitOptions options{.free = {rig.Index("hub.inertia"), delay}, .time_step_s = 0.004};
  FitProblem problem(*rig.model, logs, options, rig.model->Nominal(), pool);
  const FitPoint point = Solve(problem, problem.Start(), {.tolerance = 1e-6}).point;
  EXPECT_EQ(problem.Stamps(point).commands_s, 0);
  EXPECT_NEAR(problem.Values(point)[static_cast<std::size_t>(delay)], kLate_s, 3e-4);
  EXPECT_LT(problem.layout().command_shift, 0);
  const FitOptions of_one{.free = {one.Index("hub.inertia")}, .time_step_s = 0.004};
  EXPECT_GE(FitProblem(*one.model, logs, of_one, one.model->Nominal(), pool).layout().command_shift, 0);
}

// A command later than one sample drives the nuisance shift onto its bound: a column must still tell what a delay would
// explain.
TEST(ExtraColumnTest, SeesADelayBeyondTheNuisanceShift) {
  const Rig truth = LoadRig("flexlink", {"command_delay@motor"}), rig = LoadRig("flexlink");
  const auto command = [](double t) { return 0.4 * std::sin(5 * t + 3 * t * t); };
  const std::vector<Recording> logs = {
      MakeLog(truth, truth.Values({{"command_delay@motor.delay_s", 0.012}}), command, 4, 0.004, 2e-4, 1)};
  ThreadPool pool(2);
  const FitOptions options{
      .free = {rig.Index("motor.torque_per_ampere"), rig.Index("hub.inertia"), rig.Index("link.stiffness")},
      .time_step_s = 0.004};
  FitProblem parent(*rig.model, logs, options, rig.model->Nominal(), pool);
  const FitPoint point = Solve(parent, parent.Start(), {.tolerance = 1e-5}).point;
  EXPECT_NEAR(parent.Stamps(point).commands_s, 0.004, 1e-9);
  FitOptions of_child = options;
  of_child.free = {truth.Index("motor.torque_per_ampere"), truth.Index("hub.inertia"), truth.Index("link.stiffness"),
                   truth.Index("command_delay@motor.delay_s")};
  FitProblem child(*truth.model, logs, of_child, truth.model->Nominal(), pool);
  const auto drop = [&](double delay_s) {
    const ExtraColumn delay{
        .name = "delay", .child = &child, .values = truth.Values({{"command_delay@motor.delay_s", delay_s}})};
    const GramSystem gram = MakeGram(parent, point, {&delay, 1}, {.step = 0.01});
    const Eigen::MatrixXd& sum = gram.parts[0];
    const ColumnBounds bounds = BoundsAt(parent, point, gram, 2);
    std::vector<Eigen::Index> all(static_cast<std::size_t>(gram.parameters) + 1);
    std::iota(all.begin(), all.end(), 0);
    const double without = SolveBounded(sum, std::span(all).first(all.size() - 1), bounds).cost;
    return 1 - SolveBounded(sum, all, bounds).cost / without;
  };
  EXPECT_GT(drop(0.008), 0.3);
  EXPECT_LT(drop(0.001), 0.01);  // earlier than the shift already is
}

}  // namespace
}  // namespace gapscope::testing
