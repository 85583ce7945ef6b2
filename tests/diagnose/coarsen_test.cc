#include "src/diagnose/coarsen.h"

#include <gtest/gtest.h>

#include <cmath>

namespace gapscope {
namespace {

Recording MakeRecording(const std::vector<double>& time, const std::vector<double>& command,
                        const std::vector<double>& measured) {
  Recording r;
  r.time_s = time;
  r.commands.push_back({.actuator = "motor", .column = "u", .values = command});
  r.measured.push_back({.spec = {}, .index = 0, .column = "q", .values = measured});
  r.timeline.median_step_s = time[1] - time[0];
  return r;
}

double Impulse(const Recording& r) {
  double sum = 0;
  for (std::size_t k = 0; k + 1 < r.rows(); ++k) sum += r.commands[0].values[k] * (r.time_s[k + 1] - r.time_s[k]);
  return sum;
}

TEST(CoarsenTest, KeepsSamplesAndImpulse) {
  const Recording fine = MakeRecording({0, 0.001, 0.002, 0.003, 0.004, 0.005, 0.006, 0.007, 0.008},
                                       {1, 2, 3, 4, -1, -2, -3, 6, 0}, {0, 1, 2, 3, 4, 5, 6, 7, 8});
  const Recording coarse = Coarsen(fine, 0.004);
  EXPECT_EQ(coarse.time_s, (std::vector<double>{0, 0.004, 0.008}));
  EXPECT_EQ(coarse.measured[0].values, (std::vector<double>{0, 4, 8}));
  EXPECT_DOUBLE_EQ(coarse.commands[0].values[0], 2.5);
  EXPECT_DOUBLE_EQ(coarse.commands[0].values[1], 0);
  EXPECT_NEAR(Impulse(coarse), Impulse(fine), 1e-15);
  EXPECT_DOUBLE_EQ(coarse.timeline.median_step_s, 0.004);
}

// Where a mass is under the command, at the kept stamps; its second differences are those of 10 Hz alone.
double SwingOfAMass(const Recording& r) {
  std::vector<double> way;
  double position = 0, speed = 0;
  for (std::size_t k = 0; k + 1 < r.rows(); ++k) {
    const double step = r.time_s[k + 1] - r.time_s[k], u = r.commands[0].values[k];
    position += speed * step + 0.5 * u * step * step;
    speed += u * step;
    if (std::abs(std::remainder(r.time_s[k + 1], 0.004)) < 1e-9) way.push_back(position);
  }
  double squares = 0;
  for (std::size_t k = 25; k < 75; ++k) squares += std::pow(way[k + 1] - 2 * way[k] + way[k - 1], 2);  // two periods
  return std::sqrt(squares);
}

// A mean that is held would move it half a percent less.
TEST(CoarsenTest, MovesAMassAsTheCommandItselfDoes) {
  std::vector<double> time, command;
  for (int i = 0; i <= 400; ++i) {
    time.push_back(0.001 * i);
    command.push_back(std::cos(2 * M_PI * 10 * time.back()));
  }
  const Recording fine = MakeRecording(time, command, command);
  EXPECT_NEAR(SwingOfAMass(Coarsen(fine, 0.004)) / SwingOfAMass(fine), 1, 3e-4);
}

// Sharpening goes no further than the command goes.
TEST(CoarsenTest, LeavesJumpsAsTheyAre) {
  std::vector<double> time, command;
  for (int i = 0; i <= 40; ++i) {
    time.push_back(0.001 * i);
    command.push_back(i < 16 ? 0 : 5);
  }
  const Recording coarse = Coarsen(MakeRecording(time, command, command), 0.004);
  for (std::size_t k = 0; k < coarse.rows(); ++k) EXPECT_EQ(coarse.commands[0].values[k], k < 4 ? 0 : 5) << k;
}

// A missed row holds the old command for longer: it weighs by its time.
TEST(CoarsenTest, WeighsByTime) {
  const Recording fine = MakeRecording({0, 0.001, 0.004, 0.005, 0.006, 0.009}, {8, 4, 1, 1, 1, 1}, {0, 1, 4, 5, 6, 9});
  const Recording coarse = Coarsen(fine, 0.004);
  ASSERT_EQ(coarse.time_s[1], 0.004);
  EXPECT_NEAR(coarse.commands[0].values[0], (8 * 0.001 + 4 * 0.003) / 0.004, 1e-12);
}

TEST(CoarsenTest, LeavesASlowLogAlone) {
  const Recording slow = MakeRecording({0, 0.005, 0.0101, 0.015}, {1, 2, 3, 4}, {1, 2, 3, 4});
  const Recording same = Coarsen(slow, 0.004);
  EXPECT_EQ(same.time_s, slow.time_s);
  EXPECT_EQ(same.commands[0].values, slow.commands[0].values);
}

TEST(CoarsenTest, ScoredForcesFollowTheLogsOwnCommands) {
  Recording log = MakeRecording({0, 0.001, 0.002, 0.003, 0.004}, {1, 2, 3, 4, 5}, {0, 1, 2, 3, 4});
  log.measured.push_back(log.measured[0]);
  log.measured[1].spec.kind = SignalKind::kTorque;
  const Recording coarse = Coarsen(log, 0.004);
  EXPECT_EQ(coarse.measured[1].values, (std::vector<double>{0, 4}));
  ASSERT_TRUE(coarse.finer);
  EXPECT_EQ(coarse.finer->commands[0].values, log.commands[0].values);
  log.measured[1].spec.scored = false;
  EXPECT_FALSE(Coarsen(log, 0.004).finer);
}

}  // namespace
}  // namespace gapscope
