// host/engine/estimation/pivoted_qr: also where there is nothing to factor.
#include "host/engine/estimation/pivoted_qr.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>

namespace flexspline::estimation {
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

}  // namespace
}  // namespace flexspline::estimation
