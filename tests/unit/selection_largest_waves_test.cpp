// Which waves over the motor's angle halves of the data choose from: those that take most off what the model leaves in
// motion.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/regressor_table.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::selection_largest_waves_test {
namespace {

using data::Column;

constexpr double kMove_s = 1.0, kHold_s = 1.0, kFriction_nm = 0.05, kRipple_nm = 0.004;

// Moves of one second to drawn stops, and holds of one second, where the axis sticks under a drawn effort; a ripple
// once a turn.
data::Dataset moves_and_holds() {
  std::mt19937_64 random(5);
  std::uniform_real_distribution<double> part(-1.0, 1.0);
  std::normal_distribution<double> noise;
  std::vector<double> stops = {0.0}, held_nm;
  for (int k = 0; k < 13; ++k) {
    stops.push_back((k % 2 == 0 ? 60.0 : 0.0) + 10.0 * part(random));
    held_nm.push_back(0.9 * kFriction_nm * part(random));
  }
  data::Dataset dataset;
  dataset.experiments.push_back(tests::written_experiment("moves", 2e-3, 12000, [&](double t, data::Experiment& e) {
    const auto move = static_cast<std::size_t>(t / (kMove_s + kHold_s));
    const double x = std::min(1.0, (t - (kMove_s + kHold_s) * static_cast<double>(move)) / kMove_s);
    const double way = stops[move + 1] - stops[move];
    const double q = stops[move] + way * (x - std::sin(kTurn * x) / kTurn);
    const double w = way * (1.0 - std::cos(kTurn * x)) / kMove_s, a = way * kTurn * std::sin(kTurn * x);
    const double effort =
        x < 1.0 ? 1e-4 * a + 1e-3 * w + std::copysign(kFriction_nm, w) + kRipple_nm * std::cos(q) : held_nm[move];
    e[Column::motor_position].push_back(q);
    e[Column::motor_torque].push_back(effort + 2e-4 * noise(random));
  }));
  return dataset;
}

RegressorTable table_of(const data::Dataset& dataset, const SelectionPolicy& policy) {
  estimation::PipelineOptions unmasked;
  unmasked.cutoff_hz = 40.0;
  unmasked.mask = false;
  const auto found = estimation::identify(dataset, tests::plain_model(), unmasked);
  return make_regressor_table(found->prepared, Balance::motor, found->terms, std::nullopt, 40.0, policy);
}

TEST(LargestWaves, AreThoseOfTheMotionWhereTheAxisSticksUnderAnyEffort) {
  const RegressorTable table = table_of(moves_and_holds(), kPolicy);
  const auto is_once_a_turn = [](const CandidateTerm& t) { return t.name == "torque_ripple:1"; };
  EXPECT_TRUE(std::ranges::any_of(table.terms, is_once_a_turn));
  const auto is_left_out = [](const auto& wave) { return wave.first->name() == "torque_ripple" && wave.second == 1.0; };
  EXPECT_TRUE(std::ranges::none_of(table.smaller_waves, is_left_out));
  EXPECT_FALSE(table.smaller_waves.empty());
}

TEST(LargestWaves, OfAMotionThatIsNeverAboveItsNoiseAreAnyAndAllColumnsAreFinite) {
  SelectionPolicy policy = kPolicy;
  policy.visible_velocity = 1e12;
  const RegressorTable table = table_of(moves_and_holds(), policy);
  EXPECT_FALSE(table.smaller_waves.empty());
  EXPECT_TRUE(table.columns.allFinite());
}

}  // namespace
}  // namespace flexspline::selection::selection_largest_waves_test
