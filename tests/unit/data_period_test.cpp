// The period of a recorded motion, from the column that repeats best.
#include "host/input/data/period.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

namespace flexspline::data::data_period_test {
namespace {

constexpr std::size_t kSamples = 1000;

// `fade` of the samples rise linearly to the full amplitude.
std::vector<double> sine(double period, double fade = 0.0) {
  std::vector<double> x;
  for (std::size_t k = 0; k < kSamples; ++k) {
    const auto n = static_cast<double>(k);
    const double size = fade > 0.0 ? std::min(1.0, n / (fade * kSamples)) : 1.0;
    x.push_back(size * std::sin(2.0 * std::numbers::pi * n / period));
  }
  return x;
}

Experiment experiment() {
  Experiment e;
  e.sample_s = 1e-3;
  e.segments = {{0, kSamples}};
  return e;
}

TEST(PeriodOfAMotion, IsThatOfThePosition) {
  Experiment e = experiment();
  e[Column::motor_position] = sine(125.0);
  EXPECT_NEAR(period_samples(e).value_or(0.0), 125.0, 0.1);
}

TEST(PeriodOfAMotion, OfASetPointComesBeforeThatOfTheMotion) {
  Experiment e = experiment();
  e[Column::motor_position] = sine(50.0);
  e[Column::position_command] = sine(100.0);
  EXPECT_NEAR(period_samples(e).value_or(0.0), 100.0, 0.1);
}

TEST(PeriodOfAMotion, DoesNotNeedTheStartThatIsFadedIn) {
  Experiment e = experiment();
  e[Column::motor_position] = sine(100.0, 0.2);
  EXPECT_NEAR(period_samples(e).value_or(0.0), 100.0, 0.1);
}

TEST(PeriodOfAMotion, IsNoneWhereNothingRepeatsOrNothingIsThere) {
  Experiment e = experiment();
  EXPECT_FALSE(period_samples(e).has_value());
  std::vector<double> ramp;
  for (std::size_t k = 0; k < kSamples; ++k) ramp.push_back(static_cast<double>(k));
  e[Column::motor_position] = ramp;
  EXPECT_FALSE(period_samples(e).has_value());
  e.segments.clear();
  EXPECT_FALSE(period_samples(e).has_value());
}

}  // namespace
}  // namespace flexspline::data::data_period_test
