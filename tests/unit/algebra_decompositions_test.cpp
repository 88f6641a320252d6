// Decompositions against what defines them, also where there is nothing to factor.
#include "host/common/algebra/decompositions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace flexspline::algebra {
namespace {

TEST(PivotedQr, AMatrixWithoutColumnsHasAnEmptySolutionAndSpansNothing) {
  const PivotedQr qr(Eigen::MatrixXd(7, 0), 1e-5);
  EXPECT_EQ(qr.solve(Eigen::VectorXd::Ones(7)).rows(), 0);
  EXPECT_EQ(qr.span().rows(), 7);
  EXPECT_EQ(qr.span().cols(), 0);
  EXPECT_EQ(PivotedQr(Eigen::MatrixXd(0, 0)).solve(Eigen::VectorXd(0)).rows(), 0);
}

TEST(PivotedQr, AMatrixWithoutRowsHasASolutionOfZeros) {
  EXPECT_EQ(PivotedQr(Eigen::MatrixXd(0, 3)).solve(Eigen::VectorXd(0)), Eigen::VectorXd::Zero(3));
}

TEST(PivotedQr, SolvesAsTheNormalEquationsDo) {
  const Eigen::MatrixXd A{{1.0, 2.0}, {3.0, 5.0}, {-1.0, 4.0}};
  const Eigen::VectorXd b{{1.0, -2.0, 0.5}};
  const Eigen::VectorXd expected = (A.transpose() * A).inverse() * (A.transpose() * b);
  EXPECT_LT((PivotedQr(A).solve(b) - expected).norm(), 1e-12);
}

TEST(PivotedQr, ColumnsThatRepeatEachOtherSpanOneDirection) {
  const Eigen::MatrixXd A{{1.0, 2.0}, {3.0, 6.0}, {-1.0, -2.0}};
  const Eigen::MatrixXd span = PivotedQr(A, 1e-7).span();
  ASSERT_EQ(span.cols(), 1);
  EXPECT_LT((span * (span.transpose() * A) - A).norm(), 1e-12);
}

Matrix positive() {
  return Matrix{{4.0, 1.0, -0.5}, {1.0, 3.0, 0.25}, {-0.5, 0.25, 2.0}};
}

TEST(Decompositions, RFactorHasTheProductsOfTheMatrixAlsoWithFewerRowsThanColumns) {
  for (const Matrix& A : {Matrix{{1.0, 2.0}, {3.0, 5.0}, {-1.0, 4.0}}, Matrix{{1.0, -2.0, 3.0}}}) {
    const Matrix R = r_factor(A);
    EXPECT_EQ(R.rows(), A.cols());
    EXPECT_LT((R.transpose() * R - A.transpose() * A).norm(), 1e-12);
    EXPECT_TRUE(R.isUpperTriangular(0.0));
  }
}

TEST(Decompositions, SolutionsSatisfyTheirEquations) {
  const Matrix A = positive(), b{{1.0, 0.0}, {-2.0, 1.0}, {0.5, 3.0}};
  EXPECT_LT((A * solve_positive(A, b) - b).norm(), 1e-12);
  EXPECT_LT((A * inverse_of_positive(A) - Matrix::Identity(3, 3)).norm(), 1e-12);
  EXPECT_LT((A * inverse_of(A) - Matrix::Identity(3, 3)).norm(), 1e-12);
  EXPECT_LT((A * SymmetricFactor(A).solve(b) - b).norm(), 1e-12);
}

TEST(Decompositions, EigenpairsAndSingularValuesPutTheMatrixTogetherAgain) {
  const Matrix A = positive();
  const Eigenpairs of = eigenpairs(A);
  EXPECT_LT((of.vectors * of.values.asDiagonal() * of.vectors.transpose() - A).norm(), 1e-12);
  EXPECT_LT((eigenvalues(A) - of.values).norm(), 1e-12);
  EXPECT_LT(of.values[0], of.values[2]);
  const Matrix wide{{1.0, -2.0, 3.0}, {0.0, 1.0, 4.0}};
  const SingularValues svd = singular_values(wide);
  EXPECT_EQ(svd.v.cols(), 2);
  EXPECT_LT((svd.u * svd.s.asDiagonal() * svd.v.transpose() - wide).norm(), 1e-12);
  EXPECT_GT(svd.s[0], svd.s[1]);
}

TEST(Decompositions, OrthogonalMatrixBeginsWithTheColumnsOfTheOther) {
  const Matrix A{{1.0}, {2.0}, {-2.0}};
  const Matrix Q = orthogonal_of(A);
  ASSERT_EQ(Q.cols(), 3);
  EXPECT_LT((Q.transpose() * Q - Matrix::Identity(3, 3)).norm(), 1e-12);
  EXPECT_LT((Q.rightCols(2).transpose() * A).norm(), 1e-12);
}

}  // namespace
}  // namespace flexspline::algebra
