// Quantiles against numbers that are sorted by hand.
#include "host/common/numbers/quantile.hpp"

#include <gtest/gtest.h>

namespace flexspline::numbers::numbers_quantile_test {
namespace {

TEST(Quantile, IsTheNumberAtItsPlaceAmongTheSortedOnes) {
  const std::vector<double> x = {5.0, -1.0, 3.0, 2.0, 9.0};  // -1, 2, 3, 5, 9
  EXPECT_EQ(quantile(x, 0.0), -1.0);
  EXPECT_EQ(quantile(x, 0.25), 2.0);
  EXPECT_EQ(quantile(x, 0.49), 2.0);
  EXPECT_EQ(quantile(x, 0.5), 3.0);
  EXPECT_EQ(quantile(x, 1.0), 9.0);
}

TEST(Quantile, OfOneNumberIsThatNumberAndOfNoneIsZero) {
  EXPECT_EQ(quantile({4.0}, 0.9), 4.0);
  EXPECT_EQ(quantile({}, 0.5), 0.0);
}

TEST(UpperMedian, OfAnEvenCountIsTheUpperOneOfTheMiddlePair) {
  EXPECT_EQ(upper_median({7.0, 1.0, 3.0}), 3.0);
  EXPECT_EQ(upper_median({4.0, 1.0, 3.0, 2.0}), 3.0);
  EXPECT_EQ(upper_median({}), 0.0);
}

}  // namespace
}  // namespace flexspline::numbers::numbers_quantile_test
