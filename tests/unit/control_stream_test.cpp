// Set points that a host streams, and handing a moving shaft over to the trajectory.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "host/common/numbers/real.hpp"
#include "shared/control/stream.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/fixed/turn.hpp"

namespace flexspline::tests::control_stream_test {
namespace {

using control::Stream;
using control::Trajectory;
using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;

constexpr double kTickS = 1.0 / 20000.0;

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.velocity_base = 200.0;
  d.acceleration_base = 5000.0;
  d.angle_base = kTurn;
  d.time_base = kTickS;
  return d;
}
template <class N>
Trajectory::Coefficients<N> limits(double turns = 1e6) {
  control::TrajectorySetup<double> s{.velocity_limit = 150.0, .acceleration_limit = 4000.0};
  s.lowest = -std::llround(std::ldexp(turns, 32));
  s.highest = -s.lowest;
  return Trajectory::derive<N>(s, drive());
}
fixed::Angle angle(double turns) {
  return {std::llround(std::ldexp(turns, 32))};
}

TEST(Stream, BetweenTwoSetPointsGoesOnAsAParabola) {
  const auto c = Stream::derive(drive());
  const auto l = limits<Fixed>();
  const double p = 3.7, v = -40.0, a = 900.0;
  auto s = Stream::at<Fixed>(c, l, angle(p), Fixed::value(v / 200.0), Fixed::value(a / 5000.0));
  for (int k = 0; k < 2000; ++k) {
    const auto point = Stream::update<Fixed>(s, l);
    const double t = k * kTickS;
    ASSERT_NEAR(std::ldexp(static_cast<double>(point.position.raw), -32), p + (v * t + a * t * t / 2.0) / kTurn, 1e-7);
    ASSERT_NEAR(std::ldexp(point.velocity.raw, -27) * 200.0, v + a * t, 1e-5);
    ASSERT_NEAR(std::ldexp(point.acceleration.raw, -27) * 5000.0, a, 1e-3);
  }
}

TEST(Stream, AHostAtAThousandthOfASecondGivesASineWithoutSteps) {
  const auto c = Stream::derive(drive());
  const auto l = limits<Fixed>();
  Stream::State s;
  const double w = kTurn * 2.0, amplitude = 1.2;
  double worst = 0.0, largest_step = 0.0, before = 0.0;
  for (int k = 0; k < 40'000; ++k) {
    const double t = k * kTickS;
    if (k % 20 == 0) {
      s = Stream::at<Fixed>(c, l, angle(amplitude * std::sin(w * t)),
                            Fixed::value(amplitude * kTurn * w * std::cos(w * t) / 200.0),
                            Fixed::value(-amplitude * kTurn * w * w * std::sin(w * t) / 5000.0));
    }
    const auto point = Stream::update<Fixed>(s, l);
    const double turns = std::ldexp(static_cast<double>(point.position.raw), -32);
    worst = std::max(worst, std::abs(turns - amplitude * std::sin(w * t)));
    if (k > 0) largest_step = std::max(largest_step, std::abs(turns - before));
    before = turns;
  }
  // What a parabola misses of a sine in a millisecond: a w^3 t^3/6.
  EXPECT_LT(worst, 1.05 * amplitude * std::pow(w * 1e-3, 3) / 6.0);
  EXPECT_LT(largest_step, 1.01 * amplitude * w * kTickS);
}

TEST(Stream, KeepsToTheLimitsWhateverTheHostSays) {
  const auto c = Stream::derive(drive());
  const auto l = limits<Checked>(5.0);
  OverflowLog::clear();
  std::mt19937_64 random(11);
  for (int i = 0; i < 300; ++i) {
    const auto any = [&] { return fixed::Value{static_cast<std::int32_t>(random())}; };
    auto s = Stream::at<Checked>(c, l, {static_cast<std::int64_t>(random())}, any(), any());
    for (int k = 0; k < 300; ++k) {
      const auto point = Stream::update<Checked>(s, l);
      ASSERT_LE(std::abs(point.position.raw), angle(5.0).raw);
      ASSERT_LE(std::abs(std::ldexp(point.velocity.raw, -27)), 150.001 / 200.0);
      ASSERT_LE(std::abs(std::ldexp(point.acceleration.raw, -27)), 4000.1 / 5000.0);
    }
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
}

TEST(Stream, OnADriveAgreesWithDouble) {
  const auto c = Stream::derive(drive());
  const auto l = limits<Fixed>();
  const auto l_real = limits<Real>();
  const fixed::Value v = Fixed::value(0.3), a = Fixed::value(-0.4);
  auto s = Stream::at<Fixed>(c, l, angle(-2.0), v, a);
  auto s_real = Stream::at<Real>(c, l_real, angle(-2.0), v, a);
  for (int k = 0; k < 5000; ++k) {
    const auto point = Stream::update<Fixed>(s, l);
    const auto exact = Stream::update<Real>(s_real, l_real);
    ASSERT_NEAR(std::ldexp(static_cast<double>(point.position.raw), -32), exact.position, 1e-12);
    ASSERT_NEAR(std::ldexp(point.velocity.raw, -27), exact.velocity / 200.0 * 200.0, 1.6e-8);
    ASSERT_NEAR(std::ldexp(point.acceleration.raw, -27), exact.acceleration, 1.6e-8);
  }
}

TEST(Trajectory, TakesOverAMovingShaftAndBringsItToTheTargetWithinItsLimits) {
  const auto l = limits<Fixed>();
  std::mt19937_64 random(5);
  for (int i = 0; i < 200; ++i) {
    const fixed::Value velocity{static_cast<std::int32_t>(random()) / 8};
    const std::int64_t speed = Trajectory::speed_of<Fixed>(l, velocity);
    auto s = Trajectory::moving<Fixed>(l, angle(1.0).raw, speed);
    const std::int64_t within = std::clamp(speed, -l.velocity, l.velocity);
    ASSERT_EQ(s.steps, std::abs(within) / l.change);
    ASSERT_EQ(s.velocity, within);
    std::int64_t before = s.velocity;
    for (int k = 0; k < 20'000 && !Trajectory::arrived(s, angle(1.5).raw); ++k) {
      Trajectory::update<Fixed>(s, l, angle(1.5).raw);
      ASSERT_LE(std::abs(s.velocity - before), l.change);
      before = s.velocity;
    }
    ASSERT_TRUE(Trajectory::arrived(s, angle(1.5).raw));
  }
}

}  // namespace
}  // namespace flexspline::tests::control_stream_test
