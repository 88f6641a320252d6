// Torque readings with a held effort: against two rigid inertias, whose motion from sample to sample has a closed
// form.
#include "host/engine/estimation/zero_order_hold.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "host/engine/estimation/identify.hpp"
#include "host/physics/catalogue/constants.hpp"

namespace flexspline::estimation_zero_order_hold_test {
namespace {

using data::Column;

constexpr double kSample = 1e-3;
constexpr double kRatio = 100.0, kTorqueConstant = 0.05;
constexpr double kMotorInertia = 1e-4, kMotorViscous = 4e-4;
constexpr double kOutputInertia = 0.08, kOutputViscous = 0.5;

enum class Reading { before_the_step, mean_of_both_sides };

// While the current i is held, J v' = Km i - c v with all inertia and friction at the motor: v goes exponentially to
// Km i / c. The gear carries Jo a/N + co v/N.
data::Experiment recorded(const std::string& name, double slow_hz, double fast_hz, Reading reading) {
  constexpr double inertia = kMotorInertia + kOutputInertia / (kRatio * kRatio);
  constexpr double viscous = kMotorViscous + kOutputViscous / (kRatio * kRatio);
  constexpr double rate = viscous / inertia;
  data::Experiment e;
  e.name = name;
  e.role = data::Role::fit;
  e.load = data::Load::free;
  e.current_hold = data::CurrentHold::zoh;
  e.sample_s = kSample;
  double position = 0.0, velocity = 0.0, before = 0.0;
  for (int k = 0; k < 8000; ++k) {
    const double t = kSample * k;
    const double current = 1.2 * std::sin(2.0 * M_PI * slow_hz * t) + 0.8 * std::sin(2.0 * M_PI * fast_hz * t);
    const double last = kTorqueConstant * current / viscous;  // where the velocity goes
    const double after = rate * (last - velocity);
    const double acceleration = reading == Reading::before_the_step ? before : 0.5 * (before + after);
    e.time_s.push_back(t);
    e[Column::current].push_back(current);
    e[Column::motor_position].push_back(position);
    e[Column::output_position].push_back(position / kRatio);
    e[Column::torque].push_back((kOutputInertia * acceleration + kOutputViscous * velocity) / kRatio);
    const double decay = std::exp(-rate * kSample);
    position += last * kSample + (velocity - last) * (1.0 - decay) / rate;
    velocity = last + (velocity - last) * decay;
    before = rate * (last - velocity);
  }
  e.segments = {{0, e.time_s.size()}};
  e.masked.assign(e.time_s.size(), 0);
  e.motor_position_zero = e.output_position_zero = data::PositionZero::absolute;
  return e;
}

data::Dataset dataset_of(Reading reading) {
  data::Dataset dataset;
  dataset.experiments = {recorded("slow", 0.4, 1.1, reading), recorded("fast", 2.3, 3.7, reading)};
  return dataset;
}

model::Model rigid_gear() {
  model::Model model;
  model.drive.gear_ratio.value = kRatio;
  model.drive.torque_constant_nm_a.value = kTorqueConstant;
  for (const char* name : {"inertia", "viscous_friction", "output_inertia", "output_viscous_friction"})
    model.effects.push_back(catalogue::blank_effect(catalogue::get(name), data::Axis::rotary));
  return model;
}

void expect_truth(const data::Dataset& dataset) {
  const auto found = estimation::identify(dataset, rigid_gear(), {});
  for (const estimation::Estimate& e : found->estimates) {
    const double truth = e.effect == "inertia"            ? kMotorInertia
                         : e.effect == "viscous_friction" ? kMotorViscous
                         : e.effect == "output_inertia"   ? kOutputInertia
                                                          : kOutputViscous;
    EXPECT_NEAR(e.value / truth, 1.0, 1e-4) << e.effect;
  }
}

// Without the other half of the step, the friction would come out 8 % too large at these frequencies.
TEST(ZeroOrderHold, ReadingsFromBeforeTheStepGiveInertiaAndFrictionOfTheLoad) {
  expect_truth(dataset_of(Reading::before_the_step));
}

TEST(ZeroOrderHold, ReadingsThatHoldTheMeanOfBothSidesAreLeftAsTheyAre) {
  const data::Dataset dataset = dataset_of(Reading::mean_of_both_sides);
  expect_truth(dataset);
  const auto found = estimation::identify(dataset, rigid_gear(), {});
  for (std::size_t i = 0; i < dataset.experiments.size(); ++i)
    EXPECT_EQ(found->prepared.records[i].torque, dataset.experiments[i][Column::torque]);
}

TEST(ZeroOrderHold, NothingIsAddedWhereTheEffortIsNotHeld) {
  data::Dataset dataset = dataset_of(Reading::before_the_step);
  for (data::Experiment& e : dataset.experiments) e.current_hold = data::CurrentHold::none;
  const auto found = estimation::identify(dataset, rigid_gear(), {});
  for (std::size_t i = 0; i < dataset.experiments.size(); ++i)
    EXPECT_EQ(found->prepared.records[i].torque, dataset.experiments[i][Column::torque]);
}

}  // namespace
}  // namespace flexspline::estimation_zero_order_hold_test
