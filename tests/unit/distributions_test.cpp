// Distributions against tables: Abramowitz and Stegun, Handbook of Mathematical Functions, chapter 26.
#include "host/common/numbers/distributions.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexspline::numbers::distributions_test {
namespace {

TEST(Distributions, QuantilesAreThoseOfTheTables) {
  EXPECT_NEAR(normal_quantile(0.975), 1.95996, 1e-5);
  EXPECT_NEAR(chi_squared_quantile(1.0, 0.95), 3.84146, 1e-5);
  EXPECT_NEAR(chi_squared_quantile(10.0, 0.95), 18.3070, 1e-4);
  EXPECT_NEAR(student_t_quantile(4.0, 0.975), 2.77645, 1e-5);
}

TEST(Distributions, PValuesAreThoseOfTheTables) {
  EXPECT_NEAR(normal_up_to(1.0), 0.8413447, 1e-7);
  EXPECT_NEAR(chi_squared_above(2.0, 3.0), std::exp(-1.5), 1e-12);  // an exponential distribution
  EXPECT_NEAR(student_t_above(1.0, 1.0), 0.25, 1e-12);              // Cauchy's
  EXPECT_NEAR(fisher_f_above(5.0, 10.0, 3.3258), 0.05, 1e-5);
}

TEST(Distributions, OfTenTossesNineOrMoreAreHeadsElevenTimesIn1024) {
  EXPECT_NEAR(binomial_at_least(9, 10, 0.5), 11.0 / 1024.0, 1e-12);
  EXPECT_NEAR(binomial_at_least(0, 10, 0.5), 1.0, 1e-12);
}

}  // namespace
}  // namespace flexspline::numbers::distributions_test
