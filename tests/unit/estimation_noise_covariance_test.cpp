// Errors that rows of a record have in common: against dense matrices.
#include "host/engine/estimation/noise_covariance.hpp"

#include <gtest/gtest.h>

#include <Eigen/Cholesky>
#include <Eigen/LU>

#include "host/engine/estimation/least_squares.hpp"
#include "host/engine/estimation/record_variance.hpp"

namespace flexspline::estimation::estimation_noise_covariance_test {
namespace {

// Two records of five and seven rows; the second varies along two directions, the first along one.
struct Errors {
  std::vector<RowRange> records = {{0, 0, 5}, {1, 5, 12}};
  Eigen::VectorXd root_weights = Eigen::VectorXd::LinSpaced(12, 0.5, 3.0);
  Eigen::MatrixXd first = Eigen::MatrixXd(5, 1), second = Eigen::MatrixXd(7, 2);
  Errors() {
    for (int k = 0; k < 5; ++k) first(k, 0) = 2.0 + k;
    for (int k = 0; k < 7; ++k) second.row(k) << 0.3 * k - 1.0, 4.0 - k * k;
  }
  NoiseCovariance error_covariance() const {
    NoiseCovariance w(root_weights);
    w.add_random_effects(records[0], first);
    w.add_random_effects(records[1], second);
    return w;
  }
  // I + B B', of the weighted rows.
  Eigen::MatrixXd covariance() const {
    Eigen::MatrixXd v = Eigen::MatrixXd::Identity(12, 12);
    v.topLeftCorner(5, 5) += first * first.transpose();
    v.bottomRightCorner(7, 7) += second * second.transpose();
    return v;
  }
};

Eigen::MatrixXd some_rows(Eigen::Index columns) {
  Eigen::MatrixXd X(12, columns);
  for (Eigen::Index i = 0; i < 12; ++i)
    for (Eigen::Index j = 0; j < columns; ++j) X(i, j) = std::sin(1.0 + static_cast<double>(i * (j + 2)));
  return X;
}

TEST(NoiseCovariance, MakesTheCovarianceOfTheErrorsTheIdentity) {
  const Errors e;
  const Eigen::MatrixXd unweighted =
      e.root_weights.cwiseInverse().asDiagonal() * e.covariance() * e.root_weights.cwiseInverse().asDiagonal();
  const Eigen::MatrixXd W = e.error_covariance().whiten(Eigen::MatrixXd::Identity(12, 12));
  EXPECT_LT((W * unweighted * W.transpose() - Eigen::MatrixXd::Identity(12, 12)).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(NoiseCovariance, ScoreColumnsAreTheInverseOfTheCovarianceTimesThem) {
  const Errors e;
  const Eigen::MatrixXd X = some_rows(3);
  const Eigen::MatrixXd expected = e.covariance().inverse() * e.root_weights.asDiagonal() * X;
  EXPECT_LT((e.error_covariance().score_columns(X) - expected).cwiseAbs().maxCoeff(), 1e-12);
}

TEST(NoiseCovariance, CountsWhiteRowsAsOftenAsTheyAreDrawn) {
  const Errors e;
  const Eigen::MatrixXd X = some_rows(2);
  Eigen::VectorXd counts = Eigen::VectorXd::Ones(12);
  counts[3] = 0.0;
  counts[7] = 2.0;
  const Eigen::MatrixXd once = e.error_covariance().whiten(X),
                        counted = e.error_covariance().with_counts(counts).whiten(X);
  EXPECT_LT((counted - counts.asDiagonal() * once).cwiseAbs().maxCoeff(), 1e-15);
}

TEST(GeneralisedLeastSquares, IsThatOfTheDenseCovariance) {
  const Errors e;
  const Eigen::MatrixXd X = some_rows(3);
  const Eigen::VectorXd y = some_rows(5).col(4);
  const Eigen::MatrixXd weighted = e.root_weights.asDiagonal() * X;
  const Eigen::MatrixXd inverse = e.covariance().inverse();
  const Eigen::MatrixXd normal = weighted.transpose() * inverse * weighted;
  const Eigen::VectorXd expected =
      normal.ldlt().solve(weighted.transpose() * inverse * (e.root_weights.asDiagonal() * y));
  const LinearFit fit = generalised_least_squares(X, y, e.error_covariance());
  EXPECT_LT((fit.theta - expected).norm(), 1e-10 * expected.norm());
  EXPECT_LT((fit.unit_covariance - normal.inverse()).norm(), 1e-9 * normal.inverse().norm());
  EXPECT_LT((fit.residual - (y - X * expected)).norm(), 1e-10);
}

TEST(FrictionGroups, KnowWhatDoesNotVaryWithTheFriction) {
  Term lugre = candidate_term(catalogue::get("lugre_friction"), {});
  const auto place = [&](std::string_view name) { return lugre.entry->index_of(name); };
  lugre.values[place("stiffness")] = 9.0;
  const Terms terms = {lugre};
  const std::vector<ParameterRef> nonlinear = {{0, place("static")}, {0, place("velocity")}, {0, place("stiffness")}};
  const std::vector<FrictionGroup> groups = friction_groups(terms, {{0, place("coulomb")}}, nonlinear);
  ASSERT_EQ(groups.size(), 1u);
  // Static friction is a share of the Coulomb friction, the velocity no torque; the contacts' stiffness stays.
  ASSERT_EQ(groups[0].ratio_parameters.size(), 1u);
  EXPECT_EQ(groups[0].ratio_parameters[0].nonlinear_ref, 2);
  EXPECT_EQ(groups[0].ratio_parameters[0].ratio, 9.0);
  EXPECT_TRUE(friction_groups(terms, {{0, place("coulomb")}})[0].ratio_parameters.empty());
}

}  // namespace
}  // namespace flexspline::estimation::estimation_noise_covariance_test
