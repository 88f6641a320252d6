// Decompositions against what defines them, also where there is nothing to factor.
#include "host/common/algebra/decompositions.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <complex>

namespace flexspline::algebra::algebra_decompositions_test {
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

TEST(HouseholderQr, SolvesAsTheNormalEquationsDoAndItsFactorHasTheProductsOfTheMatrix) {
  const Matrix A{{1.0, 2.0}, {3.0, 5.0}, {-1.0, 4.0}};
  const Vector b{{1.0, -2.0, 0.5}};
  const HouseholderQr qr(A);
  EXPECT_LT((qr.r().transpose() * qr.r() - A.transpose() * A).norm(), 1e-12);
  EXPECT_LT((A.transpose() * (A * qr.solve(b) - b)).norm(), 1e-12);
}

TEST(LeastNormSolver, OfColumnsThatAreOneAndTheSameSharesTheSolutionEqually) {
  const Matrix A{{1.0, 1.0}, {2.0, 2.0}, {-1.0, -1.0}};
  const LeastNormSolver solver(A, 1e-7);
  EXPECT_EQ(solver.rank(), 1);
  EXPECT_LT((solver.solve(Vector{{2.0, 4.0, -2.0}}) - Vector{{1.0, 1.0}}).norm(), 1e-12);
  EXPECT_LT((A * solver.pseudo_inverse() * A - A).norm(), 1e-12);  // Penrose's first condition
}

TEST(LeastNormSolver, OfOrthogonalColumnsThePivotsAreTheirLengths) {
  EXPECT_NEAR(LeastNormSolver(Matrix{{8.0, 0.0}, {0.0, 2.0}}).pivot_ratio(), 4.0, 1e-12);
}

TEST(FullPivotLu, TheHilbertMatrixOfThreeHasItsKnownInverseAndCondition) {
  const Matrix hilbert{{1.0, 1.0 / 2, 1.0 / 3}, {1.0 / 2, 1.0 / 3, 1.0 / 4}, {1.0 / 3, 1.0 / 4, 1.0 / 5}};
  const FullPivotLu lu(hilbert);
  EXPECT_LT((lu.inverse() - Matrix{{9.0, -36.0, 30.0}, {-36.0, 192.0, -180.0}, {30.0, -180.0, 180.0}}).norm(), 1e-9);
  EXPECT_LT((lu.solve(hilbert) - Matrix::Identity(3, 3)).norm(), 1e-12);
  EXPECT_NEAR(lu.reciprocal_condition(), 1.0 / 748.0, 1e-6);  // by sums of columns
}

TEST(ComplexEigenvalues, OfACompanionMatrixAreTheRootsOfItsPolynomial) {
  // s^3 - 3 s^2 + 4 s - 2 = (s - 1) (s^2 - 2 s + 2): 1, 1 + i, 1 - i.
  const Eigen::VectorXcd roots = complex_eigenvalues(Matrix{{0.0, 0.0, 2.0}, {1.0, 0.0, -4.0}, {0.0, 1.0, 3.0}});
  for (const std::complex<double> expected : {std::complex(1.0, 0.0), std::complex(1.0, 1.0), std::complex(1.0, -1.0)})
    EXPECT_LT((roots.array() - expected).abs().minCoeff(), 1e-12);
}

}  // namespace
}  // namespace flexspline::algebra::algebra_decompositions_test
