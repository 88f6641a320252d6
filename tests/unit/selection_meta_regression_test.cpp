// Meta-regression over records against closed forms: ordinary least squares, enumerated permutations, the likelihood.
#include "host/engine/selection/meta_regression.hpp"

#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <limits>
#include <numeric>
#include <random>
#include <vector>

namespace flexspline::selection::selection_meta_regression_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;

// Parameters without errors of their own.
RecordParameters exact(const MatrixXd& theta) {
  return {theta, MatrixXd::Zero(theta.rows(), theta.cols())};
}

struct Records {
  MatrixXd theta, added;
  Records(Index records, double coefficient, unsigned seed) : theta(records, 2), added(records, 2) {
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    for (Index i = 0; i < records; ++i) {
      const double speed = 1.0 + 0.1 * static_cast<double>(i);
      added.row(i) << 0.5 / std::sqrt(speed), std::sqrt(speed);
      theta.row(i) << 2.0 + coefficient * added(i, 0) + 0.05 * normal(random),
          7.0 + coefficient * added(i, 1) + 0.3 * normal(random);
    }
  }
};

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
  const Records r(20, 1.5, 3);
  const MetaRegression fit = meta_regression(exact(r.theta), r.added);
  EXPECT_NEAR(fit.coefficient, 1.5, 4.0 * fit.coefficient_std);
  const double best = deviance(r.theta, r.added, fit.coefficient);
  EXPECT_LT(best, deviance(r.theta, r.added, fit.coefficient + 1e-3));
  EXPECT_LT(best, deviance(r.theta, r.added, fit.coefficient - 1e-3));
  EXPECT_NEAR(fit.likelihood_ratio, deviance(r.theta, r.added, 0.0) - best, 1e-9);
}

TEST(MetaRegression, WeighsARecordByItsOwnErrorAndWhatDiffersBetweenThem) {
  const Records r(15, 1.0, 11);
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
  const Records r(18, 1.2, 21);
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
  Records r(8, 0.0, 5);
  r.added.setConstant(2.0);
  const MetaRegression fit = meta_regression(exact(r.theta), r.added);
  EXPECT_NEAR(fit.likelihood_ratio, 0.0, 1e-9);
  EXPECT_FALSE(is_possible(fit));
}

TEST(PermutationTest, AgreesWithAllPermutationsOfSixRecords) {
  const Records r(6, 0.4, 7);
  const auto ratio = [&](const MatrixXd& added) {
    const MetaRegression fit = meta_regression(exact(r.theta), added);
    return is_possible(fit) ? fit.likelihood_ratio : 0.0;
  };
  const double recorded = ratio(r.added);
  ASSERT_GT(recorded, 0.0);
  std::vector<Index> order(6);
  std::iota(order.begin(), order.end(), Index{0});
  int reached = 0, all = 0;
  do {
    reached += ratio(r.added(order, Eigen::all)) >= recorded;
    ++all;
  } while (std::next_permutation(order.begin(), order.end()));
  const double of_all = static_cast<double>(reached) / all;
  // Drawing ends after twenty permutations that reach it, so the share is known to one over the root of twenty.
  double mean = 0.0;
  constexpr int kSeeds = 40;
  for (unsigned seed = 0; seed < kSeeds; ++seed)
    mean += permutation_p_value(exact(r.theta), {r.added}, {whole_of(exact(r.theta))}, 20000, seed) / kSeeds;
  EXPECT_NEAR(mean, of_all, 4.0 * of_all / std::sqrt(20.0 * kSeeds) + of_all / 20.0);
}

TEST(PermutationTest, FindsALawAndSeldomOneThatIsNotThere) {
  int found = 0, wrong = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const Records with(20, 0.8, seed), without(20, 0.0, 1000 + seed);
    found += permutation_p_value(exact(with.theta), {with.added}, {whole_of(exact(with.theta))}, 1000, seed) <= 0.01;
    wrong += permutation_p_value(exact(without.theta), {without.added}, {whole_of(exact(without.theta))}, 1000, seed) <=
             0.05;
  }
  EXPECT_GT(found, 90);
  EXPECT_LT(wrong, 11);  // 5 are expected; 11 and more in one of 90 runs
}

TEST(PermutationTest, CountsHowManyLawsAreTried) {
  // The best of many laws that have nothing to do with the records is no better than a permutation of them.
  int significant = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const Records r(12, 0.0, 2000 + seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::vector<MatrixXd> laws;
    for (int k = 0; k < 20; ++k) laws.push_back(MatrixXd::NullaryExpr(12, 2, [&] { return normal(random); }));
    significant += permutation_p_value(exact(r.theta), laws, {whole_of(exact(r.theta))}, 400, seed) <= 0.1;
  }
  EXPECT_LT(significant, 10);  // 4 are expected
}

// Records of a slow and of a fast kind, which do not identify the same parameters.
RecordParameters two_kinds(const Records& r, Index slow) {
  RecordParameters records = exact(r.theta);
  records.variance.topLeftCorner(slow, 1).setConstant(std::numeric_limits<double>::infinity());
  return records;
}

TEST(PermutationTest, OfRecordsThatIdentifyDifferentParametersIsSeldomWrong) {
  int wrong = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    // The slow kind has other friction, for a reason that is no law of speed; within a kind there is none.
    Records r(24, 0.0, 3000 + seed);
    r.theta.topRows(10).col(1).array() += 2.0;
    const RecordParameters records = two_kinds(r, 10);
    wrong += permutation_p_value(records, {r.added}, {whole_of(records)}, 400, seed) <= 0.05;
  }
  EXPECT_LT(wrong, 11);  // 5 are expected
}

TEST(PermutationTest, FindsALawThatHoldsForTheFasterRecordsOnly) {
  int found = 0, of_all = 0, wrong = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    Records with(40, 1.5, seed);
    const Records without(40, 0.0, 1000 + seed);
    // The slow half has the friction of the fastest, which the law contradicts.
    with.theta.topRows(16) = without.theta.topRows(16);
    with.theta.topRows(16).rowwise() += 1.5 * with.added.row(39);
    std::vector<Part> parts;
    for (Index first = 0; first < 34; first += 4) {
      parts.push_back({{}, {0, 1}});
      for (Index i = first; i < 40; ++i) parts.back().records.push_back(i);
    }
    found += permutation_p_value(exact(with.theta), {with.added}, parts, 400, seed) <= 0.05;
    of_all += permutation_p_value(exact(with.theta), {with.added}, {whole_of(exact(with.theta))}, 400, seed) <= 0.05;
    wrong += permutation_p_value(exact(without.theta), {without.added}, parts, 400, seed) <= 0.05;
  }
  EXPECT_GT(found, 25);
  EXPECT_LT(of_all, 5);
  EXPECT_LT(wrong, 6);  // 1.5 are expected
}

TEST(PermutationTest, IsOneWhereNoLawIsPossible) {
  const Records r(10, 1.0, 9);
  EXPECT_EQ(permutation_p_value(exact(r.theta), {MatrixXd(-r.added)}, {whole_of(exact(r.theta))}, 100, 1), 1.0);
}

}  // namespace
}  // namespace flexspline::selection::selection_meta_regression_test
