// The columns of one window's residuals, with its state taken out, and their products.
#ifndef GAPSCOPE_FIT_WINDOW_COLUMNS_H_
#define GAPSCOPE_FIT_WINDOW_COLUMNS_H_

#include <vector>

#include "src/fit/robust.h"
#include "src/fit/windows.h"

namespace gapscope {

// Columns [y | extra | residual], below the rows of each signal those of the state's prior. Signals that no state's
// column joins stand apart: there a column that is as good as zero is not kept. Of joints that do not touch, most are.
class WindowColumns {
 public:
  // Room for `size` columns; those of y are set. `jacobian`: columns of y, then of the state.
  void Begin(const Eigen::VectorXd& residual, const Eigen::MatrixXd& jacobian, const FitWindow& window,
             const Eigen::VectorXd& state, Eigen::Index size);
  // In the order of the columns. Zero below the signals' rows.
  void Set(Eigen::Index column, const Eigen::VectorXd& values);
  // Sets the residual, then robust weights, then the state out of all columns.
  void Finish(const Huber& huber);

  bool empty() const { return parts_.empty(); }
  // Columns of the products that are added to.
  struct Stripe {
    Eigen::Index first = 0, width = 0;
  };
  // Adds `weight` times the products of `count` rows from `begin` on, which are one signal's or one of the prior's: of
  // a stripe's columns with themselves and those behind them. `scratch` is kept from one call to the next.
  void AddProducts(Eigen::Index begin, Eigen::Index count, double weight, Stripe stripe, Eigen::MatrixXd* products,
                   std::vector<double>* scratch) const;

 private:
  // Signals that stand apart from others, and the states that move them.
  struct Part {
    std::vector<Eigen::Index> signals, states;
    std::vector<Eigen::Index> columns;  // that are kept, rising
    Eigen::MatrixXd values;             // theirs, in the first columns
  };
  // A row of all, in a part.
  struct Place {
    std::size_t part = 0;
    Eigen::Index row = 0;
  };

  void FindParts();
  void Add(Part& part, Eigen::Index column, const Eigen::VectorXd& values) const;
  // Of all signals; below them stand the rows of the state's prior.
  Eigen::Index SignalRows() const { return states_.rows() - states_.cols(); }
  Eigen::Index SignalRows(const Part& part) const {
    return signal_rows_ * static_cast<Eigen::Index>(part.signals.size());
  }
  // Of a column of all rows, a part's.
  Eigen::VectorXd Rows(const Part& part, const Eigen::VectorXd& values) const;

  Eigen::Index signal_rows_ = 0, size_ = 0;
  Eigen::VectorXd residual_;
  Eigen::MatrixXd states_;
  std::vector<Part> parts_;
  std::vector<Place> signals_, states_at_;  // where the rows of each begin
};

}  // namespace gapscope

#endif  // GAPSCOPE_FIT_WINDOW_COLUMNS_H_
