// Meta-regression over records against closed forms: ordinary least squares, the likelihood.
#include "host/engine/selection/meta_regression.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

#include "tests/support/records_with_law.hpp"

namespace flexspline::selection::selection_meta_regression_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using tests::exact;
using tests::RecordsWithLaw;

double deviance(const MatrixXd& theta, const MatrixXd& added, double coefficient) {
  double sum = 0.0;
  for (Index j = 0; j < theta.cols(); ++j) {
    Eigen::VectorXd left = theta.col(j) - coefficient * added.col(j);
    left.array() -= left.mean();
    sum += static_cast<double>(theta.rows()) * std::log(left.squaredNorm() / static_cast<double>(theta.rows()));
  }
  return sum;
}

TEST(MetaRegression, OfOneParameterIsALeastSquaresLine) {
  MatrixXd theta(5, 1), added(5, 1);
  added << 1, 2, 3, 4, 5;
  theta << 2.1, 2.9, 4.2, 4.8, 6.0;  // slope 0.97, intercept 1.09, squares 9.5 before and 0.091 after
  const MetaRegression fit = meta_regression(exact(theta), added);
  EXPECT_NEAR(fit.coefficient, 0.97, 1e-12);
  EXPECT_NEAR(fit.mean[0], 1.09, 1e-12);
  EXPECT_NEAR(fit.likelihood_ratio, 5.0 * std::log(9.5 / 0.091), 1e-9);
  EXPECT_NEAR(fit.explained_share, 1.0 - 0.091 / 9.5, 1e-12);
}

TEST(MetaRegression, HasStudentsTOfALeastSquaresLine) {
  MatrixXd theta(5, 1), added(5, 1);
  added << 1, 2, 3, 4, 5;
  theta << 2.1, 2.9, 4.2, 4.8, 6.0;
  const MetaRegression fit = meta_regression(exact(theta), added);
  EXPECT_EQ(fit.freedom, 3.0);
  EXPECT_NEAR(fit.t, 0.97 / std::sqrt(0.091 / 3.0 / 10.0), 1e-6);
}

TEST(MetaRegression, TIsNoLargerThanTheErrorsOfTheRecordsAllow) {
  MatrixXd theta(5, 1), added(5, 1);
  added << 1, 2, 3, 4, 5;
  theta << 2.1, 2.9, 4.2, 4.8, 6.0;
  const RecordParameters records{theta, MatrixXd::Constant(5, 1, 4.0)};
  EXPECT_NEAR(meta_regression(records, added).t, 0.97 / std::sqrt(4.0 / 10.0), 1e-6);
}

TEST(MetaRegression, OfTwoParametersHasTheGreatestLikelihood) {
  const RecordsWithLaw r(20, 1.5, 3);
  const MetaRegression fit = meta_regression(exact(r.theta), r.added);
  EXPECT_NEAR(fit.coefficient, 1.5, 4.0 * fit.coefficient_std);
  const double best = deviance(r.theta, r.added, fit.coefficient);
  EXPECT_LT(best, deviance(r.theta, r.added, fit.coefficient + 1e-3));
  EXPECT_LT(best, deviance(r.theta, r.added, fit.coefficient - 1e-3));
  EXPECT_NEAR(fit.likelihood_ratio, deviance(r.theta, r.added, 0.0) - best, 1e-9);
}

TEST(MetaRegression, WeighsARecordByItsOwnErrorAndWhatDiffersBetweenThem) {
  const RecordsWithLaw r(15, 1.0, 11);
  RecordParameters records = exact(r.theta);
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  for (Index i = 0; i < 15; ++i) {
    const double large = i % 3 == 0 ? 1.0 : 0.01;
    records.variance.row(i) << 0.04 * large, 1.0 * large;
    for (Index j = 0; j < 2; ++j) records.theta(i, j) += std::sqrt(records.variance(i, j)) * normal(random);
  }
  const MetaRegression fit = meta_regression(records, r.added);
  // Minus twice the log-likelihood, written out and least over the variances between records on a grid.
  const auto deviance_of = [&](double coefficient) {
    double sum = 0.0;
    for (Index j = 0; j < 2; ++j) {
      double least = 1e300;
      for (double t = 1e-6; t < 10.0; t *= 1.002) {
        const Eigen::ArrayXd v = records.variance.col(j).array() + t;
        const Eigen::ArrayXd y = records.theta.col(j) - coefficient * r.added.col(j);
        const double mean = (y / v).sum() / v.inverse().sum();
        least = std::min(least, (v.log() + (y - mean).square() / v).sum());
      }
      sum += least;
    }
    return sum;
  };
  const double best = deviance_of(fit.coefficient);
  EXPECT_LE(best, deviance_of(fit.coefficient + 0.02));
  EXPECT_LE(best, deviance_of(fit.coefficient - 0.02));
  EXPECT_NEAR(fit.likelihood_ratio, deviance_of(0.0) - best, 1e-2);
  EXPECT_NEAR(fit.coefficient, 1.0, 4.0 * fit.coefficient_std);
}

TEST(MetaRegression, CountsARecordWithWhatItIdentifies) {
  const RecordsWithLaw r(18, 1.2, 21);
  RecordParameters records = exact(r.theta);
  const double unknown = std::numeric_limits<double>::infinity();
  for (const Index i : {0, 1, 2, 3, 16}) records.variance(i, 0) = unknown;
  for (const Index i : {5, 9}) records.variance(i, 1) = unknown;
  const MetaRegression fit = meta_regression(records, r.added);
  // The values that are not known count nothing,
  for (const Index i : {0, 1, 2, 3, 16}) records.theta(i, 0) = 1e3;
  for (const Index i : {5, 9}) records.theta(i, 1) = -1e3;
  EXPECT_NEAR(meta_regression(records, r.added).coefficient, fit.coefficient, 1e-9);
  // and what is known has its greatest likelihood.
  const auto deviance_of = [&](double coefficient) {
    double sum = 0.0;
    for (Index j = 0; j < 2; ++j) {
      std::vector<double> left;
      for (Index i = 0; i < 18; ++i)
        if (std::isfinite(records.variance(i, j))) left.push_back(r.theta(i, j) - coefficient * r.added(i, j));
      const auto n = static_cast<double>(left.size());
      const double mean = std::accumulate(left.begin(), left.end(), 0.0) / n;
      double squares = 0.0;
      for (const double x : left) squares += (x - mean) * (x - mean);
      sum += n * std::log(squares / n);
    }
    return sum;
  };
  const double best = deviance_of(fit.coefficient);
  EXPECT_LT(best, deviance_of(fit.coefficient + 1e-3));
  EXPECT_LT(best, deviance_of(fit.coefficient - 1e-3));
  EXPECT_NEAR(fit.likelihood_ratio, deviance_of(0.0) - best, 1e-9);
}

TEST(MetaRegression, IsPossibleOnlyWithTheSignOfFriction) {
  MetaRegression fit;
  fit.mean = Eigen::Vector2d(1.0, 0.5);
  fit.coefficient = 1.0;
  EXPECT_TRUE(is_possible(fit));
  fit.coefficient = -1.0;
  EXPECT_FALSE(is_possible(fit));
  fit.coefficient = 1.0;
  fit.mean[1] = -0.1;
  EXPECT_FALSE(is_possible(fit));
}

TEST(MetaRegression, OfAnEffectThatIsAlikeInAllRecordsExplainsNothing) {
  RecordsWithLaw r(8, 0.0, 5);
  r.added.setConstant(2.0);
  const MetaRegression fit = meta_regression(exact(r.theta), r.added);
  EXPECT_NEAR(fit.likelihood_ratio, 0.0, 1e-9);
  EXPECT_FALSE(is_possible(fit));
}

TEST(MetaRegression, OfRecordsThatDoNotDifferExplainsNothing) {
  MatrixXd theta = MatrixXd::Constant(6, 1, 0.3), added(6, 1);
  added << 1, 2, 3, 4, 5, 6;
  RecordParameters records = exact(theta);
  records.variance.setConstant(1e-4);
  EXPECT_EQ(meta_regression(records, added).explained_share, 0.0);
}

// RecordsWithLaw of a slow and of a fast kind, which do not identify the same parameters.
RecordParameters two_kinds(const RecordsWithLaw& r, Index slow) {
  RecordParameters records = exact(r.theta);
  records.variance.topLeftCorner(slow, 1).setConstant(std::numeric_limits<double>::infinity());
  return records;
}

TEST(PermutationTest, OfRecordsThatIdentifyDifferentParametersIsSeldomWrong) {
  int wrong = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    // The slow kind has other friction, for a reason that is no law of speed; within a kind there is none.
    RecordsWithLaw r(24, 0.0, 3000 + seed);
    r.theta.topRows(10).col(1).array() += 2.0;
    const RecordParameters records = two_kinds(r, 10);
    wrong += permutation_p_value(records, {r.added}, {every_record(records)}, 400, seed) <= 0.05;
  }
  EXPECT_LT(wrong, 11);  // 5 are expected
}

TEST(PermutationTest, IsOneWhereNoLawIsPossible) {
  const RecordsWithLaw r(10, 1.0, 9);
  EXPECT_EQ(permutation_p_value(exact(r.theta), {MatrixXd(-r.added)}, {every_record(exact(r.theta))}, 100, 1), 1.0);
}

}  // namespace
}  // namespace flexspline::selection::selection_meta_regression_test
