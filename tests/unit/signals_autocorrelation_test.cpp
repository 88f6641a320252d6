#include "host/common/signals/autocorrelation.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <span>
#include <vector>

namespace flexspline::signals::signals_autocorrelation_test {
namespace {

std::vector<double> autoregressive(double a, std::size_t n, unsigned seed, double offset = 0.0) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  std::vector<double> x(n);
  double state = normal(random) / std::sqrt(1.0 - a * a);
  for (double& v : x) {
    v = state + offset;
    state = a * state + normal(random);
  }
  return x;
}

TEST(Autocorrelation, AgreesWithItsDefinition) {
  const auto x = autoregressive(0.6, 137, 1, 50.0);
  double mean = 0.0;
  for (const double v : x) mean += v / static_cast<double>(x.size());
  const auto product = [&](std::size_t lag) {
    double sum = 0.0;
    for (std::size_t i = 0; i + lag < x.size(); ++i) sum += (x[i] - mean) * (x[i + lag] - mean);
    return sum;
  };
  const auto rho = autocorrelation(x, 150);
  ASSERT_EQ(rho.size(), 151u);
  for (std::size_t k = 0; k < 137; ++k) EXPECT_NEAR(rho[k], product(k) / product(0), 1e-11) << k;
  for (std::size_t k = 137; k < 151; ++k) EXPECT_EQ(rho[k], 0.0);
}

TEST(Autocorrelation, OfAFirstOrderProcessFallsGeometrically) {
  const auto rho = autocorrelation(autoregressive(0.8, 200000, 2), 8);
  for (std::size_t k = 0; k < rho.size(); ++k) EXPECT_NEAR(rho[k], std::pow(0.8, static_cast<double>(k)), 0.015);
}

TEST(AutocorrelationTime, OfAFirstOrderProcessIsTheClosedForm) {
  for (const double a : {0.0, 0.5, 0.9, 0.98}) {
    const double expected = (1.0 + a) / (1.0 - a);
    EXPECT_NEAR(integrated_autocorrelation_time(autoregressive(a, 200000, 3), 20000), expected, 0.08 * expected) << a;
  }
}

TEST(AutocorrelationTime, IsNeverBelowOne) {
  EXPECT_EQ(integrated_autocorrelation_time(autoregressive(-0.7, 20000, 4), 1000), 1.0);
  EXPECT_EQ(integrated_autocorrelation_time(std::vector<double>(100, 0.1), 50), 1.0);
  EXPECT_EQ(integrated_autocorrelation_time(std::span<const double>{}, 50), 1.0);
  EXPECT_EQ(integrated_autocorrelation_time(std::vector<double>{1.0}, 50), 1.0);
}

TEST(AutocorrelationTime, ShortSegmentsTogetherTellWhatOneLongRecordTells) {
  // Each has a start of its own: nothing may be multiplied across their borders, and lags as long as a segment have
  // few pairs.
  std::vector<std::vector<double>> data;
  for (unsigned s = 0; s < 3000; ++s) data.push_back(autoregressive(0.9, 60, 100 + s));
  const std::vector<std::span<const double>> segments(data.begin(), data.end());
  EXPECT_NEAR(integrated_autocorrelation_time(segments, 59), 19.0, 1.5);
}

TEST(AutocorrelationTime, OffsetsBetweenSegmentsCountAsCorrelation) {
  const auto high = autoregressive(0.0, 5000, 5, 3.0), low = autoregressive(0.0, 5000, 6, -3.0);
  const std::vector<std::span<const double>> segments{high, low};
  EXPECT_GT(integrated_autocorrelation_time(segments, 100), 50.0);
}

}  // namespace
}  // namespace flexspline::signals::signals_autocorrelation_test
