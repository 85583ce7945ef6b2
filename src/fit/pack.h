// Results of a fit as numbers in a row, and back: what a journal keeps.
#ifndef GAPSCOPE_FIT_PACK_H_
#define GAPSCOPE_FIT_PACK_H_

#include <Eigen/Core>
#include <vector>

#include "src/core/result.h"
#include "src/fit/options.h"

namespace gapscope {

inline void Put(std::vector<double>& out, const Eigen::MatrixXd& matrix) {
  out.push_back(static_cast<double>(matrix.rows()));
  out.push_back(static_cast<double>(matrix.cols()));
  out.insert(out.end(), matrix.data(), matrix.data() + matrix.size());
}

inline void Put(std::vector<double>& out, const Work& work) {
  for (const std::size_t n : {work.evaluations, work.replays, work.steps}) out.push_back(static_cast<double>(n));
}

// Reads a record's numbers in order.
class PackReader {
 public:
  explicit PackReader(const std::vector<double>& in) : in_(in) {}
  double Number() { return in_.at(at_++); }
  std::size_t Count() { return static_cast<std::size_t>(Number()); }
  Work TakeWork() {
    Work work;
    work.evaluations = Count(), work.replays = Count(), work.steps = Count();
    return work;
  }
  Eigen::MatrixXd Matrix() {
    const auto rows = static_cast<Eigen::Index>(Number()), columns = static_cast<Eigen::Index>(Number());
    GS_CHECK(rows >= 0 && columns >= 0 && at_ + static_cast<std::size_t>(rows * columns) <= in_.size());
    const Eigen::MatrixXd matrix = Eigen::Map<const Eigen::MatrixXd>(in_.data() + at_, rows, columns);
    at_ += static_cast<std::size_t>(rows * columns);
    return matrix;
  }

 private:
  const std::vector<double>& in_;
  std::size_t at_ = 0;
};

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_PACK_H_
