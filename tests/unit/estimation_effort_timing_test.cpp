// A lag of the effort: against a motion in closed form, whose torque is computed at the time before.
#include "host/engine/estimation/effort_timing.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "tests/unit/estimation_intervals_that_hold.hpp"

namespace flexspline::estimation::estimation_effort_timing_test {
namespace {

using data::Column;

constexpr double kSample = 1e-3, kInertia = 1e-4, kViscous = 4e-3;

// J a + b v of a velocity of three sines, as it was `lag_s` before.
data::Dataset late_torque(double lag_s, std::uint64_t seed, data::CurrentHold hold = data::CurrentHold::none) {
  std::mt19937_64 random(seed);
  std::normal_distribution<double> normal;
  data::Dataset dataset;
  data::Experiment& e = dataset.experiments.emplace_back();
  e.name = "three sines";
  e.load = data::Load::free;
  e.current_hold = hold;
  e.sample_s = kSample;
  const auto sum = [](double t, auto wave) {
    double value = 0.0;
    for (const double hz : {0.7, 2.3, 5.1}) value += wave(2.0 * std::numbers::pi * hz, 2.0 * std::numbers::pi * hz * t);
    return value;
  };
  for (std::size_t k = 0; k < 20000; ++k) {
    const double t = static_cast<double>(k) * kSample, before = t - lag_s;
    e.time_s.push_back(t);
    e[Column::motor_position].push_back(sum(t, [](double w, double p) { return -20.0 / w * std::cos(p); }));
    e[Column::motor_torque].push_back(
        kInertia * sum(before, [](double w, double p) { return 20.0 * w * std::cos(p); }) +
        kViscous * sum(before, [](double, double p) { return 20.0 * std::sin(p); }) + 3e-3 * normal(random));
  }
  e.segments = {{0, e.time_s.size()}};
  e.masked.assign(e.time_s.size(), 0);
  return dataset;
}

model::Model rigid_drive() {
  model::Model model;
  for (const char* name : {"inertia", "viscous_friction"})
    model.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return model;
}

const PipelineOptions kOptions{40.0, false};

// b v(t - d) is b v - b d a: the inertia is short by b d.
TEST(EffortLag, FindsTheLagAndTheInertiaThatItTakes) {
  for (const double lag_s : {0.0021, -0.0008}) {
    const data::Dataset dataset = late_torque(lag_s, 1);
    const auto found = identify(dataset, rigid_drive(), kOptions);
    const auto lag = effort_lag(*found);
    ASSERT_TRUE(lag);
    EXPECT_TRUE(lag->is_certain());
    EXPECT_NEAR(lag->lag_s, lag_s, 4.0 * lag->std_s + 0.01 * std::abs(lag_s));
    EXPECT_NEAR(found->estimates.front().value, kInertia - kViscous * lag_s, 0.05 * kViscous * std::abs(lag_s));
    EXPECT_NEAR(lag->change.front()[0], kViscous * lag_s, 0.1 * kViscous * std::abs(lag_s));
  }
}

TEST(EffortLag, LetsTheIntervalOfTheInertiaHoldItsTruthAndSaysSo) {
  const auto says_so = [](const Identification& found) {
    ASSERT_FALSE(found.warnings.empty());
    EXPECT_NE(found.warnings.back().find(" ms later than the motion"), std::string::npos) << found.warnings.back();
    EXPECT_EQ(found.warnings.back().find("current_hold"), std::string::npos) << found.warnings.back();
  };
  const IntervalsThatHold held = intervals_that_hold([](std::uint64_t seed) { return late_torque(0.002, seed); },
                                                     rigid_drive(), kOptions, kInertia, says_so);
  EXPECT_EQ(held.before, 0);
  EXPECT_GE(held.after, 9);
}

TEST(EffortLag, OfHalfASampleIsSaidToBeThatOfAMeasuredEffortThatIsTakenForHeld) {
  const data::Dataset dataset = late_torque(0.0, 1, data::CurrentHold::zoh);
  const auto found = identify(dataset, rigid_drive(), kOptions);
  count_biases(*found, dataset, rigid_drive(), kOptions);
  ASSERT_FALSE(found->warnings.empty());
  EXPECT_NE(found->warnings.back().find("state current_hold = none"), std::string::npos) << found->warnings.back();
}

TEST(EffortLag, WidensNoIntervalByMuchAndSaysNothingWhereThereIsNone) {
  double wider = 0.0;
  constexpr int kSeeds = 10;
  for (std::uint64_t seed = 1; seed <= kSeeds; ++seed) {
    const data::Dataset dataset = late_torque(0.0, seed);
    const auto found = identify(dataset, rigid_drive(), kOptions);
    const auto lag = effort_lag(*found);
    ASSERT_TRUE(lag);
    EXPECT_LT(std::abs(lag->lag_s), 4.0 * lag->std_s);
    wider += std::abs(lag->change.front()[0]) / *found->estimates.front().std / kSeeds;
    EXPECT_TRUE(found->warnings.empty());
  }
  EXPECT_LT(wider, 1.0);
}

}  // namespace
}  // namespace flexspline::estimation::estimation_effort_timing_test
