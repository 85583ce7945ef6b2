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

TEST(CoarsenTest, LeavesALogWithTorqueAlone) {
  Recording log = MakeRecording({0, 0.001, 0.002, 0.003, 0.004}, {1, 2, 3, 4, 5}, {0, 1, 2, 3, 4});
  log.measured.push_back(log.measured[0]);
  log.measured[1].spec.kind = SignalKind::kTorque;
  EXPECT_EQ(Coarsen(log, 0.004).rows(), log.rows());
  log.measured[1].spec.scored = false;
  EXPECT_LT(Coarsen(log, 0.004).rows(), log.rows());
}

}  // namespace
}  // namespace gapscope
