#include "host/common/signals/interpolate.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <limits>
#include <numbers>
#include <stdexcept>
#include <vector>

namespace flexspline::signals::signals_interpolate_test {
namespace {

double cubic(double t) {
  return 2.0 - 0.3 * t + 0.05 * t * t - 0.004 * t * t * t;
}

template <typename F>
std::vector<double> sampled(F f, std::size_t n, double step = 1.0) {
  std::vector<double> x(n);
  for (std::size_t i = 0; i < n; ++i) x[i] = f(static_cast<double>(i) * step);
  return x;
}

TEST(FractionalDelay, CubicIsShiftedExactly) {
  const auto x = sampled(cubic, 40);
  for (const double d : {0.5, 0.25, 3.7, -0.5, -2.1}) {
    const auto y = fractional_delay(x, d);
    for (std::size_t i = 0; i < x.size(); ++i) {
      const double t = static_cast<double>(i) - d;
      if (t >= 0.0 && t <= 39.0) {
        EXPECT_NEAR(y[i], cubic(t), 1e-10) << d << " at " << i;
      } else {
        EXPECT_EQ(y[i], t < 0.0 ? x.front() : x.back()) << d << " at " << i;
      }
    }
  }
}

TEST(FractionalDelay, WholeDelayCopiesTheSamples) {
  const std::vector<double> x{1.0, 4.0, -2.0, 7.0, 0.5};
  EXPECT_EQ(fractional_delay(x, 2.0), (std::vector<double>{1.0, 1.0, 1.0, 4.0, -2.0}));
  EXPECT_EQ(fractional_delay(x, -1.0), (std::vector<double>{4.0, -2.0, 7.0, 0.5, 0.5}));
  EXPECT_EQ(fractional_delay(x, 0.0), x);
  EXPECT_EQ(fractional_delay(x, 1e30), std::vector<double>(5, 1.0));
}

TEST(FractionalDelay, SineIsDelayedToTheStatedAccuracy) {
  const double w = 2.0 * std::numbers::pi * 0.1;
  const auto x = sampled([w](double t) { return std::sin(w * t); }, 400);
  const auto y = fractional_delay(x, 0.5);
  double worst = 0.0;
  for (std::size_t i = 10; i < 390; ++i) {
    const double wanted = std::sin(w * (static_cast<double>(i) - 0.5));
    worst = std::max(worst, std::abs(y[i] - wanted));
  }
  EXPECT_NEAR(worst, 1.0 - (9.0 * std::cos(w / 2.0) - std::cos(1.5 * w)) / 8.0, 3e-4);
  EXPECT_LT(worst, 0.004);
}

TEST(FractionalDelay, ShortSignalsAndBadDelaysAreHandled) {
  EXPECT_TRUE(fractional_delay({}, 0.5).empty());
  EXPECT_EQ(fractional_delay(std::vector<double>{3.0}, 0.5), std::vector<double>{3.0});
  EXPECT_EQ(fractional_delay(std::vector<double>{3.0, 5.0}, 0.5), (std::vector<double>{3.0, 4.0}));
  EXPECT_THROW(fractional_delay(std::vector<double>{3.0}, std::numeric_limits<double>::infinity()),
               std::invalid_argument);
}

TEST(Resample, LineIsExactOnUnevenTimes) {
  const std::vector<double> t{0.0, 0.1, 0.35, 0.4, 1.0}, at{0.05, 0.2, 0.39, 0.9};
  std::vector<double> x;
  for (const double v : t) x.push_back(3.0 - 2.0 * v);
  for (const auto method : {Interpolation::kLinear, Interpolation::kMonotoneCubic}) {
    const auto y = resample_uniform(t, x, at, method);
    for (std::size_t i = 0; i < at.size(); ++i) EXPECT_NEAR(y[i], 3.0 - 2.0 * at[i], 1e-14);
  }
}

TEST(Resample, GivenTimesReturnTheGivenValuesAndTheEndsAreHeld) {
  const std::vector<double> t{0.0, 1.0, 2.5, 3.0, 4.0}, x{1.0, 5.0, 2.0, 2.0, -1.0};
  for (const auto method : {Interpolation::kLinear, Interpolation::kMonotoneCubic}) {
    const auto y = resample_uniform(t, x, t, method);
    for (std::size_t i = 0; i < t.size(); ++i) EXPECT_NEAR(y[i], x[i], 1e-14);
    EXPECT_EQ(resample_uniform(t, x, std::vector<double>{-1.0, 9.0}, method), (std::vector<double>{1.0, -1.0}));
  }
}

TEST(Resample, CubicConvergesFasterThanLinear) {
  const auto f = [](double v) { return std::exp(v); };
  const auto t = sampled([](double v) { return v; }, 101, 0.02), x = sampled(f, 101, 0.02);
  const auto at = sampled([](double v) { return 0.1 + v; }, 170, 0.01);
  const auto worst = [&](Interpolation method) {
    const auto y = resample_uniform(t, x, at, method);
    double error = 0.0;
    for (std::size_t i = 0; i < at.size(); ++i) error = std::max(error, std::abs(y[i] - f(at[i])));
    return error;
  };
  EXPECT_LT(worst(Interpolation::kLinear), 0.02 * 0.02 / 8.0 * f(2.0));
  EXPECT_LT(worst(Interpolation::kMonotoneCubic), 0.1 * worst(Interpolation::kLinear));
}

TEST(Resample, CubicStaysBetweenItsNeighbours) {
  const std::vector<double> t{0.0, 1.0, 2.0, 3.0, 4.0, 5.0}, x{0.0, 0.0, 0.0, 1.0, 1.0, 1.0};
  const auto at = sampled([](double v) { return v; }, 501, 0.01);
  for (const double v : resample_uniform(t, x, at)) {
    EXPECT_GE(v, -1e-12);
    EXPECT_LE(v, 1.0 + 1e-12);
  }
}

TEST(Resample, TimesThatDoNotIncreaseAreRefused) {
  const std::vector<double> x{1.0, 2.0, 3.0};
  EXPECT_THROW(resample_uniform(std::vector<double>{0.0, 1.0, 1.0}, x, x), std::invalid_argument);
  EXPECT_THROW(resample_uniform(std::vector<double>{0.0, 1.0}, x, x), std::invalid_argument);
  EXPECT_THROW(resample_uniform({}, {}, x), std::invalid_argument);
}

}  // namespace
}  // namespace flexspline::signals::signals_interpolate_test
