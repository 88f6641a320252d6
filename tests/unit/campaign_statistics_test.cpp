#include "tests/support/campaign_statistics.hpp"

#include <gtest/gtest.h>

#include <random>

namespace flexspline::tests::campaign_statistics_test {
namespace {

TEST(ExactInterval, OfNoneInThreeHundredEndsWhereThatHasAChanceOfOneInForty) {
  const Interval i = exact_interval(0, 300);
  EXPECT_EQ(i.low, 0.0);
  EXPECT_NEAR(std::pow(1.0 - i.high, 300.0), 0.025, 1e-12);
}

TEST(ExactInterval, OfFiveInTenIsThePublishedOne) {
  const Interval i = exact_interval(5, 10);
  EXPECT_NEAR(i.low, 0.1871, 1e-4);
  EXPECT_NEAR(i.high, 0.8129, 1e-4);
}

TEST(ExactInterval, OfAllIsTheMirrorOfNone) {
  EXPECT_NEAR(exact_interval(20, 20).low, 1.0 - exact_interval(0, 20).high, 1e-12);
  EXPECT_EQ(exact_interval(20, 20).high, 1.0);
}

TEST(ThresholdFrom, ExponentialScoresIsAboveTheirQuantileInMostSamplesAndNotFarAbove) {
  std::mt19937_64 random(1);
  std::exponential_distribution<double> score(0.5);
  const double quantile = 2.0 * std::log(1000.0);
  int above = 0;
  constexpr int kSamples = 200;
  for (int sample = 0; sample < kSamples; ++sample) {
    std::vector<double> scores;
    for (int k = 0; k < 400; ++k) scores.push_back(score(random));
    const double threshold = threshold_from(scores, 0.001);
    above += threshold > quantile ? 1 : 0;
    EXPECT_LT(threshold, 2.0 * quantile);
  }
  EXPECT_GT(above, static_cast<int>(0.9 * kSamples));
}

}  // namespace
}  // namespace flexspline::tests::campaign_statistics_test
