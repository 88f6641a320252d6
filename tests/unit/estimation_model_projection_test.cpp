// The part of a torque that a model cannot draw, against angles that are known.
#include "host/engine/estimation/model_projection.hpp"

#include <gtest/gtest.h>

#include <Eigen/Dense>
#include <cmath>
#include <random>

namespace flexspline::estimation::estimation_model_projection_test {
namespace {

using Eigen::MatrixXd;
using Eigen::VectorXd;

MatrixXd drawn(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return MatrixXd::Zero(rows, columns).unaryExpr([&](double) { return normal(random); });
}

TEST(ModelProjectionOf, LeavesTheSineOfTheAngleToTheColumns) {
  const VectorXd one = VectorXd::Unit(6, 0), two = VectorXd::Unit(6, 1), apart = VectorXd::Unit(6, 4);
  MatrixXd columns(6, 2);
  columns << 3.0 * one, 1e-6 * (one + two);
  const ModelProjection projection(columns, VectorXd::Ones(6));
  for (const double angle : {0.0, 0.1, 1.0, 1.5707963267948966}) {
    const VectorXd torque = std::cos(angle) * two + std::sin(angle) * apart;
    EXPECT_NEAR(projection.orthogonal_share(torque), std::sin(angle), 1e-12) << angle;
    EXPECT_LT((projection.orthogonal_part(torque) - std::sin(angle) * apart).norm(), 1e-12) << angle;
  }
  EXPECT_EQ(projection.orthogonal_share(VectorXd::Zero(6)), 0.0);
}

TEST(ModelProjectionOf, IsTheResidualOfWeightedLeastSquares) {
  const MatrixXd columns = drawn(40, 3, 1), torques = drawn(40, 2, 2);
  const VectorXd weights = drawn(40, 1, 3).cwiseAbs().array() + 0.1;
  const ModelProjection projection(columns, weights);
  const MatrixXd W = weights.asDiagonal();
  const MatrixXd theta = MatrixXd(W * columns).colPivHouseholderQr().solve(W * torques);
  EXPECT_LT((projection.orthogonal_part(torques) - (torques - columns * theta)).norm(), 1e-10);
}

TEST(ModelProjectionOf, ColumnsThatOthersExplainAddNothing) {
  MatrixXd columns = drawn(40, 3, 4), more(40, 4);
  more << columns, columns.col(0) - 2.0 * columns.col(2);
  const VectorXd torque = drawn(40, 1, 5), weights = VectorXd::Ones(40);
  EXPECT_NEAR(ModelProjection(columns, weights).orthogonal_share(torque),
              ModelProjection(more, weights).orthogonal_share(torque), 1e-9);
}

TEST(ModelProjectionOf, RowsWithoutWeightCountForNothing) {
  const MatrixXd columns = drawn(40, 2, 6);
  VectorXd weights = VectorXd::Ones(40), torque = drawn(40, 1, 7);
  weights.tail(10).setZero();
  const double share = ModelProjection(columns, weights).orthogonal_share(torque);
  torque.tail(10) *= 1e6;
  EXPECT_NEAR(ModelProjection(columns, weights).orthogonal_share(torque), share, 1e-12);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_model_projection_test
