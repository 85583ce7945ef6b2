#include "src/core/dense.h"

#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

namespace gapscope {
namespace {

constexpr double kRounding = 1e-14;

// [2 1; 1 2] has the eigenvalues 1 and 3 and the inverse [2 -1; -1 2] / 3.
const Eigen::Matrix2d kSymmetric = (Eigen::Matrix2d() << 2, 1, 1, 2).finished();

TEST(DenseTest, LdltSolvesVectorsAndMatrices) {
  const Ldlt solver(kSymmetric);
  EXPECT_TRUE(solver.IsPositive());
  const Eigen::VectorXd x = solver.Solve(Eigen::Vector2d(3, 0));
  EXPECT_LT((x - Eigen::Vector2d(2, -1)).norm(), kRounding);
  const Eigen::MatrixXd inverse = solver.Solve(Eigen::MatrixXd::Identity(2, 2));
  EXPECT_LT((3 * inverse - (Eigen::Matrix2d() << 2, -1, -1, 2).finished()).norm(), kRounding);
}

TEST(DenseTest, LdltTellsIndefiniteAndLeavesSingularDirectionsAtZero) {
  EXPECT_FALSE(Ldlt(Eigen::Vector2d(1, -1).asDiagonal()).IsPositive());
  const Eigen::VectorXd x = Ldlt(Eigen::Vector2d(2, 0).asDiagonal()).Solve(Eigen::Vector2d(1, 5));
  EXPECT_EQ(x, Eigen::VectorXd(Eigen::Vector2d(0.5, 0)));
}

TEST(DenseTest, SymmetricEigenvaluesRise) {
  const SymmetricEigen eigen(kSymmetric);
  EXPECT_LT((eigen.values - Eigen::Vector2d(1, 3)).norm(), kRounding);
  EXPECT_LT((kSymmetric * eigen.vectors - eigen.vectors * eigen.values.asDiagonal()).norm(), kRounding);
  EXPECT_NEAR(eigen.vectors.col(0).norm(), 1, kRounding);
}

TEST(DenseTest, GeneralEigenvaluesOfARotationAreAConjugatePair) {
  const double turn = 0.3;
  const Eigen::MatrixXd rotation =
      (Eigen::Matrix2d() << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn)).finished();
  const GeneralEigen eigen(rotation);
  for (Eigen::Index i = 0; i < 2; ++i) {
    EXPECT_NEAR(eigen.values[i].real(), std::cos(turn), kRounding);
    EXPECT_NEAR(std::abs(eigen.values[i].imag()), std::sin(turn), kRounding);
    EXPECT_LT((rotation * eigen.vectors.col(i) - eigen.values[i] * eigen.vectors.col(i)).norm(), kRounding);
  }
  EXPECT_EQ(Eigenvalues(rotation), eigen.values);
}

TEST(DenseTest, SingularValuesFall) {
  const Eigen::MatrixXd matrix = (Eigen::Matrix2d() << 0, 2, -5, 0).finished();
  EXPECT_LT((SingularValues(matrix) - Eigen::Vector2d(5, 2)).norm(), kRounding);
}

TEST(DenseTest, PseudoInverseGivesTheLeastNorm) {
  const Eigen::MatrixXd wide = Eigen::RowVector2d(3, 4);
  EXPECT_LT((PseudoInverse(wide) - Eigen::Vector2d(0.12, 0.16)).norm(), kRounding);
}

TEST(DenseTest, LuAndInverseSolveAnUnsymmetricMatrix) {
  const Eigen::MatrixXd matrix = (Eigen::Matrix2d() << 0, 2, -5, 1).finished(), one = Eigen::MatrixXd::Identity(2, 2);
  EXPECT_LT((matrix * Inverse(matrix) - one).norm(), kRounding);
  EXPECT_LT((SolveLu(matrix, one) - Inverse(matrix)).norm(), kRounding);
}

TEST(DenseTest, ExponentialOfATurningGeneratorIsTheTurn) {
  const double turn = 0.3;
  const Eigen::MatrixXd result = MatrixExponential((Eigen::Matrix2d() << 0, -turn, turn, 0).finished());
  EXPECT_LT((result - (Eigen::Matrix2d() << std::cos(turn), -std::sin(turn), std::sin(turn), std::cos(turn)).finished())
                .norm(),
            kRounding);
}

TEST(DenseTest, SizesThatDoNotFitThrow) {
  EXPECT_THROW(Ldlt(Eigen::MatrixXd::Zero(2, 3)), std::logic_error);
  EXPECT_THROW((void)Ldlt(kSymmetric).Solve(Eigen::VectorXd::Zero(3)), std::logic_error);
  EXPECT_THROW(SymmetricEigen(Eigen::MatrixXd::Zero(2, 3)), std::logic_error);
  EXPECT_THROW((void)MatrixExponential(Eigen::MatrixXd::Zero(2, 3)), std::logic_error);
}

}  // namespace
}  // namespace gapscope
