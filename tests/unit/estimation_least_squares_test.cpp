#include "host/engine/estimation/least_squares.hpp"

#include <gtest/gtest.h>

#include <Eigen/LU>
#include <cmath>
#include <filesystem>
#include <fstream>
#include <limits>
#include <nlohmann/json.hpp>
#include <random>

namespace flexspline::estimation::estimation_least_squares_test {
namespace {

using Exact = Eigen::Matrix<long double, Eigen::Dynamic, Eigen::Dynamic>;
using ExactVector = Eigen::Matrix<long double, Eigen::Dynamic, 1>;

Eigen::MatrixXd random_matrix(Eigen::Index rows, Eigen::Index columns, unsigned seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  return Eigen::MatrixXd::NullaryExpr(rows, columns, [&] { return normal(random); });
}

Eigen::VectorXd ones(Eigen::Index rows) {
  return Eigen::VectorXd::Ones(rows);
}

TEST(LeastSquares, AgreesWithTheNormalEquationsInExtendedPrecision) {
  Eigen::MatrixXd X = random_matrix(200, 5, 1);
  X.col(3) = 0.9 * X.col(0) + 0.1 * X.col(3);  // related columns, and ones of very different size
  X.col(1) *= 1e3;
  X.col(4) *= 1e-2;
  const Eigen::VectorXd y = random_matrix(200, 1, 2);
  const Eigen::VectorXd root_weights = random_matrix(200, 1, 3).cwiseAbs();
  const LinearFit fit = least_squares(X, y, root_weights);

  const Exact A = root_weights.cast<long double>().asDiagonal() * X.cast<long double>();
  const ExactVector b = root_weights.cast<long double>().cwiseProduct(y.cast<long double>());
  const Exact covariance = Exact(A.transpose() * A).partialPivLu().inverse();
  const ExactVector theta = covariance * (A.transpose() * b);
  for (Eigen::Index j = 0; j < 5; ++j) {
    EXPECT_NEAR(fit.theta[j] / static_cast<double>(theta[j]), 1.0, 1e-10) << j;
    for (Eigen::Index i = 0; i < 5; ++i)
      EXPECT_NEAR(fit.unit_covariance(i, j), static_cast<double>(covariance(i, j)),
                  1e-10 * std::sqrt(fit.unit_covariance(i, i) * fit.unit_covariance(j, j)));
    // What the other columns leave of this one, over its length.
    Exact others(200, 4);
    for (Eigen::Index k = 0, at = 0; k < 5; ++k)
      if (k != j) others.col(at++) = A.col(k);
    const ExactVector shadow =
        others * Exact(others.transpose() * others).partialPivLu().solve(others.transpose() * A.col(j));
    EXPECT_NEAR(fit.root_tolerance[j], static_cast<double>((A.col(j) - shadow).norm() / A.col(j).norm()), 1e-10) << j;
  }
  EXPECT_LT((fit.residual - (y - X * theta.cast<double>())).norm(), 1e-9);
}

TEST(LeastSquares, CountsARowOfDoubleWeightAsTwoRows) {
  const Eigen::MatrixXd X = random_matrix(12, 3, 4);
  const Eigen::VectorXd y = random_matrix(12, 1, 5);
  Eigen::VectorXd root_weights = ones(12);
  root_weights[5] = std::sqrt(2.0);
  root_weights[7] = 0.0;
  Eigen::MatrixXd repeated(12, 3);
  Eigen::VectorXd repeated_y(12);
  for (Eigen::Index k = 0; k < 12; ++k) {
    const Eigen::Index from = k == 7 ? 5 : k;
    repeated.row(k) = X.row(from);
    repeated_y[k] = y[from];
  }
  const LinearFit weighted = least_squares(X, y, root_weights);
  const LinearFit twice = least_squares(repeated, repeated_y, ones(12));
  EXPECT_LT((weighted.theta - twice.theta).norm(), 1e-12);
  EXPECT_LT((weighted.unit_covariance - twice.unit_covariance).norm(), 1e-12);
  EXPECT_NEAR(weighted.residual[7], y[7] - X.row(7).dot(twice.theta), 1e-12) << "the residual itself has no weight";
}

TEST(LeastSquares, LeavesAColumnOfZerosAtZeroAndFitsTheRestAsWithoutIt) {
  Eigen::MatrixXd X = random_matrix(40, 4, 6);
  X.col(1).setZero();
  const Eigen::VectorXd y = random_matrix(40, 1, 7);
  Eigen::MatrixXd rest(40, 3);
  rest << X.col(0), X.col(2), X.col(3);
  const LinearFit fit = least_squares(X, y, ones(40));
  const LinearFit without = least_squares(rest, y, ones(40));
  EXPECT_EQ(fit.theta[1], 0.0);
  EXPECT_EQ(fit.root_tolerance[1], 0.0);
  EXPECT_TRUE(std::isinf(fit.unit_covariance(1, 1)));
  EXPECT_NEAR(fit.theta[0], without.theta[0], 1e-13);
  EXPECT_NEAR(fit.theta[2], without.theta[1], 1e-13);
  EXPECT_NEAR(fit.unit_covariance(3, 3), without.unit_covariance(2, 2), 1e-13);
}

TEST(LeastSquares, KeepsTheFirstOfTwoColumnsThatCannotBeDistinguished) {
  Eigen::MatrixXd X = random_matrix(60, 4, 8);
  // Column 2 is column 0 but for a share below what counts as determined, and 50 times as long.
  X.col(2) = 50.0 * (X.col(0) + 1e-4 * X.col(2));
  const Eigen::VectorXd y = 3.0 * X.col(0) - 2.0 * X.col(1) + 0.5 * X.col(3);
  const LinearFit fit = least_squares(X, y, ones(60));
  EXPECT_NEAR(fit.theta[0], 3.0, 1e-12);
  EXPECT_NEAR(fit.theta[1], -2.0, 1e-12);
  EXPECT_EQ(fit.theta[2], 0.0);
  EXPECT_NEAR(fit.theta[3], 0.5, 1e-12);
  EXPECT_LT(fit.root_tolerance[2], kUndetermined);
  EXPECT_GT(fit.root_tolerance[0], kUndetermined) << "alone, it is determined";
  EXPECT_TRUE(std::isinf(fit.unit_covariance(2, 2)));
  EXPECT_TRUE(std::isfinite(fit.unit_covariance(0, 0)));
}

// The tolerance of the last of several nearly collinear columns may be above the limit when another one's is below.
TEST(LeastSquares, ADroppedColumnIsNotDeterminedWhateverItsOwnTolerance) {
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(60, 3);
  X.col(0).head(20).setOnes();
  X.col(1) = X.col(0);
  X.col(1).segment(20, 20).setConstant(0.8 * kUndetermined);
  X.col(2) = 0.5 * (X.col(0) + X.col(1));
  X.col(2).tail(20).setConstant(0.6 * kUndetermined);
  const LinearFit fit = least_squares(X, X.col(0), ones(60));
  for (Eigen::Index j = 0; j < 3; ++j)
    EXPECT_EQ(std::isfinite(fit.unit_covariance(j, j)), fit.root_tolerance[j] >= kUndetermined) << j;
}

TEST(LeastSquares, DropsASumThatStandsBehindItsParts) {
  Eigen::MatrixXd X = random_matrix(60, 3, 9);
  X.col(2) = X.col(0) + X.col(1);
  const LinearFit fit = least_squares(X, X.col(0) - 4.0 * X.col(1), ones(60));
  EXPECT_NEAR(fit.theta[0], 1.0, 1e-12);
  EXPECT_NEAR(fit.theta[1], -4.0, 1e-12);
  EXPECT_EQ(fit.theta[2], 0.0);
  EXPECT_LT(fit.residual.norm(), 1e-11);
}

TEST(LeastSquares, DeterminesAColumnWhoseToleranceIsSmallButAboveTheLimit) {
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(50, 2);
  X.col(0).head(25).setOnes();
  X.col(1) = X.col(0);
  X.col(1).tail(25).setConstant(2.0 * kUndetermined);
  const LinearFit fit = least_squares(X, X * Eigen::Vector2d(1.0, 7.0), ones(50));
  EXPECT_NEAR(fit.theta[1], 7.0, 1e-9);
  EXPECT_NEAR(fit.root_tolerance[1], 2.0 * kUndetermined, 1e-8);
}

TEST(LeastSquares, ConditionNumberIsThatOfColumnsOfLikeLength) {
  Eigen::MatrixXd X = Eigen::MatrixXd::Zero(4, 2);
  X(0, 0) = 1e8;
  X(1, 1) = 1e-8;
  EXPECT_NEAR(least_squares(X, ones(4), ones(4)).condition_number, 1.0, 1e-12);
  // Two directions at 60 degrees: sqrt((1 + cos) / (1 - cos)) = sqrt(3).
  X(0, 1) = 1e-8 / std::sqrt(3.0);
  EXPECT_NEAR(least_squares(X, ones(4), ones(4)).condition_number, std::sqrt(3.0), 1e-12);
}

TEST(LeastSquares, DeterminesNothingFromFewerRowsThanColumns) {
  const Eigen::VectorXd y = ones(2);
  const LinearFit fit = least_squares(random_matrix(2, 3, 10), y, ones(2));
  EXPECT_EQ(fit.theta.norm(), 0.0);
  EXPECT_EQ(fit.residual, y);
  for (Eigen::Index j = 0; j < 3; ++j) EXPECT_TRUE(std::isinf(fit.unit_covariance(j, j)));
}

TEST(NeweyWest, GivesTheCovarianceOfStatsmodels) {
  std::ifstream file(std::filesystem::path(FLEXSPLINE_SOURCE_DIR) / "tests/unit/fixtures/statistics.json");
  const nlohmann::json statistics = nlohmann::json::parse(file);
  const nlohmann::json& problem = statistics["problem"];
  const auto rows = static_cast<Eigen::Index>(problem["y"].size());
  Eigen::MatrixXd X(rows, 3), expected(3, 3);
  Eigen::VectorXd y(rows);
  for (Eigen::Index k = 0; k < rows; ++k) {
    y[k] = problem["y"][static_cast<std::size_t>(k)];
    for (Eigen::Index j = 0; j < 3; ++j)
      X(k, j) = problem["x"][static_cast<std::size_t>(k)][static_cast<std::size_t>(j)];
  }
  for (std::size_t i = 0; i < 3; ++i)
    for (std::size_t j = 0; j < 3; ++j)
      expected(static_cast<Eigen::Index>(i), static_cast<Eigen::Index>(j)) =
          statistics["newey_west"]["covariance"][i][j];
  const LinearFit fit = least_squares(X, y, ones(rows));
  const Eigen::Index lags = statistics["newey_west"]["lags"];
  const Eigen::MatrixXd middle = newey_west({{0, 0, rows}}, X, fit.residual, lags);
  const Eigen::MatrixXd covariance = fit.unit_covariance * middle * fit.unit_covariance;
  EXPECT_LT((covariance - expected).norm(), 1e-9 * expected.norm());
  for (std::size_t j = 0; j < 3; ++j)
    EXPECT_NEAR(fit.theta[static_cast<Eigen::Index>(j)], statistics["ols"]["params"][j].get<double>(), 1e-10);
}

TEST(RecordWeights, AreOneOverTheNoiseOfEachRecordAndBoundedForASilentOne) {
  Eigen::VectorXd residual(12);
  residual << 2, -2, 2, -2, 0.5, 0.5, -0.5, 0.5, 0, 0, 0, 0;
  const Eigen::VectorXd weights = root_record_weights({{0, 0, 4}, {1, 4, 8}, {2, 8, 12}}, residual);
  for (Eigen::Index k = 0; k < 4; ++k) {
    EXPECT_DOUBLE_EQ(weights[k], 0.5);
    EXPECT_DOUBLE_EQ(weights[4 + k], 2.0);
    EXPECT_DOUBLE_EQ(weights[8 + k], 20.0) << "ten times the median one";
  }
}

TEST(RecordWeights, AreAllAlikeWhereThereIsNoNoise) {
  EXPECT_EQ(root_record_weights({{0, 0, 3}, {1, 3, 6}}, Eigen::VectorXd::Zero(6)), ones(6));
}

TEST(AutocorrelationTimeOfRecords, IsThatOfAFirstOrderProcessAndOneForWhiteNoise) {
  constexpr double kFactor = 0.8;
  std::mt19937_64 random(11);
  std::normal_distribution<double> normal;
  Eigen::VectorXd white(20000), coloured(20000);
  double state = 0.0;
  for (Eigen::Index k = 0; k < white.size(); ++k) {
    white[k] = normal(random);
    coloured[k] = state = kFactor * state + normal(random);
  }
  const std::vector<RowRange> records{{0, 0, 10000}, {1, 10000, 20000}};
  EXPECT_NEAR(autocorrelation_time(records, white), 1.0, 0.1);
  EXPECT_NEAR(autocorrelation_time(records, coloured), (1.0 + kFactor) / (1.0 - kFactor), 1.5);
  EXPECT_EQ(autocorrelation_time({}, white), 1.0);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_least_squares_test
