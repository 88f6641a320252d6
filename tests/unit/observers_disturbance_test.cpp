// The reading of an encoder, and the disturbance observer: closed forms, and the drive's numbers against double.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdint>
#include <random>

#include "host/common/numbers/real.hpp"
#include "shared/fixed/checked.hpp"
#include "shared/observers/disturbance.hpp"
#include "shared/observers/encoder_angle.hpp"

namespace flexspline::tests::observers_disturbance_test {
namespace {

using fixed::Checked;
using fixed::Fixed;
using fixed::OverflowLog;
using numbers::Real;
using observers::DisturbanceObserver;
using observers::EncoderAngle;

constexpr double kTickS = 1.0 / 20000.0;

TEST(EncoderAngle, IsExactForCountsThatDoNotDivideAPowerOfTwoHoweverFarItTurns) {
  for (const std::uint32_t counts : {4U, 10'000U, 16'384U, 1'000'003U, 1U << 24}) {
    const auto c = EncoderAngle::derive(counts);
    EncoderAngle::State s;
    EncoderAngle::update(s, c, 0);
    std::mt19937_64 random(counts);
    std::int64_t count = 0;
    std::uint32_t counter = 0;
    for (int k = 0; k < 200'000; ++k) {
      // One way for most of the time, so that the counter wraps.
      const auto step = static_cast<std::int32_t>(random() % counts) - static_cast<std::int32_t>(counts / 8);
      count += step;
      counter += static_cast<std::uint32_t>(step);
      const fixed::Angle angle = EncoderAngle::update(s, c, counter);
      const std::int64_t turns =
          count / static_cast<std::int64_t>(counts) - (count % static_cast<std::int64_t>(counts) < 0 ? 1 : 0);
      const std::int64_t rest = count - turns * static_cast<std::int64_t>(counts);
      const double fraction = std::ldexp(static_cast<double>(rest) / counts, 32);
      ASSERT_NEAR(static_cast<double>(angle.raw - turns * (std::int64_t{1} << 32)), fraction, 1.0);
    }
  }
}

TEST(EncoderAngle, StartsWhereAnAbsoluteEncoderStands) {
  const auto c = EncoderAngle::derive(1000);
  for (const std::int32_t start : {0, 250, 999, 1000, 12'345, -1, -250, -1000, -12'345}) {
    EncoderAngle::State s;
    const fixed::Angle angle = EncoderAngle::update(s, c, static_cast<std::uint32_t>(start));
    EXPECT_NEAR(std::ldexp(static_cast<double>(angle.raw), -32), start / 1000.0, 1e-9) << start;
    EXPECT_EQ(EncoderAngle::moved(s, static_cast<std::uint32_t>(start - 7)), -7);
  }
}

TEST(EncoderAngle, RefusesCountsThatNoEncoderHas) {
  for (const std::uint32_t counts : {0U, 3U, (1U << 24) + 1}) {
    OverflowLog::clear();
    EncoderAngle::derive(counts);
    EXPECT_EQ(OverflowLog::count(), 1) << counts;
  }
  OverflowLog::clear();
}

effects::DriveConstants<double> drive() {
  effects::DriveConstants<double> d;
  d.torque_base = 0.2;
  d.acceleration_base = 4000.0;
  d.time_base = kTickS;
  return d;
}
template <class N>
DisturbanceObserver::Coefficients<N> observer(double time_constant_s = 0.01) {
  return DisturbanceObserver::derive<N>(
      observers::DisturbanceSetup<double>{.inertia = 1e-4, .time_constant_s = time_constant_s, .limit = 0.38}, drive());
}
double real(fixed::Value x) {
  return std::ldexp(x.raw, -fixed::kValueBits);
}

TEST(DisturbanceObserver, AStepShowsAsAnExponentialOfItsTimeConstant) {
  for (const double time_constant_s : {0.001, 0.01, 0.5}) {
    const auto c = observer<Fixed>(time_constant_s);
    DisturbanceObserver::State<Fixed> s;
    const double step = 0.07;
    for (int k = 1; k <= 20'000; ++k) {
      const auto d = DisturbanceObserver::update<Fixed>(s, c, Fixed::value(step / 0.2), {}, {});
      ASSERT_NEAR(real(d) * 0.2, step * (1.0 - std::exp(-k * kTickS / time_constant_s)), 1e-8);
    }
  }
}

TEST(DisturbanceObserver, WhatTheModelAndTheInertiaExplainIsNone) {
  const auto c = observer<Fixed>();
  DisturbanceObserver::State<Fixed> s;
  for (int k = 0; k < 10'000; ++k) {
    const double acceleration = 900.0 * std::sin(k * 0.003), friction = 0.03 * std::cos(k * 0.001);
    const double torque = 1e-4 * acceleration + friction;
    const auto d = DisturbanceObserver::update<Fixed>(s, c, Fixed::value(torque / 0.2), Fixed::value(friction / 0.2),
                                                      Fixed::value(acceleration / 4000.0));
    ASSERT_NEAR(real(d), 0.0, 3e-8);
  }
}

TEST(DisturbanceObserver, OnADriveAgreesWithDoubleOverItsEnvelopeAndStaysWithinItsLimit) {
  const auto c = observer<Fixed>();
  const auto c_checked = observer<Checked>();
  const auto c_real = observer<Real>();
  DisturbanceObserver::State<Fixed> s;
  DisturbanceObserver::State<Checked> s_checked;
  DisturbanceObserver::State<Real> s_real;
  OverflowLog::clear();
  std::mt19937_64 random(3);
  double worst = 0.0, largest = 0.0;
  double in[3] = {};
  for (int k = 0; k < 200'000; ++k) {
    if (k % 50 == 0)
      for (double& x : in) x = 4.0 * std::ldexp(static_cast<double>(random() >> 11), -53) - 2.0;
    const auto d =
        DisturbanceObserver::update<Fixed>(s, c, Fixed::value(in[0]), Fixed::value(in[1]), Fixed::value(in[2]));
    const auto checked = DisturbanceObserver::update<Checked>(s_checked, c_checked, Checked::value(in[0]),
                                                              Checked::value(in[1]), Checked::value(in[2]));
    const double exact = DisturbanceObserver::update<Real>(s_real, c_real, in[0], in[1], in[2]);
    ASSERT_EQ(d.raw, checked.raw);
    worst = std::max(worst, std::abs(real(d) - exact));
    largest = std::max(largest, std::abs(real(d)));
  }
  EXPECT_EQ(OverflowLog::count(), 0) << OverflowLog::first();
  EXPECT_LT(worst, 3e-8);
  EXPECT_GT(largest, 1.0);
  EXPECT_LE(largest, 1.9 + 1e-8);
}

}  // namespace
}  // namespace flexspline::tests::observers_disturbance_test
