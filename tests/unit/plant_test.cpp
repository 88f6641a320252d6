#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>

#include "hil/plant/parameters.hpp"
#include "hil/plant/physics.hpp"
#include "hil/plant/two_mass.hpp"

namespace flexspline::plant::plant_test {
namespace {

constexpr double kSample = 1e-3;
constexpr int kSteps = 16;

Physics bare() {
  Physics p;
  p.torque_constant = 0.0543;
  p.motor_inertia = 1.04e-4;
  p.transmission.stiffness = 6.3e3;
  p.output_inertia = 0.06;
  return p;
}

Physics demo() {
  return physics_of(demo_plant().drive);
}

// A second implementation of the same physics, as plain as can be: semi-implicit Euler at a fifth of a microsecond.
struct PlainDrive {
  Physics p;
  double q = 0, w = 0, qo = 0, wo = 0, torque = 0;

  static double slide(double free_velocity, double friction_impulse) {
    if (free_velocity > friction_impulse) return free_velocity - friction_impulse;
    if (free_velocity < -friction_impulse) return free_velocity + friction_impulse;
    return 0.0;
  }
  void advance(double current, double duration) {
    const double h = 2e-7;
    const long steps = std::lround(duration / h);
    for (long i = 0; i < steps; ++i) {
      const double v = w / p.gear_ratio - wo;
      torque = p.transmission.stiffness * (q / p.gear_ratio - qo) +
               p.damping_torque * std::copysign(std::pow(std::abs(v), p.damping_exponent), v);
      const double bias = p.friction.viscous_asymmetry * std::abs(w) + (w == 0.0 ? 0.0 : p.friction.coulomb_asymmetry);
      const double motor = p.torque_constant * current - torque / p.gear_ratio - p.friction.viscous * w - bias;
      double level = p.friction.coulomb;
      for (const Stribeck& s : p.friction.stribeck) {
        level += s.positive * std::exp(-(w / s.velocity) * (w / s.velocity));
      }
      w = slide(w + h * motor / p.motor_inertia, h * level / p.motor_inertia);
      const double load = torque - p.output_viscous * wo - p.gravity_sine * std::sin(qo);
      wo = slide(wo + h * load / p.output_inertia, h * p.output_coulomb / p.output_inertia);
      q += h * w;
      qo += h * wo;
    }
  }
};

TEST(Plant, SticksExactlyBelowBreakAway) {
  TwoMass plant(demo(), false);
  const Physics& p = plant.physics();
  const double break_away = (p.friction.coulomb + p.friction.coulomb_asymmetry) / p.torque_constant;
  plant.advance({0.999 * break_away}, 1.0, 1000);
  EXPECT_EQ(plant.state().motor_angle, 0.0);
  EXPECT_EQ(plant.state().motor_velocity, 0.0);
  EXPECT_EQ(plant.state().motor_direction, 0);
  plant.advance({1.001 * break_away}, 0.1, 100);
  EXPECT_GT(plant.state().motor_angle, 0.0);
}

TEST(Plant, BreaksAwayLaterInTheDirectionOfGreaterFriction) {
  for (const int direction : {1, -1}) {
    TwoMass plant(demo(), true);
    const Physics& p = plant.physics();
    const double threshold = (p.friction.coulomb + direction * p.friction.coulomb_asymmetry) / p.torque_constant;
    plant.advance({direction * threshold * 0.999}, 0.01, 160);
    EXPECT_EQ(plant.state().motor_angle, 0.0);
    plant.advance({direction * threshold * 1.001}, 0.01, 160);
    EXPECT_GT(direction * plant.state().motor_angle, 0.0);
  }
}

TEST(Plant, OutputSticksWhileTheMotorWindsTheSpring) {
  Physics p = bare();
  p.output_coulomb = 0.6;
  State start;
  start.motor_velocity = 0.3;
  TwoMass plant(p, false, start);
  plant.advance({}, 1e-3, 16);
  EXPECT_GT(plant.torque(), 0.0);
  EXPECT_LT(plant.torque(), 0.6);
  EXPECT_EQ(plant.state().output_angle, 0.0);
}

TEST(Plant, SlidesToRestAsTheClosedFormSays) {
  // One shaft: the output is so light, and the spring so stiff, that only the motor matters.
  Physics p = bare();
  p.output_inertia = 1e-9;
  p.friction.viscous = 3.6e-4;
  p.friction.coulomb = 0.045;
  p.damping_torque = 57.0;
  p.damping_exponent = 0.5;
  const double w0 = 100.0;
  State start;
  start.motor_velocity = w0;
  start.output_velocity = w0 / p.gear_ratio;
  TwoMass plant(p, false, start);
  const double inertia = p.motor_inertia + p.output_inertia / (p.gear_ratio * p.gear_ratio);
  const double tau = inertia / p.friction.viscous;
  const double level = p.friction.coulomb / p.friction.viscous;
  const double stop = tau * std::log(1.0 + w0 / level);
  const double rest = w0 * tau - level * stop;
  double time = 0.0;
  while (time + kSample < stop) {
    plant.advance({}, kSample, kSteps);
    time += kSample;
    ASSERT_NEAR(plant.state().motor_velocity, (w0 + level) * std::exp(-time / tau) - level, 2e-5) << time;
  }
  plant.advance({}, 2 * kSample, 2 * kSteps);
  EXPECT_EQ(plant.state().motor_velocity, 0.0);
  EXPECT_NEAR(plant.state().motor_angle, rest, 1e-6);
}

TEST(Plant, RingsAtTheTwoMassResonance) {
  const Physics p = bare();
  const double ratio = p.gear_ratio;
  const double reduced = 1.0 / (1.0 / (p.motor_inertia * ratio * ratio) + 1.0 / p.output_inertia);
  const double expected_hz = std::sqrt(p.transmission.stiffness / reduced) / (2.0 * std::numbers::pi);
  State start;
  start.motor_angle = 0.1;
  TwoMass plant(p, false, start);
  double first = 0.0, last = 0.0, before = plant.torque();
  int crossings = 0;
  const double dt = 1e-4;
  for (int k = 1; k <= 10000; ++k) {
    plant.advance({}, dt, 4);
    const double now = plant.torque();
    if (before < 0.0 && now >= 0.0) {
      last = dt * (k - now / (now - before));
      if (crossings++ == 0) first = last;
    }
    before = now;
  }
  ASSERT_GT(crossings, 40);
  EXPECT_NEAR((crossings - 1) / (last - first), expected_hz, 2e-4 * expected_hz);
}

TEST(Plant, LosesEnergyWithoutInput) {
  State start;
  start.motor_angle = 0.3;
  start.motor_velocity = 40.0;
  start.output_velocity = -0.4;
  Physics p = demo();
  p.gravity_sine = 3.0;
  p.transmission.backlash_half_width = 1.5e-4;
  p.friction.coulomb_asymmetry = 0.0;
  TwoMass plant(p, false, start);
  double before = plant.energy();
  const double at_first = before;
  for (int k = 0; k < 1000; ++k) {
    plant.advance({}, kSample, kSteps);
    const double now = plant.energy();
    ASSERT_LE(now, before + 1e-9 * std::abs(at_first)) << "at sample " << k;
    before = now;
  }
  EXPECT_LT(before, at_first - 0.05);
}

TEST(Plant, SettlesOnTheStaticBalanceWhenLocked) {
  TwoMass plant(demo(), true);
  const Physics& p = plant.physics();
  plant.advance({2.0}, 2.0, 2000 * kSteps);
  // It creeps up to the balance from below, so friction opposes the winding up.
  const double balance = p.gear_ratio * (p.torque_constant * 2.0 - p.friction.coulomb - p.friction.coulomb_asymmetry);
  EXPECT_LT(plant.torque(), balance);
  EXPECT_NEAR(plant.torque(), balance, 1e-3);
  EXPECT_EQ(plant.state().output_angle, 0.0);
}

TEST(Plant, AgreesWithAPlainIntegratorThroughStickSlipAndReversals) {
  Physics p = demo();
  p.friction.stribeck.push_back({0.012, 0.012, 3.0, 2.0});
  p.gravity_sine = 3.0;
  PlainDrive plain{p};
  TwoMass plant(p, false);
  double worst_velocity = 0.0, worst_angle = 0.0, fastest = 0.0;
  bool stuck = false;
  for (int k = 0; k < 400; ++k) {
    const double current = 1.5 * std::sin(2.0 * std::numbers::pi * 5.0 * k * kSample);
    plain.advance(current, kSample);
    plant.advance({current}, kSample, kSteps);
    worst_velocity = std::max(worst_velocity, std::abs(plant.state().motor_velocity - plain.w));
    worst_angle = std::max(worst_angle, std::abs(plant.state().motor_angle - plain.q));
    fastest = std::max(fastest, std::abs(plain.w));
    stuck = stuck || (k > 50 && plant.state().motor_direction == 0);
  }
  EXPECT_TRUE(stuck);
  EXPECT_GT(fastest, 5.0);
  EXPECT_LT(worst_velocity, 2e-3);
  EXPECT_LT(worst_angle, 2e-4);
}

TEST(Plant, BacklashFreesTheMotorInsideTheGap) {
  Physics p = bare();
  p.transmission.backlash_half_width = 1.5e-4;
  State start;
  start.motor_velocity = 1.0;
  TwoMass plant(p, true, start);
  const double edge = p.gear_ratio * p.transmission.backlash_half_width;
  plant.advance({}, 0.999 * edge, 64);
  EXPECT_EQ(plant.torque(), 0.0);
  EXPECT_NEAR(plant.state().motor_velocity, 1.0, 1e-12);
  plant.advance({}, 5e-3, 80);
  EXPECT_NEAR(
      plant.torque(),
      p.transmission.stiffness * (plant.state().motor_angle / p.gear_ratio - p.transmission.backlash_half_width), 1e-9);
  EXPECT_GT(plant.torque(), 0.1);
}

TEST(Plant, BristleHasItsStiffnessAtRestAndTwiceThatAtAReversal) {
  Physics p = bare();
  p.friction.dahl_torque = 0.045;
  p.friction.dahl_presliding = 0.05;
  const double stiffness = p.friction.dahl_torque / p.friction.dahl_presliding;
  FrictionPoint at;
  at.direction = 1.0;
  EXPECT_NEAR(p.friction.evaluate(at, 0.0).by_angle, stiffness, 1e-12);
  at.angle = 1.0;  // twenty presliding lengths on: the full Coulomb torque
  EXPECT_NEAR(p.friction.evaluate(at, 0.0).torque, p.friction.dahl_torque, 1e-9);
  at.bristle = p.friction.bristle(at);
  at.anchor = at.angle;
  at.direction = -1.0;
  EXPECT_NEAR(p.friction.evaluate(at, 0.0).by_angle, 2.0 * stiffness, 1e-7);
  EXPECT_NEAR(p.friction.evaluate(at, 0.0).torque, p.friction.dahl_torque, 1e-9);
}

TEST(Plant, BristleCarriesAStaticTorqueAsTheLawSays) {
  // Dahl under a torque M that rises slowly from rest: 1 - exp(-q/presliding) = M/Ts.
  Physics p = bare();
  p.transmission.stiffness = 1e-3;
  p.friction.dahl_torque = 0.045;
  p.friction.dahl_presliding = 0.05;
  p.friction.viscous = 5e-2;
  TwoMass plant(p, true);
  const double target = 0.03;
  for (int k = 0; k < 4000; ++k) {
    plant.advance({target / p.torque_constant * std::min(1.0, k / 1500.0)}, kSample, 4);
  }
  EXPECT_NEAR(plant.state().motor_angle, -0.05 * std::log(1.0 - target / 0.045), 1e-4);
}

TEST(Plant, ConvergesWithSecondOrderThroughReversals) {
  const auto end_angle = [](int steps) {
    TwoMass plant(demo(), false);
    for (int k = 0; k < 300; ++k) {
      plant.advance({3.0 * std::sin(2.0 * std::numbers::pi * 8.0 * k * kSample)}, kSample, steps);
    }
    return plant.state().motor_angle;
  };
  const double reference = end_angle(128);
  const double coarse = std::abs(end_angle(8) - reference);
  const double fine = std::abs(end_angle(32) - reference);
  EXPECT_LT(fine, coarse / 8.0);
  EXPECT_LT(coarse, 1e-5);
}

// A cubic stiffness of which no torsion sees anything, and the same drive is solved by iteration.
TEST(Plant, ADriveThatBendsNowhereMovesAsOneThatIsSolvedByIteration) {
  Physics straight = demo();
  straight.friction.viscous_asymmetry = 1e-5;
  straight.friction.temperature_coefficient = 0.02;
  straight.friction.temperature_reference = 25.0;
  Physics iterated = straight;
  ASSERT_EQ(straight.transmission.cubic_stiffness, 0.0);
  ASSERT_EQ(straight.damping_exponent, 0.5);
  ASSERT_GT(straight.damping_torque, 0.0);
  iterated.transmission.cubic_stiffness = 1e-9;
  TwoMass one(straight, false), other(iterated, false);
  int turned = 0, rested = 0;
  double farthest = 0.0;
  for (int k = 0; k < 4000; ++k) {
    const double t = k * kSample;
    const Inputs inputs{.current_a = 1.6 * std::sin(9.0 * t) + 0.5 * std::sin(200.0 * t),
                        .temperature_c = 30.0 + k / 70,
                        .load_torque_nm = 2.0 * std::sin(3.0 * t)};
    const int before = one.state().motor_direction;
    // Steps of two sizes, and warmer by a degree at other times: nothing of one is left in the other.
    const int steps = 8 + k / 50 % 2;
    one.advance(inputs, kSample, steps);
    other.advance(inputs, kSample, steps);
    turned += one.state().motor_direction == -before && before != 0 ? 1 : 0;
    rested += one.state().motor_direction == 0 ? 1 : 0;
    farthest = std::max(farthest, std::abs(one.state().motor_angle));
    ASSERT_NEAR(one.state().motor_velocity, other.state().motor_velocity, 1e-6) << t;
    ASSERT_NEAR(one.state().output_velocity, other.state().output_velocity, 1e-8) << t;
    ASSERT_NEAR(one.state().motor_angle, other.state().motor_angle, 1e-8) << t;
    ASSERT_NEAR(one.state().output_angle, other.state().output_angle, 1e-10) << t;
    ASSERT_NEAR(one.torque(), other.torque(), 1e-6) << t;
  }
  EXPECT_GT(turned + rested, 10);
  EXPECT_GT(farthest, 0.1);
}

}  // namespace
}  // namespace flexspline::plant::plant_test
