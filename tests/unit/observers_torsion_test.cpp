// Torsion and output velocity without an encoder at the output: the two masses and the spring of the equations, written
// once more, and the twin's plant.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <numbers>
#include <random>

#include "hil/plant/two_mass.hpp"
#include "host/common/numbers/real.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/observers/torsion.hpp"

namespace flexspline::tests::observers_torsion_test {
namespace {

using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;
using observers::TorsionObserver;
using observers::TorsionSetup;

constexpr double kTickS = 1.0 / 20000.0;
constexpr double kGear = 100.0, kInertia = 1.04e-4, kOutputInertia = 0.06, kStiffness = 6300.0;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.gear_ratio = kGear;
  d.torque_base = 0.19;
  d.output_torque_base = 40.0;
  d.velocity_base = 200.0;
  d.output_velocity_base = 2.0;
  d.torsion_base = 40.0 / kStiffness;
  d.time_base = kTickS;
  return d;
}
TorsionSetup<double> setup() {
  return {.inertia = kInertia,
          .output_inertia = kOutputInertia,
          .stiffness = kStiffness,
          .torque_noise = 0.005,
          .load_walk = 20.0,
          .velocity_noise = 0.05};
}
template <class N>
TorsionObserver::Coefficients<N> observer() {
  return TorsionObserver::derive<N>(setup(), drive());
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}
plant::TwoMass linear_plant(const plant::State& start = {}) {
  plant::Physics physics;
  physics.gear_ratio = kGear;
  physics.torque_constant = 1.0;  // a current is a torque
  physics.motor_inertia = kInertia;
  physics.transmission.stiffness = kStiffness;
  physics.output_inertia = kOutputInertia;
  return plant::TwoMass(physics, false, start);
}
double torsion_of(const plant::State& s) {
  return s.motor_angle / kGear - s.output_angle;
}

TEST(TorsionObserver, FollowsTheTwoMassesOfTheTwinWithoutKnowingTheOutput) {
  auto plant = linear_plant();
  const auto c = observer<Fixed>();
  TorsionObserver::State<Fixed> s;
  double worst = 0.0, worst_velocity = 0.0, largest = 0.0;
  for (int k = 0; k < 20'000; ++k) {
    const double t = k * kTickS;
    const double torque = 0.1 * std::sin(2.0 * std::numbers::pi * 7.0 * t) + (k / 500 % 2 == 0 ? 0.03 : -0.03);
    plant.advance({.current_a = torque}, kTickS, 1);
    const auto e = TorsionObserver::update<Fixed>(s, c, Fixed::value(torque / 0.19),
                                                  Fixed::value(plant.state().motor_velocity / 200.0));
    const double torsion = torsion_of(plant.state());
    worst = std::max(worst, std::abs(real(e.torsion) * drive().torsion_base - torsion));
    worst_velocity = std::max(worst_velocity, std::abs(real(e.output_velocity) * 2.0 - plant.state().output_velocity));
    largest = std::max(largest, std::abs(torsion));
  }
  // What symplectic Euler misses at a tick of 1/60 of the resonance's radian.
  EXPECT_LT(worst, 0.01 * largest);
  EXPECT_GT(largest, 1e-4);
  EXPECT_LT(worst_velocity, 0.003);
}

TEST(TorsionObserver, FindsAnOscillationThatItWasNotToldOf) {
  plant::State start;
  start.output_angle = -2e-4;
  auto plant = linear_plant(start);
  const auto c = observer<Fixed>();
  TorsionObserver::State<Fixed> s;
  double worst = 0.0, largest = 0.0;
  for (int k = 0; k < 6000; ++k) {
    plant.advance({}, kTickS, 1);
    const auto e = TorsionObserver::update<Fixed>(s, c, {}, Fixed::value(plant.state().motor_velocity / 200.0));
    if (k < 1000) continue;
    worst = std::max(worst, std::abs(real(e.torsion) * drive().torsion_base - torsion_of(plant.state())));
    largest = std::max(largest, std::abs(torsion_of(plant.state())));
  }
  EXPECT_GT(largest, 1.5e-4);
  EXPECT_LT(worst, 0.02 * largest);
}

TEST(TorsionObserver, LearnsALoadThatNobodyToldItOf) {
  auto plant = linear_plant();
  const auto c = observer<Fixed>();
  TorsionObserver::State<Fixed> s;
  TorsionObserver::Estimate<Fixed> e;
  for (int k = 0; k < 20'000; ++k) {
    // Held against the load, as a velocity loop does.
    const double torque = 0.05 - 0.01 * plant.state().motor_velocity;
    plant.advance({.current_a = torque, .load_torque_nm = 5.0}, kTickS, 1);
    e = TorsionObserver::update<Fixed>(s, c, Fixed::value(torque / 0.19),
                                       Fixed::value(plant.state().motor_velocity / 200.0));
  }
  EXPECT_NEAR(real(e.load) * 40.0, 5.0, 0.05);
  EXPECT_NEAR(real(e.torsion) * drive().torsion_base, torsion_of(plant.state()), 0.01 * 5.0 / kStiffness);
}

TEST(TorsionObserver, GoesOnByItselfWhereItsInputsAreNotToBeTrusted) {
  plant::State start;
  start.output_angle = -2e-4;
  auto plant = linear_plant(start);
  const auto c = observer<Fixed>();
  TorsionObserver::State<Fixed> s;
  double worst = 0.0;
  for (int k = 0; k < 3000; ++k) {
    plant.advance({}, kTickS, 1);
    const bool trusted = k < 2000;
    const auto e =
        TorsionObserver::update<Fixed>(s, c, Fixed::value(trusted ? 0.0 : 1.9),
                                       Fixed::value(trusted ? plant.state().motor_velocity / 200.0 : -1.9), trusted);
    if (!trusted) worst = std::max(worst, std::abs(real(e.torsion) * drive().torsion_base - torsion_of(plant.state())));
  }
  EXPECT_LT(worst, 2e-5);
}

TEST(TorsionObserver, TakesAnErrorOfFrictionForTorqueThroughTheGear) {
  // The motor held at standstill by a friction b that nobody modelled: to the observer the spring holds it.
  const auto c = observer<Fixed>();
  TorsionObserver::State<Fixed> s;
  const double b = 0.002;
  double torsion = 0.0;
  for (int k = 0; k < 40'000; ++k)
    torsion = real(TorsionObserver::update<Fixed>(s, c, Fixed::value(b / 0.19), {}).torsion) * drive().torsion_base;
  EXPECT_NEAR(torsion, kGear * b / kStiffness, 0.02 * kGear * b / kStiffness);
}

TEST(TorsionObserver, OnADriveAgreesWithDoubleAndKeepsItsRangeForWrongInputsToo) {
  const auto c = observer<Fixed>();
  const auto c_checked = observer<Checked>();
  const auto c_real = observer<Real>();
  TorsionObserver::State<Fixed> s;
  TorsionObserver::State<Checked> s_checked;
  TorsionObserver::State<Real> s_real;
  OverflowLog::clear();
  std::mt19937_64 random(4);
  double worst = 0.0, largest = 0.0, torque = 0.0, velocity = 0.0;
  for (int k = 0; k < 300'000; ++k) {
    const bool wild = k >= 150'000;
    if (k % (wild ? 1000 : 40) == 0) {
      const auto any = [&] { return 4.0 * std::ldexp(static_cast<double>(random() >> 11), -53) - 2.0; };
      torque = (wild ? 1.0 : 0.05) * any();
      velocity = (wild ? 1.0 : 0.003) * any();
    }
    const auto e = TorsionObserver::update<Fixed>(s, c, Fixed::value(torque), Fixed::value(velocity));
    const auto checked =
        TorsionObserver::update<Checked>(s_checked, c_checked, Checked::value(torque), Checked::value(velocity));
    ASSERT_EQ(e.torsion.raw, checked.torsion.raw);
    ASSERT_EQ(e.output_velocity.raw, checked.output_velocity.raw);
    if (wild) continue;  // double has no bounds
    const auto exact = TorsionObserver::update<Real>(s_real, c_real, torque, velocity);
    worst = std::max(
        {worst, std::abs(real(e.torsion) - exact.torsion), std::abs(real(e.output_velocity) - exact.output_velocity)});
    largest = std::max(largest, std::abs(exact.torsion));
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  EXPECT_LT(worst, 1e-5);
  EXPECT_GT(largest, 0.05);
}

TEST(TorsionObserver, RefusesATickThatIsTooLongForTheResonance) {
  auto d = drive();
  d.time_base = 1e-3;
  OverflowLog::clear();
  TorsionObserver::derive<Fixed>(setup(), d);
  EXPECT_GT(OverflowLog::count(), 0);
  OverflowLog::clear();
}

}  // namespace
}  // namespace flexspline::tests::observers_torsion_test
