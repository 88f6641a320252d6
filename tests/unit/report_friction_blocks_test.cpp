// The report's friction block and its variants: figures 9 to 11 in numbers, the layer of eq. 32, the set-valued law.
#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <memory>
#include <random>
#include <stdexcept>

#include "hil/thesis_models/friction_block.hpp"
#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/runge_kutta.hpp"

namespace flexspline::report_friction_blocks_test {
namespace {

using namespace flexspline::report;  // NOLINT(google-build-using-namespace): a test reads better without the prefix
using enum FrictionMethod;

constexpr double kStep = published::kSampleS;
constexpr double kInertia = published::kEffectiveInertia;
constexpr double kCoulomb = 4.60e-2;  // table 7, positive direction

Shaft coulomb_shaft(double inertia, double coulomb, double viscous = 0.0) {
  return {inertia, {FrictionCurve::symmetric({viscous, coulomb, 0.0, 1.0})}};
}
Shaft report_shaft() {
  return coulomb_shaft(kInertia, kCoulomb);
}

int sign_of(double x) {
  return x > 0.0 ? 1 : x < 0.0 ? -1 : 0;
}

// Counts how often a signal turns to the other sign.
class Alternations {
 public:
  void see(double x) {
    const int sign = sign_of(x);
    if (sign == 0) return;
    if (last_ == -sign) ++count_;
    last_ = sign;
  }
  int count() const { return count_; }

 private:
  int last_ = 0;
  int count_ = 0;
};

struct Standstill {
  int evaluated = 0;         // sign changes of the friction that the integrator was told, in one second
  int seen = 0;              // the same, of the friction at the ends of steps
  double fastest = 0.0;      // in that second
  double drift = 0.0;        // way in that second
  double last_velocity = 0;  // at its end
};

// Figures 9 to 11: a mass of 1 kg slides at 0.5 m/s on a surface with 0.5 N of friction, so that it stops after one
// second and 0.25 m; the second from 1.1 s on is looked at. Steps of 0.1 to 10 ms.
Standstill figure(FrictionMethod method) {
  const StepLimits limits{1e-4, 1e-2, 1e-6};
  const auto block = make_friction_block(method, coulomb_shaft(1.0, 0.5), limits.longest_s);
  Standstill rest;
  Alternations evaluated, seen;
  bool watch = false;
  const auto rate = [&](double, const std::array<double, 2>& y) {
    const double friction = block->torque(y[1], 0.0);
    if (watch) evaluated.see(friction);
    return std::array{y[1], -friction};
  };
  std::array y{0.0, 0.5};
  y = variable_step(rate, 0.0, y, 1.1, limits, [](double, const auto&) {});
  const double from = y[0];
  watch = true;
  y = variable_step(rate, 1.1, y, 2.1, limits, [&](double, const std::array<double, 2>& now) {
    seen.see(block->torque(now[1], 0.0));
    rest.fastest = std::max(rest.fastest, std::abs(now[1]));
  });
  return {evaluated.count(), seen.count(), rest.fastest, y[0] - from, y[1]};
}

TEST(ReportFriction, AThresholdOf1e8ChattersAtEveryShortestStepAsInFigure9) {
  const Standstill rest = figure(threshold_1e_8);
  EXPECT_EQ(rest.seen, 9999);         // 10 000 steps of the shortest length: each turns the friction round
  EXPECT_GT(rest.evaluated, 25'000);  // within steps too
  EXPECT_GT(rest.fastest, 100.0 * 1e-8);
}

TEST(ReportFriction, AThresholdOf1e4LeavesAVelocityBelowItAsInFigure10) {
  const Standstill rest = figure(threshold_1e_4);
  EXPECT_EQ(rest.seen, 0);
  EXPECT_EQ(rest.evaluated, 0);
  // "The final velocity will not decrease to zero but will be bounded by the amount of" the threshold.
  EXPECT_GT(rest.fastest, 1e-6);
  EXPECT_LE(rest.fastest, 1e-4);
  EXPECT_EQ(std::abs(rest.last_velocity), rest.fastest);
  EXPECT_NEAR(std::abs(rest.drift), rest.fastest, 1e-9);  // it creeps for ever
}

TEST(ReportFriction, TheBoundaryLayerComesToRestWithoutChatterAsInFigure11) {
  const Standstill rest = figure(boundary_layer);
  EXPECT_EQ(rest.seen, 0);
  EXPECT_EQ(rest.evaluated, 0);
  EXPECT_LT(std::abs(rest.last_velocity), 1e-15);
}

TEST(ReportFriction, TheImplicitBlockStopsExactlyAfterTheTimeThatFrictionNeeds) {
  const auto block = make_friction_block(implicit, coulomb_shaft(1.0, 0.5), 1e-4);
  double velocity = 0.5, way = 0.0;
  int steps = 0;
  for (; velocity != 0.0 && steps < 20'000; ++steps) {
    velocity = block->next_velocity(velocity, 0.0);
    way += velocity * 1e-4;
  }
  EXPECT_EQ(velocity, 0.0);
  EXPECT_NEAR(steps, 10'000, 1);
  EXPECT_NEAR(way, 0.25, 0.5 * 0.5 * 1e-4 * 1.01);  // backward Euler: half a step at the first velocity
  for (int n = 0; n < 1000; ++n) EXPECT_EQ(velocity = block->next_velocity(velocity, 0.0), 0.0);
  EXPECT_EQ(block->torque(0.0, 0.0), 0.0);
}

// The drive's motor shaft in the report's own integration, 1 ms, from 0.3 s on (it stops after 0.11 s), for a second.
Standstill drive_at_rest(FrictionMethod method, bool euler) {
  const auto block = make_friction_block(method, report_shaft(), kStep);
  Alternations evaluated, seen;
  Standstill rest;
  bool watch = false;
  const auto rate = [&](double, const std::array<double, 1>& y) {
    const double friction = block->torque(y[0], 0.0);
    if (watch) evaluated.see(friction);
    return std::array{-friction / kInertia};
  };
  std::array y{49.9};
  for (int n = 0; n < 1300; ++n) {
    watch = n >= 300;
    y = euler ? std::array{block->next_velocity(y[0], 0.0)} : rk4_step(rate, 0.0, y, kStep);
    if (!watch) continue;
    seen.see(y[0]);
    rest.fastest = std::max(rest.fastest, std::abs(y[0]));
  }
  return {evaluated.count(), seen.count(), rest.fastest, 0.0, y[0]};
}

TEST(ReportFriction, EulerStepsOfOneMillisecondTurnThresholdFrictionRoundAThousandTimesASecond) {
  for (const FrictionMethod method : {threshold_1e_8, threshold_1e_4}) {
    const Standstill rest = drive_at_rest(method, true);
    EXPECT_EQ(rest.seen, 999);
    // Half a layer, at least, is where the amplitude must be: two velocities that are a layer apart.
    EXPECT_GE(rest.fastest, 0.5 * kCoulomb / kInertia * kStep);
  }
  EXPECT_EQ(drive_at_rest(boundary_layer, true).seen, 0);
  EXPECT_EQ(drive_at_rest(implicit, true).seen, 0);
  EXPECT_EQ(drive_at_rest(implicit, true).fastest, 0.0);
}

TEST(ReportFriction, RungeKuttaHidesTheChatterWithinTheStepAndNeverComesToRest) {
  // The weights 1, 2, 2, 1 of friction that turns round at each evaluation add up to zero.
  for (const FrictionMethod method : {threshold_1e_8, threshold_1e_4}) {
    const Standstill rest = drive_at_rest(method, false);
    EXPECT_EQ(rest.evaluated, 3999);
    EXPECT_EQ(rest.seen, 0);
    EXPECT_NEAR(rest.last_velocity, 0.0667, 1e-3);
    EXPECT_NEAR(std::abs(rest.last_velocity), rest.fastest, 1e-12);
  }
  const Standstill layer = drive_at_rest(boundary_layer, false);
  EXPECT_EQ(layer.evaluated, 0);
  EXPECT_LT(layer.fastest, 1e-15);
}

TEST(ReportFriction, TheLayerIsFourTenthsOfARadianPerSecondWideForTheReportsDrive) {
  const BoundaryLayerFriction block({kInertia, {published::total_friction()}}, kStep);
  EXPECT_NEAR(block.width(1), 4.60e-2 / 1.04e-4 * 1e-3, 1e-12);  // eq. 32
  EXPECT_NEAR(block.width(1), 0.44, 0.005);
  EXPECT_NEAR(block.width(-1), 0.43, 0.005);
  // Wider than the low-velocity region of figure 40, plus or minus 0.1 rad/s: Stribeck friction drowns in it.
  EXPECT_GT(block.width(1), 0.1);
  const Shaft& shaft = block.shaft();
  EXPECT_LT(block.torque(0.1, 0.0), 0.25 * shaft.friction(0.1));
}

TEST(ReportFriction, TheLayerGrowsWithTheStepAndIsAsSteepInBothDirections) {
  for (const double step : {1e-3, 1e-4, 1e-5}) {
    const BoundaryLayerFriction block({kInertia, {{{0.0, 0.05}, {0.0, 0.02}}}}, step);
    EXPECT_NEAR(block.width(1), 0.05 / kInertia * step, 1e-12);
    EXPECT_NEAR(block.width(-1), 0.02 / kInertia * step, 1e-12);
    const double slope = kInertia / step;
    EXPECT_NEAR(block.torque(0.1 * block.width(-1), 0.0) / (0.1 * block.width(-1)), slope, 1e-9 * slope);
    EXPECT_NEAR(block.torque(-0.1 * block.width(-1), 0.0) / (-0.1 * block.width(-1)), slope, 1e-9 * slope);
  }
}

TEST(ReportFriction, TheLayerJoinsTheCurveOutside) {
  const Shaft shaft{kInertia, {published::total_friction()}};
  const BoundaryLayerFriction block(shaft, kStep);
  for (const int direction : {-1, 1}) {
    const double edge = direction * block.width(direction);
    EXPECT_NEAR(block.torque(edge * (1.0 - 1e-9), 0.0), block.torque(edge * (1.0 + 1e-9), 0.0), 1e-9);
    EXPECT_EQ(block.torque(20.0 * edge, 0.0), shaft.friction(20.0 * edge));
  }
  EXPECT_EQ(block.torque(0.0, 0.0), 0.0);
}

TEST(ReportFriction, BelowBreakAwayOnlyTheImplicitBlockAndAShaftAtRestHold) {
  const double driving = 0.5 * kCoulomb;
  const auto creep = [&](FrictionMethod method, double from) {
    const auto block = make_friction_block(method, report_shaft(), kStep);
    const auto rate = [&](double, const std::array<double, 1>& y) {
      return std::array{(driving - block->torque(y[0], driving)) / kInertia};
    };
    std::array y{from};
    for (int n = 0; n < 1000; ++n)
      y = method == implicit ? std::array{block->next_velocity(y[0], driving)} : rk4_step(rate, 0.0, y, kStep);
    return y[0];
  };
  EXPECT_EQ(creep(threshold_1e_8, 0.0), 0.0);
  EXPECT_EQ(creep(threshold_1e_4, 5e-5), 5e-5);  // what it happens to have below the threshold stays
  EXPECT_NEAR(creep(boundary_layer, 0.0), 0.5 * kCoulomb / kInertia * kStep, 1e-12);  // 0.22 rad/s
  EXPECT_EQ(creep(implicit, 0.0), 0.0);
  EXPECT_EQ(creep(implicit, 5.0), 0.0);
}

TEST(ReportFriction, AtRestFrictionEqualsTheDrivingTorqueUpToBreakAwayInEitherDirection) {
  const Shaft shaft{kInertia, {{{0.0, 0.05, 0.01, 1.0}, {0.0, 0.02, 0.01, 1.0}, Stribeck::tustin}}};
  for (const FrictionMethod method : {threshold_1e_8, implicit}) {
    const auto block = make_friction_block(method, shaft, kStep);
    for (const double driving : {-0.0299, -0.01, 0.0, 0.03, 0.0599}) {
      EXPECT_DOUBLE_EQ(block->torque(0.0, driving), driving);
      EXPECT_EQ(block->next_velocity(0.0, driving), 0.0);
    }
    EXPECT_GT(block->next_velocity(0.0, 0.0601), 0.0);
    EXPECT_LT(block->next_velocity(0.0, -0.0301), 0.0);
  }
}

TEST(ReportFriction, AnImplicitStepObeysTheSetValuedLaw) {
  const Shaft shaft{kInertia, {published::total_friction(), FrictionCurve::symmetric({1e-4, 0.01, 0.0, 1.0})}};
  const auto block = make_friction_block(implicit, shaft, kStep);
  std::mt19937 random(7);
  std::uniform_real_distribution<double> velocities(-3.0, 3.0), torques(-0.3, 0.3);
  int stuck = 0;
  for (int n = 0; n < 2000; ++n) {
    const double before = velocities(random), driving = torques(random);
    const double after = block->next_velocity(before, driving);
    const double friction = driving - kInertia / kStep * (after - before);
    EXPECT_DOUBLE_EQ(block->torque(before, driving), friction);
    if (after == 0.0) {
      ++stuck;
      EXPECT_LE(friction, shaft.break_away(1));
      EXPECT_GE(friction, -shaft.break_away(-1));
    } else {
      EXPECT_NEAR(friction, shaft.friction(after), 1e-13);
    }
  }
  EXPECT_GT(stuck, 50);
  EXPECT_LT(stuck, 1950);
}

TEST(ReportFriction, TheImplicitBlockErrsWithTheStep) {
  // Under Coulomb and viscous friction, w + Ts/Tv dies out exponentially.
  const double viscous = 1e-3, speed = 100.0, t = 0.1;
  const double offset = kCoulomb / viscous;
  const double exact = (speed + offset) * std::exp(-viscous / kInertia * t) - offset;
  const auto error = [&](int steps) {
    const auto block = make_friction_block(implicit, coulomb_shaft(kInertia, kCoulomb, viscous), t / steps);
    double velocity = speed;
    for (int n = 0; n < steps; ++n) velocity = block->next_velocity(velocity, 0.0);
    return std::abs(velocity - exact);
  };
  ASSERT_GT(exact, 0.0);
  for (const int steps : {100, 200, 400}) EXPECT_NEAR(std::log2(error(steps) / error(2 * steps)), 1.0, 0.02);
}

TEST(ReportFriction, FrictionTurnsTheKineticEnergyIntoHeatAndChatterMakesHeatFromNothing) {
  const double energy = 0.5 * kInertia * 30.0 * 30.0;
  const auto heat = [&](FrictionMethod method, int steps) {
    const double step = 1e-5;
    const auto block = make_friction_block(method, coulomb_shaft(kInertia, kCoulomb, 3.7e-4), step);
    const auto rate = [&](double, const std::array<double, 2>& y) {
      const double friction = block->torque(y[0], 0.0);
      return std::array{-friction / kInertia, friction * y[0]};
    };
    std::array y{30.0, 0.0};
    for (int n = 0; n < steps; ++n) y = rk4_step(rate, 0.0, y, step);
    return y[1];
  };
  // It stops after 0.06 s.
  for (const int steps : {10'000, 20'000}) EXPECT_NEAR(heat(boundary_layer, steps) / energy, 1.0, 1e-6);
  const double earlier = heat(threshold_1e_8, 10'000);
  EXPECT_GT(earlier, energy * (1.0 + 1e-5));
  EXPECT_GT(heat(threshold_1e_8, 20'000), earlier + 1e-5 * energy);
}

TEST(ReportFriction, RefusesWhatIsNotFriction) {
  const auto made = [](double inertia, DirectionalFriction f, double step) {
    return make_friction_block(boundary_layer, {inertia, {FrictionCurve::symmetric(f, Stribeck::tustin)}}, step);
  };
  EXPECT_NO_THROW(made(1e-4, {0.0, 0.05, -0.05, 0.1}, 1e-3));
  EXPECT_THROW(made(0.0, {0.0, 0.05, 0.0, 0.1}, 1e-3), std::invalid_argument);
  EXPECT_THROW(made(1e-4, {0.0, 0.05, 0.0, 0.1}, 0.0), std::invalid_argument);
  EXPECT_THROW(made(1e-4, {-1e-6, 0.05, 0.0, 0.1}, 1e-3), std::invalid_argument);
  EXPECT_THROW(made(1e-4, {0.0, 0.05, -0.06, 0.1}, 1e-3), std::invalid_argument);
  EXPECT_THROW(made(1e-4, {0.0, 0.05, 0.01, 0.0}, 1e-3), std::invalid_argument);
}

TEST(ReportFriction, VariableStepsMeetTheirToleranceWhereNothingJumps) {
  // A harmonic oscillator, of which everything is known; the error adds up over some hundred steps.
  const auto rate = [](double, const std::array<double, 2>& y) { return std::array{y[1], -y[0]}; };
  int steps = 0;
  const auto y =
      variable_step(rate, 0.0, std::array{1.0, 0.0}, 5.0, {1e-6, 1.0, 1e-8}, [&](double, const auto&) { ++steps; });
  EXPECT_NEAR(y[0], std::cos(5.0), 1e-8 * steps);
  EXPECT_NEAR(y[1], -std::sin(5.0), 1e-8 * steps);
  EXPECT_LT(steps, 2000);
}

}  // namespace
}  // namespace flexspline::report_friction_blocks_test
