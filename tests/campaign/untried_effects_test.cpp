// What a log of torque cannot show, and how a user can let the diagnosis look at it.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/selection/diagnosis.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::untried_effects_test {
namespace {

using data::Column;

// An axis whose motor makes less torque than its current says, by the cube of the current; 20 A at most. Its log has
// the current times 0.05 N m/A. With the current itself: tests/campaign/strong_saturation_test.cpp.
Diagnosis diagnosis_of_torque() {
  constexpr double kNmPerA = 0.05;
  std::mt19937_64 random(9);
  std::normal_distribution<double> noise(0.0, 1e-3);
  const data::Dataset dataset =
      tests::written_dataset({0.3, 0.5, 0.8, 1.0}, 4e-3, 1500, [&](double hz, double t, data::Experiment& e) {
        const double rate = kTurn * hz, q = 30.0 * std::sin(rate * t), w = 30.0 * rate * std::cos(rate * t);
        const double torque = -8e-4 * rate * rate * q + 1e-3 * w + 0.05 * (w > 0.0 ? 1.0 : -1.0);
        const double linear_a = torque / kNmPerA, current = linear_a + 3e-4 * std::pow(linear_a, 3) + noise(random);
        e[Column::motor_position].push_back(q);
        e[Column::motor_torque].push_back(kNmPerA * current);
      });
  return diagnose(dataset, tests::plain_model(), {});
}

TEST(UntriedEffects, AreThoseOfTheCurrentWhereTheEffortIsATorqueAndMoreIsMissing) {
  const Diagnosis torque = diagnosis_of_torque();
  EXPECT_NE(torque.untried_advice.find("torque_constant_saturation"), std::string::npos);
  EXPECT_NE(torque.untried_advice.find("map it as current_a"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::selection::untried_effects_test
