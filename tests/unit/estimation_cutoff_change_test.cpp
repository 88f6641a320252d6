// The bias of the filters in an interval.
#include "host/engine/estimation/cutoff_change.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

namespace flexspline::estimation {
namespace {

TEST(IntervalUnderBias, IsTheUsualOneWithoutBiasAndOneSidedWithALargeOne) {
  EXPECT_NEAR(half_width_under_bias(0.0), 1.959964, 1e-6);
  EXPECT_NEAR(half_width_under_bias(20.0), 20.0 + 1.644854, 1e-6);
}

TEST(IntervalUnderBias, HoldsNinetyFivePercentOfBiasedEstimates) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 40000;
  for (const double bias : {0.3, 1.0, 2.5}) {
    const double half = half_width_under_bias(bias);
    int inside = 0;
    for (int i = 0; i < kDraws; ++i) inside += std::abs(bias + normal(random)) <= half;
    EXPECT_NEAR(static_cast<double>(inside) / kDraws, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / kDraws)) << bias;
  }
}

}  // namespace
}  // namespace flexspline::estimation
