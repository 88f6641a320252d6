// Friction that varies over the turn of the output behind a gear: torques that are written down, along strokes of an
// output turn and more.
#include <gtest/gtest.h>

#include <fmt/format.h>

#include <cmath>
#include <functional>
#include <numbers>
#include <random>
#include <string>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::friction_over_output_turn_test {
namespace {

using data::Column;

constexpr double kRatio = 50.0;
constexpr double kTurn = 2.0 * std::numbers::pi;

// What an axis that swings over `turns` of its output is said to lack, when `dry(output angle, t)` is what its dry
// friction has besides a constant, N m.
std::string named(double turns, std::uint64_t seed, const std::function<double(double, double)>& dry) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> noise(0.0, 1.0);
  const data::Dataset dataset =
      tests::written_dataset({0.2, 0.3, 0.5}, 8e-3, 7500, [&](double rate, double t, data::Experiment& e) {
        const double amplitude = 0.5 * turns * kTurn * kRatio, q = amplitude * std::sin(rate * t),
                     w = amplitude * rate * std::cos(rate * t);
        e[Column::motor_position].push_back(q);
        e[Column::motor_torque].push_back(-1e-4 * rate * rate * q + 3e-4 * w +
                                          (0.02 + dry(q / kRatio, t)) * (w > 0.0 ? 1.0 : -1.0) + 1e-3 * noise(random));
      });
  model::Model model = tests::plain_model();
  model.drive.gear_ratio.value = kRatio;
  const Diagnosis d = diagnose(dataset, model, {});
  std::string names;
  for (const NamedEffect& n : d.named)
    names += fmt::format("{}{}{}", names.empty() ? "" : " ", n.effect, n.order ? fmt::format(":{:g}", *n.order) : "");
  return names;
}

TEST(FrictionOverOutputTurn, IsNamedWithItsOrder) {
  EXPECT_EQ(named(1.5, 8, [](double q, double) { return 0.003 * std::cos(q - 0.5); }), "angle_dependent_friction:0.02");
  EXPECT_EQ(named(2.2, 1, [](double q, double) { return 0.003 * std::cos(q - 0.5); }), "angle_dependent_friction:0.02");
  EXPECT_EQ(named(2.2, 2, [](double q, double) { return 0.003 * std::cos(2.0 * q + 1.0); }),
            "angle_dependent_friction:0.04");
}

TEST(FrictionOverOutputTurn, IsNotNamedInAStrokeThatHoldsHardlyMoreThanATurn) {
  EXPECT_EQ(named(1.2, 3, [](double q, double) { return 0.003 * std::cos(q - 0.5); }), "");
}

TEST(FrictionOverOutputTurn, IsNotNamedForFrictionThatDependsOnSomethingElse) {
  EXPECT_EQ(named(2.2, 4, [](double, double) { return 0.0; }), "");
  EXPECT_EQ(named(2.2, 5, [](double, double t) { return 0.003 * std::cos(0.37 * t); }), "") << "on time";
  EXPECT_EQ(named(2.2, 6, [](double q, double) { return 0.003 * std::cos(1.4 * q); }), "") << "on no whole order";
  EXPECT_EQ(named(2.2, 7, [](double q, double) { return 0.0005 * q; }), "") << "on the travel, steadily";
}

}  // namespace
}  // namespace flexspline::selection::friction_over_output_turn_test
