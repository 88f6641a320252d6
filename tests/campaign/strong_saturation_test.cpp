// A saturation of the torque constant that takes a quarter of the torque: its values are those of the measured current.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <random>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::strong_saturation_test {
namespace {

using data::Column;

constexpr double kTorqueConstant = 0.05, kPerA2 = 0.25 / (15.0 * 15.0);

// The current with k (i - c i^3) = torque, by Newton's method.
double current_for(double torque) {
  double current = torque / kTorqueConstant;
  for (int round = 0; round < 20; ++round)
    current -= (kTorqueConstant * (current - kPerA2 * std::pow(current, 3)) - torque) /
               (kTorqueConstant * (1.0 - 3.0 * kPerA2 * current * current));
  return current;
}

data::Dataset saturating_axis() {
  std::mt19937_64 random(5);
  std::normal_distribution<double> noise(0.0, 0.02);
  data::Dataset dataset;
  for (const double hz : {0.4, 0.6, 0.75})
    dataset.experiments.push_back(
        tests::written_experiment("axis-" + std::to_string(hz), 5e-3, 3000, [&](double t, data::Experiment& e) {
          const double rate = 2.0 * std::numbers::pi * hz, w = 30.0 * rate * std::cos(rate * t);
          e[Column::motor_position].push_back(30.0 * std::sin(rate * t));
          e[Column::current].push_back(
              current_for(-7e-4 * 30.0 * rate * rate * std::sin(rate * t) + 1e-3 * w + std::copysign(0.05, w)) +
              noise(random));
        }));
  return dataset;
}

TEST(StrongSaturation, OfTheTorqueConstantIsTheLikeliestEffectAndHasItsCoefficient) {
  model::Model model = tests::plain_model();
  model.drive.torque_constant_nm_a.value = kTorqueConstant;
  const Diagnosis diagnosis = diagnose(saturating_axis(), model, {});
  ASSERT_FALSE(diagnosis.candidates.empty());
  const Candidate& first = diagnosis.candidates.front();
  EXPECT_EQ(first.effect, "torque_constant_saturation");
  ASSERT_EQ(diagnosis.named.size(), 1U);
  EXPECT_EQ(diagnosis.named.front().effect, "torque_constant_saturation");
  EXPECT_TRUE(diagnosis.untried_advice.empty()) << "the current is measured";
  ASSERT_FALSE(first.parameters.empty());
  EXPECT_NEAR(first.parameters.front().value, kPerA2, 0.05 * kPerA2);
}

}  // namespace
}  // namespace flexspline::selection::strong_saturation_test
