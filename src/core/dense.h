// Decompositions of small dense matrices, compiled once: whoever includes this pays for Eigen/Core only. The arithmetic
// is Eigen's own (LDLT, SelfAdjointEigenSolver ...); matrices are dynamic and hold a handful of rows.
//
// Sizes that do not fit are a broken contract of the caller and throw std::logic_error (GS_CHECK). Numbers that are not
// finite go in and come out: whoever cannot rule them out asks allFinite() of the answer.
#ifndef GAPSCOPE_CORE_DENSE_H_
#define GAPSCOPE_CORE_DENSE_H_

#include <Eigen/Core>
#include <memory>

namespace gapscope {

// A symmetric matrix (its lower triangle is read) as P' L D L' P: solves with several right sides after one
// factorisation. Directions in which the matrix is singular get a zero.
class Ldlt {
 public:
  explicit Ldlt(const Eigen::MatrixXd& symmetric);
  ~Ldlt();
  Ldlt(const Ldlt&) = delete;
  Ldlt& operator=(const Ldlt&) = delete;

  // x of `symmetric x = right`: a vector for a vector, a matrix for a matrix.
  template <class Right>
  [[nodiscard]] auto Solve(const Eigen::MatrixBase<Right>& right) const {
    if constexpr (Right::ColsAtCompileTime == 1) {
      return SolveVector(right);
    } else {
      return SolveMatrix(right);
    }
  }
  // No pivot is negative (zero counts as positive).
  [[nodiscard]] bool IsPositive() const;

 private:
  [[nodiscard]] Eigen::VectorXd SolveVector(const Eigen::VectorXd& right) const;
  [[nodiscard]] Eigen::MatrixXd SolveMatrix(const Eigen::MatrixXd& right) const;
  std::unique_ptr<const Eigen::LDLT<Eigen::MatrixXd>> factors_;
};

// Eigenvalues from the smallest up, eigenvectors of length one as columns in the same order.
struct SymmetricEigen {
  explicit SymmetricEigen(const Eigen::MatrixXd& symmetric);
  Eigen::VectorXd values;
  Eigen::MatrixXd vectors;
};

// Eigenvalues of any square matrix in no order; conjugate pairs stand side by side.
struct GeneralEigen {
  explicit GeneralEigen(const Eigen::MatrixXd& square);
  Eigen::VectorXcd values;
  Eigen::MatrixXcd vectors;  // columns of length one, in the order of `values`
};
[[nodiscard]] Eigen::VectorXcd Eigenvalues(const Eigen::MatrixXd& square);

// Singular values of a square matrix, from the largest down.
[[nodiscard]] Eigen::VectorXd SingularValues(const Eigen::MatrixXd& square);

// x of `square x = right`, by LU with full pivoting.
[[nodiscard]] Eigen::MatrixXd SolveLu(const Eigen::MatrixXd& square, const Eigen::MatrixXd& right);

[[nodiscard]] Eigen::MatrixXd Inverse(const Eigen::MatrixXd& square);
// Moore and Penrose's, of any shape, by the complete orthogonal decomposition.
[[nodiscard]] Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& matrix);
[[nodiscard]] Eigen::MatrixXd MatrixExponential(const Eigen::MatrixXd& square);

}  // namespace gapscope

#endif  // GAPSCOPE_CORE_DENSE_H_
