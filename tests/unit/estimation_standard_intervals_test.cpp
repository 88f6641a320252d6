// Intervals of estimates with a bias, and the bias by noise of what columns are made of.
#include "host/engine/estimation/standard_intervals.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/estimation/estimate.hpp"
#include "host/engine/estimation/regressor_noise.hpp"
#include "tests/unit/estimation_intervals_that_hold.hpp"

namespace flexspline::estimation::estimation_standard_intervals_test {
namespace {

using data::Column;

TEST(IntervalUnderBias, IsTheUsualOneWithoutBiasAndOneSidedWithALargeOne) {
  EXPECT_NEAR(half_width_under_bias(0.0), 1.959964, 1e-6);
  EXPECT_NEAR(half_width_under_bias(20.0), 20.0 + 1.644854, 1e-6);
}

TEST(IntervalUnderBias, HoldsNinetyFivePercentOfBiasedEstimates) {
  std::mt19937_64 random(1);
  std::normal_distribution<double> normal;
  constexpr int kDraws = 40000;
  for (const double bias : {0.3, 1.0, 2.5}) {
    const double std = 0.2;
    int inside = 0;
    for (int i = 0; i < kDraws; ++i) {
      const Interval interval = interval_95(7.0 + std * (bias + normal(random)), std, std * bias);
      inside += interval.low <= 7.0 && 7.0 <= interval.high;
    }
    EXPECT_NEAR(static_cast<double>(inside) / kDraws, 0.95, 4.0 * std::sqrt(0.95 * 0.05 / kDraws)) << bias;
  }
}

TEST(ExtrapolatedBias, IsThatOfAPowerOfTheVarianceFromOneHalfToOne) {
  for (const double power : {0.5, 0.7, 1.0})
    EXPECT_NEAR(extrapolated_bias(0.3 * (std::pow(2.0, power) - 1.0), 0.3 * (std::pow(4.0, power) - 1.0)), 0.3, 1e-9);
  // What grows faster, or changes its sign, is chance: the nearest power of these.
  EXPECT_NEAR(extrapolated_bias(0.1, 0.9), 0.3, 1e-9);
  EXPECT_NEAR(extrapolated_bias(-0.1, 0.2), 0.2, 1e-9);
  EXPECT_EQ(extrapolated_bias(0.0, 0.0), 0.0);
}

// A spring between a motor and a locked output, behind a gear of 100: the torque is exact, the position noisy.
constexpr double kStiffness = 5000.0, kGear = 100.0, kTorsion = 1e-3, kSample = 1e-3, kCutoff = 60.0;

data::Dataset noisy_spring(double position_noise, std::uint64_t seed) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  data::Dataset dataset;
  data::Experiment& e = dataset.experiments.emplace_back();
  e.name = "locked";
  e.load = data::Load::locked;
  e.current_hold = data::CurrentHold::none;
  e.sample_s = kSample;
  for (std::size_t k = 0; k < 20000; ++k) {
    const double t = static_cast<double>(k) * kSample;
    const double torsion = kTorsion * std::sin(2.0 * std::numbers::pi * 1.3 * t);
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(kGear * (torsion + position_noise * normal(random)));
    e[Column::torque].push_back(kStiffness * torsion + 1e-3 * normal(random));
    e[Column::motor_torque].push_back(kStiffness * torsion / kGear);
  }
  e.segments = {{0, e.time_s.size()}};
  e.masked.assign(e.time_s.size(), 0);
  return dataset;
}

model::Model spring() {
  model::Model model;
  model.drive.gear_ratio.value = kGear;
  model.effects.push_back(catalogue::blank_effect(catalogue::get("linear_stiffness"), data::Axis::rotary));
  return model;
}

// The position is filtered before it is differentiated and as a column: both leave so much of its noise's variance N,
// by which least squares attenuates the stiffness, by N/(S + N).
TEST(RegressorNoise, FindsTheAttenuationOfAStiffnessByNoiseOfThePosition) {
  constexpr double kNoise = 4e-4;
  constexpr int kSteps = 5000, kSeeds = 6;
  const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder, kCutoff, 1.0 / kSample);
  double kept = 0.0;
  for (int i = 0; i < kSteps; ++i)
    kept += kNoise * kNoise * std::pow(filter.gain((i + 0.5) / kSteps * 0.5 / kSample), 4) / kSteps;
  const double signal = 0.5 * kTorsion * kTorsion, bias = -kStiffness * kept / (signal + kept);
  double error = 0.0, found_bias = 0.0;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const data::Dataset dataset = noisy_spring(kNoise, seed);
    const auto found = identify(dataset, spring(), {kCutoff, false});
    error += (found->estimates.front().value - kStiffness) / kSeeds;
    found_bias += regressor_noise(*found).front().bias[0] / kSeeds;
  }
  EXPECT_NEAR(error, bias, 0.2 * std::abs(bias));
  EXPECT_NEAR(found_bias, bias, 0.2 * std::abs(bias));
}

TEST(RegressorNoise, LetsTheIntervalOfTheAttenuatedStiffnessHoldItsTruth) {
  const IntervalsThatHold held = intervals_that_hold([](std::uint64_t seed) { return noisy_spring(4e-4, seed); },
                                                     spring(), {kCutoff, false}, kStiffness, [](const auto&) {});
  EXPECT_EQ(held.before, 0);
  EXPECT_GE(held.after, 9);
}

// A model file has one number for an error, and its readers make an interval of it.
TEST(StoredStd, GivesTheIntervalThatWasFoundWithItsBiases) {
  const data::Dataset dataset = noisy_spring(4e-4, 1);
  const auto found = estimate(dataset, spring(), {kCutoff, false}, {});
  const Estimate& stiffness = found->estimates.front();
  ASSERT_TRUE(stiffness.std && stiffness.low && stiffness.high);
  ASSERT_GT(*stiffness.high - *stiffness.low, 1.2 * 2.0 * 1.96 * *stiffness.std) << "the case needs a bias";
  const model::Parameter& stored = found->model.effects.front().parameters.front();
  const Interval again = interval_95(*stored.value, *stored.std);
  EXPECT_NEAR(again.low, *stiffness.low, 1e-6 * kStiffness);
  EXPECT_NEAR(again.high, *stiffness.high, 1e-6 * kStiffness);
}

TEST(RegressorNoise, IsNothingWhereThePositionIsExact) {
  const data::Dataset dataset = noisy_spring(0.0, 1);
  const auto found = identify(dataset, spring(), {kCutoff, false});
  const RegressorNoise noise = regressor_noise(*found).front();
  EXPECT_LT(std::abs(noise.bias[0]), 1e-6 * kStiffness);
  EXPECT_LT(std::sqrt(noise.chance(0, 0)), 1e-4 * kStiffness);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_standard_intervals_test
