// Two sides of a comparison timed in one run, one after the other again and again, so that both meet the same machine:
// its clock, its caches, its other users. A row is the median of the pairs' ratios, with the range that holds the
// middle 80 % of them.
#ifndef GAPSCOPE_BENCH_MEASURE_H_
#define GAPSCOPE_BENCH_MEASURE_H_

#include <functional>
#include <string>
#include <vector>

namespace gapscope::bench {

// One line of the result (schema gapscope.bench/1).
struct Row {
  std::string name;
  double value = 0, low = 0, high = 0;  // median, 10th and 90th percentile of the repeats
  double target = 0;
  std::string better = "higher";
  std::string detail;  // for the reader: the two sides in their own units
};

enum class Clock {
  kThread,  // processor time of the calling thread: other programs' share does not count
  kWall,
};

double Now_s(Clock clock);

// Time of one call, s.
double Time_s(Clock clock, const std::function<void()>& work);

// The p-quantile (0 to 1) by linear interpolation between order statistics; NaN of nothing.
double Quantile(std::vector<double> values, double p);

struct Pairs {
  std::vector<double> a_s, b_s;  // one time per repeat
};
// Runs a, b, b, a, a, b ... after one warm-up of each: what comes first changes from pair to pair.
Pairs TimePairs(Clock clock, int repeats, const std::function<void()>& a, const std::function<void()>& b);

// Fills value, low and high from one number per repeat.
void Summarise(const std::vector<double>& values, Row& row);

}  // namespace gapscope::bench

#endif  // GAPSCOPE_BENCH_MEASURE_H_
