// The permutation test of laws that show between records: its share against all permutations, how often it finds a law,
// and how often one that is not there.
#include <gtest/gtest.h>

#include <Eigen/Core>
#include <algorithm>
#include <cmath>
#include <numeric>
#include <random>
#include <vector>

#include "host/engine/selection/meta_regression.hpp"
#include "tests/support/records_with_law.hpp"

namespace flexspline::selection::permutation_test {
namespace {

using Eigen::Index;
using Eigen::MatrixXd;
using tests::exact;
using tests::RecordsWithLaw;

TEST(PermutationTest, AgreesWithAllPermutationsOfSixRecords) {
  const RecordsWithLaw r(6, 0.4, 7);
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
    mean += permutation_p_value(exact(r.theta), {r.added}, {every_record(exact(r.theta))}, 20000, seed) / kSeeds;
  EXPECT_NEAR(mean, of_all, 4.0 * of_all / std::sqrt(20.0 * kSeeds) + of_all / 20.0);
}

TEST(PermutationTest, FindsALawAndSeldomOneThatIsNotThere) {
  int found = 0, wrong = 0;
  for (unsigned seed = 0; seed < 100; ++seed) {
    const RecordsWithLaw with(20, 0.8, seed), without(20, 0.0, 1000 + seed);
    found +=
        permutation_p_value(exact(with.theta), {with.added}, {every_record(exact(with.theta))}, 1000, seed) <= 0.01;
    wrong += permutation_p_value(exact(without.theta), {without.added}, {every_record(exact(without.theta))}, 1000,
                                 seed) <= 0.05;
  }
  EXPECT_GT(found, 90);
  EXPECT_LT(wrong, 11);  // 5 are expected; 11 and more in one of 90 runs
}

TEST(PermutationTest, CountsHowManyLawsAreTried) {
  // The best of many laws that have nothing to do with the records is no better than a permutation of them.
  int significant = 0;
  for (unsigned seed = 0; seed < 40; ++seed) {
    const RecordsWithLaw r(12, 0.0, 2000 + seed);
    std::mt19937_64 random(seed);
    std::normal_distribution<double> normal;
    std::vector<MatrixXd> laws;
    for (int k = 0; k < 20; ++k) laws.push_back(MatrixXd::NullaryExpr(12, 2, [&] { return normal(random); }));
    significant += permutation_p_value(exact(r.theta), laws, {every_record(exact(r.theta))}, 400, seed) <= 0.1;
  }
  EXPECT_LT(significant, 10);  // 4 are expected
}

TEST(PermutationTest, FindsALawThatHoldsForTheFasterRecordsOnly) {
  int found = 0, of_all = 0, wrong = 0;
  for (unsigned seed = 0; seed < 30; ++seed) {
    RecordsWithLaw with(40, 1.5, seed);
    const RecordsWithLaw without(40, 0.0, 1000 + seed);
    // The slow half has the friction of the fastest, which the law contradicts.
    with.theta.topRows(16) = without.theta.topRows(16);
    with.theta.topRows(16).rowwise() += 1.5 * with.added.row(39);
    std::vector<RecordSubset> parts;
    for (Index first = 0; first < 34; first += 4) {
      parts.push_back({{}, {0, 1}});
      for (Index i = first; i < 40; ++i) parts.back().records.push_back(i);
    }
    found += permutation_p_value(exact(with.theta), {with.added}, parts, 400, seed) <= 0.05;
    of_all +=
        permutation_p_value(exact(with.theta), {with.added}, {every_record(exact(with.theta))}, 400, seed) <= 0.05;
    wrong += permutation_p_value(exact(without.theta), {without.added}, parts, 400, seed) <= 0.05;
  }
  EXPECT_GT(found, 25);
  EXPECT_LT(of_all, 5);
  EXPECT_LT(wrong, 6);  // 1.5 are expected
}

}  // namespace
}  // namespace flexspline::selection::permutation_test
