// A log's columns at some thousand rows: enough to see who follows whom, and quick for long logs of many joints.
#ifndef GAPSCOPE_DRAFT_SAMPLES_H_
#define GAPSCOPE_DRAFT_SAMPLES_H_

#include <vector>

#include "src/log/log.h"
#include "src/log/timeline.h"

namespace gapscope {

// y = slope x + c by least squares over the rows where both are there.
struct FittedLine {
  double slope = 0, intercept = 0;
  double correlation = 0;  // 0 where one of them does not move
};
FittedLine LineThrough(const std::vector<double>& x, const std::vector<double>& y);

// How a column follows another.
struct Following {
  double correlation = 0, slope = 0;  // at the lag where the correlation is largest in size
  double lag_s = 0;                   // above 0: it comes later than the other
};

class Samples {
 public:
  // Both must outlive this.
  Samples(const Log& log, const Timeline& timeline);

  std::size_t columns() const { return values_.size(); }
  // At each sampled row, in the file's unit; NaN where missing.
  const std::vector<double>& values(std::size_t column) const { return values_[column]; }
  // The same, so many rows earlier.
  std::vector<double> values_before(std::size_t column, int rows) const { return Shifted(column, -rows); }
  // Rows from 0 to `longest_s`, about `step_s` apart.
  std::vector<int> Lags(double longest_s, double step_s) const;
  // Of a line through the rows within about 10 ms; per second.
  const std::vector<double>& slopes(std::size_t column) const { return slopes_[column]; }
  double spread(std::size_t column) const { return highest_[column] - lowest_[column]; }  // 0 of a constant
  double lowest(std::size_t column) const { return lowest_[column]; }
  double highest(std::size_t column) const { return highest_[column]; }
  bool whole_numbers(std::size_t column) const { return whole_[column]; }
  // Lags of both signs up to 0.3 s.
  Following Follow(std::size_t leader, std::size_t follower) const;
  // A parabola through the rows around each sampled one: value, slope and second derivative in its middle, and how low
  // and high those rows are.
  struct Motion {
    double value, slope, curvature, lowest, highest;
  };
  std::vector<Motion> MotionOf(std::size_t column, double half_width_s) const;

 private:
  double At(std::size_t column, std::size_t row) const;
  std::vector<double> Shifted(std::size_t column, long rows) const;

  const Log& log_;
  const Timeline& timeline_;
  std::vector<std::size_t> rows_;  // of the timeline
  std::vector<std::vector<double>> values_, slopes_;
  std::vector<double> lowest_, highest_;
  std::vector<bool> whole_;
};

}  // namespace gapscope

#endif  // GAPSCOPE_DRAFT_SAMPLES_H_
