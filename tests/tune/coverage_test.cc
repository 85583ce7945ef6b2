// Are the intervals of a fit honest? The same cart, measured many times with other noise: how often its known gain and
// damping lie in their 95 % intervals. scripts/recovery counts the same on the rigs.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/tune/fixture.h"

namespace gapscope::testing {
namespace {

struct Count {
  int inside = 0;
  double mean_half_width = 0, deviation = 0;  // of the estimates about the truth
};

TEST(CoverageTest, IntervalsHoldTheTruthAsOftenAsTheySay) {
  constexpr int kRuns = 60;
  const Rig rig = LoadCart();
  const std::vector<double> truth = rig.Values({{"cart.gain", 1.8}, {"cart.damping", 0.4}});
  const std::vector<int> free = {rig.Index("cart.gain"), rig.Index("cart.damping")};
  ThreadPool pool(2);
  std::vector<Count> counts(free.size());
  for (int run = 0; run < kRuns; ++run) {
    std::vector<Recording> logs;
    for (int k = 0; k < 3; ++k) {
      const auto command = [k](double t) { return std::sin((3 + k) * t + t * t); };
      logs.push_back(MakeLog(rig, truth, command, 2, kCartStep_s, 2e-3, static_cast<unsigned long>(100 * run + k)));
      logs.back().log_path = "log" + std::to_string(k);
    }
    const auto found = Tune(*rig.model, SplitData(std::move(logs), {}), rig.model->Nominal(),
                            {.free = free, .time_step_s = kCartStep_s, .starts = 1}, pool);
    ASSERT_TRUE(found.ok()) << found.error().Text();
    ASSERT_EQ(found.value().tuned.size(), free.size());
    for (std::size_t i = 0; i < free.size(); ++i) {
      const TunedParameter& t = found.value().tuned[i];
      const double known = truth[static_cast<std::size_t>(t.index)];
      ASSERT_TRUE(t.identifiable);
      counts[i].inside += t.low <= known && known <= t.high;
      counts[i].mean_half_width += (t.high - t.low) / 2 / kRuns;
      counts[i].deviation += (t.value - known) * (t.value - known) / kRuns;
    }
  }
  for (Count& count : counts) {
    count.deviation = std::sqrt(count.deviation);
    // 57 of 60 on average; fewer than 52 would happen once in 250 times if the intervals were exact.
    EXPECT_GE(count.inside, 52);
    // Nor are they honest by being wide: 1.96 standard deviations, up to twice that for what is known of the noise.
    EXPECT_LT(count.mean_half_width, 2 * 1.96 * count.deviation);
  }
}

}  // namespace
}  // namespace gapscope::testing
