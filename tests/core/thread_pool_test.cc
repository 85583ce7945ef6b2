#include "src/core/thread_pool.h"

#include <gtest/gtest.h>

#include <atomic>
#include <stdexcept>
#include <vector>

namespace gapscope {
namespace {

TEST(ThreadPoolTest, EveryTaskRunsOnceOnAWorkerOfItsOwn) {
  ThreadPool pool(3);
  for (int round = 0; round < 50; ++round) {
    std::vector<int> runs(97, 0);
    std::vector<std::atomic<int>> inside(3);
    pool.ForEach(runs.size(), [&](std::size_t index, int worker) {
      EXPECT_EQ(inside[worker]++, 0);
      ++runs[index];
      --inside[worker];
    });
    for (const int count : runs) ASSERT_EQ(count, 1);
  }
}

TEST(ThreadPoolTest, ATasksExceptionReachesTheCallerAndThePoolLivesOn) {
  ThreadPool pool(2);
  EXPECT_THROW(pool.ForEach(10,
                            [](std::size_t i, int) {
                              if (i == 3) throw std::runtime_error("x");
                            }),
               std::runtime_error);
  int sum = 0;
  std::mutex mutex;
  pool.ForEach(4, [&](std::size_t i, int) {
    const std::lock_guard lock(mutex);
    sum += static_cast<int>(i);
  });
  EXPECT_EQ(sum, 6);
}

}  // namespace
}  // namespace gapscope
