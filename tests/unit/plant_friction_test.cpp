// The plant's laws of friction over angle and load: closed forms, partial derivatives against finite differences, and
// the same torque as the library's effect, which shares no code with them.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <random>

#include "hil/plant/friction.hpp"
#include "tests/unit/effects_record.hpp"

namespace flexspline::tests::plant_friction_test {
namespace {

using plant::FrictionPoint;
using plant::FrictionTorque;
using plant::MotorFriction;

FrictionTorque torque_at(const MotorFriction& friction, const FrictionPoint& at) {
  return friction.evaluate(at, 0.0);
}

FrictionPoint random_point(std::mt19937& random) {
  std::uniform_real_distribution<double> unit(-1.0, 1.0);
  FrictionPoint at;
  at.velocity = 8.0 * unit(random);
  at.direction = s(at.velocity);
  at.torque = 40.0 * unit(random);
  at.angle = 10.0 * unit(random);
  at.anchor = at.angle - at.direction * 0.02;
  return at;
}

void expect_derivatives(const MotorFriction& friction) {
  std::mt19937 random(3);
  for (int k = 0; k < 200; ++k) {
    const FrictionPoint at = random_point(random);
    const FrictionTorque f = torque_at(friction, at);
    const auto slope = [&](double FrictionPoint::*member, double step) {
      FrictionPoint high = at, low = at;
      high.*member += step;
      low.*member -= step;
      return (torque_at(friction, high).torque - torque_at(friction, low).torque) / (2.0 * step);
    };
    ASSERT_NEAR(f.by_angle, slope(&FrictionPoint::angle, 1e-6), 1e-8);
    ASSERT_NEAR(f.by_velocity, slope(&FrictionPoint::velocity, 1e-6), 1e-8);
    ASSERT_NEAR(f.by_torque, slope(&FrictionPoint::torque, 1e-6), 1e-8);
  }
}

// At the same velocity, torque and angle.
void expect_torque_of(const char* effect, const std::vector<double>& parameters, const MotorFriction& friction) {
  std::mt19937 random(4);
  Record record = random_record(random);
  const std::vector<double> given = response<Real>(catalogue::get(effect), parameters, record);
  double largest = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    FrictionPoint at;
    at.velocity = record[k].w;
    at.direction = s(record[k].w);
    at.torque = record[k].T;
    at.angle = at.anchor = record[k].q;
    ASSERT_NEAR(torque_at(friction, at).torque, given[k], 1e-12) << k;
    largest = std::max(largest, std::abs(given[k]));
  }
  EXPECT_GT(largest, 1e-3);
}

TEST(PlantFriction, OverTheAngleResistsInBothDirectionsAtTheSamePlace) {
  MotorFriction friction;
  friction.angle_friction.push_back({2.0, 0.003, 0.004});
  ASSERT_FALSE(friction.is_plain());
  FrictionPoint at;
  at.angle = 0.5 * std::atan2(0.004, 0.003);  // of the maximum
  for (const double direction : {1.0, -1.0}) {
    at.direction = direction;
    EXPECT_NEAR(torque_at(friction, at).torque, direction * 0.005, 1e-15);
  }
  at.direction = 0.0;
  EXPECT_EQ(torque_at(friction, at).torque, 0.0);
  expect_derivatives(friction);
  expect_torque_of("angle_dependent_friction", {2.0, 0.003, 0.004}, friction);
}

TEST(PlantFriction, OverTheOutputsAngleRepeatsOnceATurnOfTheOutput) {
  MotorFriction friction;
  friction.angle_friction.push_back({1.0 / kGearRatio, 0.01, 0.0});
  FrictionPoint at;
  at.direction = 1.0;
  const double turn = 2.0 * std::numbers::pi * kGearRatio;
  EXPECT_NEAR(torque_at(friction, at).torque, 0.01, 1e-15);
  at.angle = 0.5 * turn;
  EXPECT_NEAR(torque_at(friction, at).torque, -0.01, 1e-15);
  at.angle = turn;
  EXPECT_NEAR(torque_at(friction, at).torque, 0.01, 1e-14);
  expect_torque_of("angle_dependent_friction", {1.0 / kGearRatio, 0.01, 0.0}, friction);
}

TEST(PlantFriction, StictionUnderLoadFallsWithSpeedAndIsProportionalToTheLoad) {
  MotorFriction friction;
  friction.gear_ratio = kGearRatio;
  friction.load_stiction.push_back({0.05, 3.0});
  ASSERT_FALSE(friction.is_plain());
  FrictionPoint at;
  for (const double direction : {1.0, -1.0})
    for (const double load : {-20.0, 0.0, 20.0}) {
      at.direction = direction;
      at.torque = load;
      at.velocity = 0.0;
      const double stiction = direction * 0.05 * std::abs(load) / kGearRatio;
      EXPECT_NEAR(torque_at(friction, at).torque, stiction, 1e-15);
      at.velocity = direction * 3.0;
      EXPECT_NEAR(torque_at(friction, at).torque, stiction / std::numbers::e, 1e-15);
      at.velocity = direction * 30.0;
      EXPECT_EQ(torque_at(friction, at).torque, 0.0) << "negligible";
    }
  expect_derivatives(friction);
  expect_torque_of("load_dependent_stiction", {0.05, 3.0}, friction);
}

// The loss as a share of the power through the gear: of a motor that drives, and of one that is driven.
TEST(PlantFriction, LossGrowsOverATravelToTheShareOfItsDirectionOfPower) {
  MotorFriction friction;
  friction.gear_ratio = kGearRatio;
  friction.loss = {0.08, 0.04, 0.05};
  ASSERT_FALSE(friction.is_plain());
  FrictionPoint at;
  for (const double direction : {1.0, -1.0})
    for (const double load : {-20.0, 20.0}) {
      at = {};
      at.direction = direction;
      at.torque = load;
      EXPECT_EQ(torque_at(friction, at).torque, 0.0) << "nothing has moved";
      at.angle = direction * 5.0;  // a hundred travels on
      const double share = load * direction > 0.0 ? 0.08 : 0.04;
      EXPECT_NEAR(torque_at(friction, at).torque, direction * share * 20.0 / kGearRatio, 1e-15);
      EXPECT_NEAR(friction.loss_deflection(at), direction, 1e-15);
      // Back by a travel: z = -1 + 2/e of the way.
      at.anchor = at.angle;
      at.loss = direction;
      at.direction = -direction;
      at.angle -= direction * 0.05;
      EXPECT_NEAR(friction.loss_deflection(at), direction * (2.0 / std::numbers::e - 1.0), 1e-12);
    }
  expect_derivatives(friction);
}

// Along a path, as the deflection remembers it.
TEST(PlantFriction, LossIsThatOfTheEffectAlongAPathWithReversals) {
  std::mt19937 random(5);
  const Record record = random_record(random);
  const std::vector<double> given =
      response<Real>(catalogue::get("driving_dependent_loss"), {0.08, 0.04, 0.05}, record);
  MotorFriction friction;
  friction.gear_ratio = kGearRatio;
  friction.loss = {0.08, 0.04, 0.05};
  FrictionPoint at;
  at.angle = record[0].q;
  double largest = 0.0;
  for (std::size_t k = 0; k < record.size(); ++k) {
    at.anchor = at.angle;
    at.angle = record[k].q;
    at.direction = s(at.angle - at.anchor);
    at.velocity = record[k].w;
    at.torque = record[k].T;
    if (at.direction != 0.0) at.loss = friction.loss_deflection(at);
    at.anchor = at.angle;
    ASSERT_NEAR(torque_at(friction, at).torque, given[k], 1e-12) << k;
    largest = std::max(largest, std::abs(given[k]));
  }
  EXPECT_GT(largest, 1e-2);
}

}  // namespace
}  // namespace flexspline::tests::plant_friction_test
