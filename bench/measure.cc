#include "bench/measure.h"

#include <time.h>

#include <algorithm>
#include <cmath>
#include <limits>

namespace gapscope::bench {

double Now_s(Clock clock) {
  timespec now{};
  clock_gettime(clock == Clock::kThread ? CLOCK_THREAD_CPUTIME_ID : CLOCK_MONOTONIC, &now);
  return static_cast<double>(now.tv_sec) + 1e-9 * static_cast<double>(now.tv_nsec);
}

double Time_s(Clock clock, const std::function<void()>& work) {
  const double begin = Now_s(clock);
  work();
  return Now_s(clock) - begin;
}

double Quantile(std::vector<double> values, double p) {
  if (values.empty()) return std::numeric_limits<double>::quiet_NaN();
  std::sort(values.begin(), values.end());
  const double place = p * static_cast<double>(values.size() - 1);
  const auto below = static_cast<std::size_t>(place);
  const std::size_t above = std::min(below + 1, values.size() - 1);
  return values[below] + (place - static_cast<double>(below)) * (values[above] - values[below]);
}

Pairs TimePairs(Clock clock, int repeats, const std::function<void()>& a, const std::function<void()>& b) {
  a();
  b();
  Pairs pairs;
  for (int i = 0; i < repeats; ++i) {
    if (i % 2 == 0) {
      pairs.a_s.push_back(Time_s(clock, a));
      pairs.b_s.push_back(Time_s(clock, b));
    } else {
      pairs.b_s.push_back(Time_s(clock, b));
      pairs.a_s.push_back(Time_s(clock, a));
    }
  }
  return pairs;
}

void Summarise(const std::vector<double>& values, Row& row) {
  row.value = Quantile(values, 0.5);
  row.low = Quantile(values, 0.1);
  row.high = Quantile(values, 0.9);
}

}  // namespace gapscope::bench
