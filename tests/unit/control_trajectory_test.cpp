// Set points of position: limits that hold for every command, arrival to the last bit, times of a trapezoid known in
// closed form.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>
#include <vector>

#include "host/common/numbers/real.hpp"
#include "shared/control/limits.hpp"
#include "shared/control/trajectory.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/overflow_log.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests::control_trajectory_test {
namespace {

using control::RateLimiter;
using control::Trajectory;
using control::TrajectorySetup;
using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;

constexpr double kTickS = 1.0 / 16000.0;
constexpr std::int64_t kOneTurn = std::int64_t{1} << 32;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.velocity_base = 200.0;
  d.acceleration_base = 4000.0;
  d.angle_base = kTurn;
  d.time_base = kTickS;
  return d;
}
template <class N = Fixed>
Trajectory::Coefficients<N> limits(double velocity, double acceleration, double range_turns = 1e6) {
  TrajectorySetup<double> setup{velocity, acceleration};
  setup.highest = static_cast<std::int64_t>(range_turns * static_cast<double>(kOneTurn));
  setup.lowest = -setup.highest;
  return Trajectory::derive<N>(setup, drive());
}
// Position with its fraction, 2^-48 turns from zero; here below 8192 turns.
std::int64_t fine(const Trajectory::State& s) {
  return static_cast<std::int64_t>(s.position) * 65536 + s.fraction;
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}

struct Arrival {
  long ticks = 0;
  double peak = 0.0;  // velocity, rad/s
};
// Runs to the target; the position may not pass it, nor turn back.
Arrival go(Trajectory::State& s, const Trajectory::Coefficients<Fixed>& c, std::int64_t target) {
  Arrival a;
  const bool up = target > s.position;
  for (; a.ticks < 2'000'000 && !Trajectory::arrived(s, target); ++a.ticks) {
    const auto set = Trajectory::update(s, c, target);
    const std::int64_t left = static_cast<std::int64_t>(target) * 65536 - fine(s);
    EXPECT_TRUE(up ? left >= 0 && s.velocity >= 0 : left <= 0 && s.velocity <= 0) << "passed the target";
    a.peak = std::max(a.peak, std::abs(real(set.velocity)) * 200.0);
    if (testing::Test::HasFailure()) break;
  }
  return a;
}

TEST(Trajectory, ArrivesExactlyAtTheTimeOfATrapezoid) {
  const auto c = limits(150.0, 3000.0);
  Trajectory::State s = Trajectory::at(12345);
  const double distance = 40.0 * kTurn;
  const Arrival a = go(s, c, 12345 + 40 * kOneTurn);
  EXPECT_TRUE(Trajectory::arrived(s, 12345 + 40 * kOneTurn));
  // Up and down the ramps, and the rest at full speed: s/v + v/a.
  EXPECT_NEAR(static_cast<double>(a.ticks) * kTickS, distance / 150.0 + 150.0 / 3000.0, 2.5 * kTickS);
  EXPECT_NEAR(a.peak, 150.0, 1e-5);
}

TEST(Trajectory, ArrivesExactlyAtTheTimeOfATriangle) {
  const auto c = limits(150.0, 800.0);
  Trajectory::State s = Trajectory::at(0);
  const std::int64_t target = -kOneTurn / 3;
  const Arrival a = go(s, c, target);
  EXPECT_TRUE(Trajectory::arrived(s, target));
  const double distance = kTurn / 3.0;
  EXPECT_NEAR(static_cast<double>(a.ticks) * kTickS, 2.0 * std::sqrt(distance / 800.0), 3.0 * kTickS);
  EXPECT_NEAR(a.peak, std::sqrt(distance * 800.0), 800.0 * 2.0 * kTickS);
}

TEST(Trajectory, ArrivesWhateverTheDistance) {
  const auto c = limits(100.0, 2000.0);
  Trajectory::State s = Trajectory::at(0);
  std::mt19937_64 random(3);
  for (int i = 0; i < 60; ++i) {
    const std::int64_t step = (static_cast<std::int64_t>(random()) >> 27) >> (random() % 36);
    const std::int64_t target = s.position + step;
    go(s, c, target);
    ASSERT_TRUE(Trajectory::arrived(s, target)) << step;
  }
}

// While it slows down its acceleration is all that it may be, but for the last tick: no trembling.
TEST(Trajectory, SlowsDownAtItsLimitWithoutTrembling) {
  const auto c = limits(150.0, 3000.0);
  Trajectory::State s = Trajectory::at(0);
  const std::int64_t target = 20 * kOneTurn + 77;
  bool slowing = false;
  int uneven = 0;
  for (int k = 0; k < 100'000 && !Trajectory::arrived(s, target); ++k) {
    const std::int64_t before = s.velocity;
    Trajectory::update(s, c, target);
    slowing = slowing || s.velocity < before;
    const std::int64_t change = s.velocity - before;
    if (slowing && change > -c.change + c.change / 1000) ++uneven;
  }
  EXPECT_TRUE(slowing);
  EXPECT_LE(uneven, 3);
}

// Jumps of the target and of the speed at any tick, also out of the range.
TEST(Trajectory, KeepsToAllLimitsForAHundredThousandAdversarialCommands) {
  for (const auto& [velocity, acceleration] : {std::pair{150.0, 3000.0}, {20.0, 30.0}, {190.0, 900000.0}}) {
    const auto c = limits(velocity, acceleration, 0.25);
    Trajectory::State s = Trajectory::at(0);
    std::mt19937_64 random(7);
    std::int64_t target = 0, speed = c.velocity, largest = 0, furthest = 0;
    for (int k = 0; k < 100'000; ++k) {
      // Hectic and calm times, so that ends of the range are reached as well.
      const std::uint64_t dice = random() % ((k / 10'000) % 2 == 0 ? 100 : 20'000);
      if (dice < 2) target = static_cast<std::int64_t>(random()) >> (random() % 64);
      if (dice == 2) target = (random() % 2 == 0 ? -1 : 1) * kOneTurn;
      if (dice == 3) target = s.position + static_cast<std::int64_t>(random() % 2000) - 1000;
      if (dice == 4) speed = static_cast<std::int64_t>(random() >> (random() % 64) >> 1);
      if (dice == 5 || k % 20'000 == 10'000) speed = c.velocity;
      const std::int64_t before = s.velocity;
      const std::int64_t from = fine(s);
      Trajectory::update(s, c, target, speed);
      ASSERT_LE(std::abs(s.velocity), c.velocity);
      ASSERT_LE(std::abs(s.velocity - before), c.change);
      ASSERT_TRUE(fine(s) - from == s.velocity);
      ASSERT_TRUE(s.position >= c.lowest && (s.position < c.highest || (s.position == c.highest && s.fraction == 0)));
      ASSERT_EQ(s.steps, std::abs(s.velocity) / c.change);
      largest = std::max(largest, std::abs(s.velocity));
      furthest = std::max(furthest, std::abs(s.position));
    }
    // As fast as half the range allows.
    const double reached = std::min(velocity, std::sqrt(acceleration * 0.25 * kTurn)) / velocity;
    EXPECT_GT(static_cast<double>(largest), 0.9 * reached * static_cast<double>(c.velocity));
    EXPECT_EQ(furthest, kOneTurn / 4);
  }
}

// A new target that is too near to stop at is passed by the way that the acceleration limit needs, and reached then.
TEST(Trajectory, ComesBackToATargetThatIsTooNearToStopAt) {
  const auto c = limits(100.0, 1000.0);
  Trajectory::State s = Trajectory::at(0);
  for (int k = 0; k < 3200; ++k) Trajectory::update(s, c, 100 * kOneTurn);
  EXPECT_EQ(s.velocity, c.velocity);
  const std::int64_t target = s.position;
  std::int64_t furthest = target;
  int ticks = 0;
  for (; ticks < 100'000 && !Trajectory::arrived(s, target); ++ticks) {
    Trajectory::update(s, c, target);
    furthest = std::max(furthest, s.position);
  }
  EXPECT_TRUE(Trajectory::arrived(s, target));
  const double stop_turns = 100.0 * 100.0 / 2000.0 / kTurn;
  EXPECT_NEAR(std::ldexp(static_cast<double>(furthest - target), -32), stop_turns, 1.1 * 100.0 * kTickS / kTurn);
}

TEST(Trajectory, ACommandOfVelocityIsASpeedTowardsTheEndOfTheRange) {
  const auto c = limits(100.0, 2000.0, 5.0);
  Trajectory::State s = Trajectory::at(0);
  const std::int64_t speed = Trajectory::speed_of(c, Fixed::value(0.25));  // 50 rad/s
  Trajectory::SetPoint<Fixed> set;
  for (int k = 0; k < 2000; ++k) set = Trajectory::update(s, c, c.highest, speed);
  EXPECT_NEAR(real(set.velocity), 0.25, 1e-8);
  EXPECT_EQ(set.acceleration.raw, 0);
  for (int k = 0; k < 16'000; ++k) Trajectory::update(s, c, c.highest, speed);
  EXPECT_TRUE(Trajectory::arrived(s, 5 * kOneTurn));
}

// The motion is the same integers on the host; what it tells of velocity and acceleration agrees to the last bit of a
// signal.
TEST(Trajectory, OnADriveAgreesWithDouble) {
  const auto c = limits<Fixed>(150.0, 3500.0);
  const auto c_real = limits<Real>(150.0, 3500.0);
  const auto c_checked = limits<Checked>(150.0, 3500.0);
  Trajectory::State s = Trajectory::at(0), s_real = s, s_checked = s;
  OverflowLog::clear();
  double worst = 0.0, fastest = 0.0;
  for (int k = 0; k < 50'000; ++k) {
    const std::int64_t target = (k / 7000) % 2 == 0 ? 9 * kOneTurn + 5 : -3 * kOneTurn;
    const auto set = Trajectory::update(s, c, target);
    const auto exact = Trajectory::update(s_real, c_real, target);
    const auto checked = Trajectory::update(s_checked, c_checked, target);
    ASSERT_EQ(s.position, s_real.position);
    ASSERT_EQ(set.velocity.raw, checked.velocity.raw);
    ASSERT_EQ(std::ldexp(static_cast<double>(set.position.raw), -32), exact.position);
    worst = std::max(
        {worst, std::abs(real(set.velocity) - exact.velocity), std::abs(real(set.acceleration) - exact.acceleration)});
    fastest = std::max(fastest, exact.velocity);
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  EXPECT_LT(worst, 1e-8);
  EXPECT_GT(fastest, 0.74);
}

TEST(Trajectory, ReportsLimitsThatItCannotKeepTo) {
  for (const auto& [velocity, acceleration] : {std::pair{100.0, 1e-9}, {0.0, 100.0}, {100.0, 0.1}, {1e6, 1e6}}) {
    OverflowLog::clear();
    limits(velocity, acceleration);
    EXPECT_EQ(OverflowLog::count(), 1) << velocity << " " << acceleration;
  }
  OverflowLog::clear();
  limits(100.0, 1.0);
  EXPECT_EQ(OverflowLog::count(), 0);
}

TEST(RateLimiter, KeepsItsLimitsForAHundredThousandAdversarialInputsAndArrivesExactly) {
  std::mt19937_64 random(11);
  for (const double rate : {1e-9, 1e-3, 0.3, 5.0}) {
    const auto c = RateLimiter::derive<Checked>(1.5, rate / kTickS, 1.0, kTickS);
    const auto c_real = RateLimiter::derive<Real>(1.5, rate / kTickS, 1.0, kTickS);
    RateLimiter::State<Checked> s;
    RateLimiter::State<Real> s_real;
    OverflowLog::clear();
    double before = 0.0, worst = 0.0;
    fixed::Value last{};
    for (int k = 0; k < 100'000; ++k) {
      if (random() % 8 == 0) last.raw = static_cast<std::int32_t>(random()) >> (random() % 32);
      if (random() % 50 == 0) last.raw = random() % 2 == 0 ? INT32_MIN : INT32_MAX;
      const double now = real(RateLimiter::update<Checked>(s, c, {last}));
      const double exact = RateLimiter::update<Real>(s_real, c_real, real(last));
      ASSERT_LE(std::abs(now), 1.5);
      ASSERT_LE(std::abs(now - before), rate * (1.0 + 1e-9) + std::ldexp(1.0, -27));
      worst = std::max(worst, std::abs(now - exact));
      before = now;
    }
    EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
    EXPECT_LT(worst, 5e-9) << rate;
  }
  const auto c = RateLimiter::derive<Fixed>(1.5, 0.1 / kTickS, 1.0, kTickS);
  RateLimiter::State<Fixed> s;
  for (int k = 0; k < 8; ++k) RateLimiter::update<Fixed>(s, c, Fixed::value(0.7654321));
  EXPECT_EQ(RateLimiter::update<Fixed>(s, c, Fixed::value(0.7654321)).raw, Fixed::value(0.7654321).raw);
}

}  // namespace
}  // namespace flexspline::tests::control_trajectory_test
