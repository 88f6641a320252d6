#include "host/engine/estimation/strokes.hpp"
#include "shared/fixed/turn.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numeric>
#include <random>

namespace flexspline::estimation::estimation_strokes_test {
namespace {

using data::Column;

// Whole periods of a sine of the motor's angle, from one end to the other, with noise on the angle.
Record swinging(double amplitude_rad, double frequency_hz, double noise_rad) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  data::Experiment e;
  e.name = "swinging";
  e.sample_s = 1e-3;
  e.current_hold = data::CurrentHold::none;
  for (std::size_t k = 0; k < 8000; ++k) {
    const double t = 1e-3 * static_cast<double>(k);
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(-amplitude_rad * std::cos(kTurn * frequency_hz * t) +
                                        noise_rad * noise(random));
    e[Column::motor_torque].push_back(0.1 * std::sin(kTurn * frequency_hz * t));
  }
  e.segments = {{0, e.size()}};
  return prepare({&e}, {}, {40.0, true}).records.front();
}

TEST(Strokes, OfASineAreTwiceItsAmplitudeWithTheFirstAndTheLastCounted) {
  const std::vector<double> all = strokes(swinging(2.0, 0.5, 0.0));
  ASSERT_EQ(all.size(), 8u);
  for (const double stroke : all) EXPECT_NEAR(stroke, 4.0, 0.01);
}

TEST(Strokes, OfANoisyRecordAddUpToItsTravelAndTheirQuantileByTravelIsTheMotionsStroke) {
  const std::vector<double> all = strokes(swinging(2.0, 0.5, 2e-3));
  EXPECT_NEAR(std::accumulate(all.begin(), all.end(), 0.0), 32.0, 0.5);
  EXPECT_NEAR(stroke_quantile(all, 0.1), 4.0, 0.05);
  EXPECT_NEAR(stroke_quantile(all, 0.5), 4.0, 0.05);
}

TEST(Strokes, QuantileCountsTravelAndNotStrokes) {
  const std::vector<double> all = {0.01, 3.0, 0.01, 0.02, 1.0, 0.01, 6.0};  // 10.05 in sum
  EXPECT_EQ(stroke_quantile(all, 0.0), 0.01);
  EXPECT_EQ(stroke_quantile(all, 0.1), 1.0);
  EXPECT_EQ(stroke_quantile(all, 0.39), 3.0);
  EXPECT_EQ(stroke_quantile(all, 0.5), 6.0);
  EXPECT_EQ(stroke_quantile({}, 0.5), 0.0);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_strokes_test
