// Halves of the data choose a law whatever the value of its nonlinear parameter: the values that they have to choose
// from are near enough to each other.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/resampling.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::grid_of_halves_test {
namespace {

using data::Column;

// An axis with a Gaussian Stribeck law of that velocity, rad/s, that stands still between its strokes.
data::Dataset axis(double velocity) {
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, 5e-4);
  return tests::written_dataset({80.0, 40.0, 10.0, 3.0}, 4e-3, 5000, [&](double speed, double t, data::Experiment& e) {
    // Slow at the ends of each stroke: the integral is that of the third power of a sine.
    const double x = 1.7 * t, c = std::cos(x), y = std::sin(x);
    const double w = speed * y * y * y;
    const double q = speed / 1.7 * (c * c * c / 3.0 - c);
    const double acceleration = 5.1 * speed * y * y * c;
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(1e-4 * acceleration + 1e-3 * w +
                                      std::copysign(0.05 + 0.02 * std::exp(-std::pow(w / velocity, 2)), w) +
                                      noise(random));
  });
}

class GridOfHalves : public ::testing::TestWithParam<double> {};

TEST_P(GridOfHalves, HasAValueNearThatOfTheLaw) {
  const data::Dataset dataset = axis(GetParam());
  const model::Model model = tests::plain_model();
  const auto fitted = estimation::identify(dataset, model, {});
  std::vector<const data::Experiment*> experiments;
  for (const data::Experiment& e : dataset.experiments) experiments.push_back(&e);
  const Resampling result = resample(experiments, model.drive, fitted->terms);
  ASSERT_FALSE(result.found.empty());
  ASSERT_FALSE(result.found.front().group.empty()) << result.found.front().name;
  EXPECT_EQ(result.found.front().group.front().effect.substr(0, 8), "stribeck");
  EXPECT_GT(result.found.front().share_percent, 85.0);
}

INSTANTIATE_TEST_SUITE_P(Velocities, GridOfHalves, ::testing::Values(1.0, 2.0, 3.0, 4.5, 7.0, 10.0));

}  // namespace
}  // namespace flexspline::selection::grid_of_halves_test
