#include "src/core/dense.h"

#include <Eigen/Dense>
#include <unsupported/Eigen/MatrixFunctions>

#include "src/core/result.h"

namespace gapscope {

Ldlt::Ldlt(const Eigen::MatrixXd& symmetric) {
  GS_CHECK(symmetric.rows() == symmetric.cols());
  factors_ = std::make_unique<const Eigen::LDLT<Eigen::MatrixXd>>(symmetric);
}
Ldlt::~Ldlt() = default;

Eigen::VectorXd Ldlt::SolveVector(const Eigen::VectorXd& right) const {
  GS_CHECK(right.rows() == factors_->rows());
  return factors_->solve(right);
}
Eigen::MatrixXd Ldlt::SolveMatrix(const Eigen::MatrixXd& right) const {
  GS_CHECK(right.rows() == factors_->rows());
  if (right.cols() == 0) return right;  // Eigen's blocking divides by the number of columns
  return factors_->solve(right);
}
bool Ldlt::IsPositive() const { return factors_->isPositive(); }

SymmetricEigen::SymmetricEigen(const Eigen::MatrixXd& symmetric) {
  GS_CHECK(symmetric.rows() == symmetric.cols());
  const Eigen::SelfAdjointEigenSolver<Eigen::MatrixXd> solver(symmetric);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}

GeneralEigen::GeneralEigen(const Eigen::MatrixXd& square) {
  GS_CHECK(square.rows() == square.cols());
  const Eigen::EigenSolver<Eigen::MatrixXd> solver(square);
  values = solver.eigenvalues();
  vectors = solver.eigenvectors();
}

Eigen::VectorXcd Eigenvalues(const Eigen::MatrixXd& square) {
  GS_CHECK(square.rows() == square.cols());
  return Eigen::EigenSolver<Eigen::MatrixXd>(square, false).eigenvalues();
}

Eigen::VectorXd SingularValues(const Eigen::MatrixXd& square) {
  GS_CHECK(square.rows() == square.cols());
  return Eigen::JacobiSVD<Eigen::MatrixXd, Eigen::NoQRPreconditioner>(square).singularValues();
}

Eigen::MatrixXd SolveLu(const Eigen::MatrixXd& square, const Eigen::MatrixXd& right) {
  GS_CHECK(square.rows() == square.cols() && right.rows() == square.rows());
  return square.fullPivLu().solve(right);
}

Eigen::MatrixXd Inverse(const Eigen::MatrixXd& square) {
  GS_CHECK(square.rows() == square.cols());
  return square.inverse();
}

Eigen::MatrixXd PseudoInverse(const Eigen::MatrixXd& matrix) {
  return matrix.completeOrthogonalDecomposition().pseudoInverse();
}

Eigen::MatrixXd MatrixExponential(const Eigen::MatrixXd& square) {
  GS_CHECK(square.rows() == square.cols());
  return square.exp();
}

}  // namespace gapscope
