// Field weakening, the circle of the current and the thermal limit.
#include "shared/control/foc/current_limits.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <cstdio>

#include "shared/fixed/turn.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::foc_rig::foc_limits_test {
namespace {

deployment::FocLimitSetup limits_of() {
  deployment::FocLimitSetup l;
  l.peak_a = 20.0;
  l.continuous_a = 8.0;
  l.thermal_s = 2.0;
  l.weakening_a = 12.0;
  l.highest_speed = kTurn * 600.0;
  return l;
}
double amperes(std::int32_t q27, double base = 40.0) {
  return std::ldexp(q27, -27) * base;
}

TEST(FocLimits, TheThermalLimitEndsAtTheContinuousCurrentAndNeverLetsTheHeatAboveIt) {
  const Bench b;
  const auto setup = setup_of(b);
  const foc::LimitSettings c = deployment::foc_limits(setup, limits_of());
  foc::LimitState s;
  double exact = 0.0, current = 0.0, peak_s = 0.0, most_heat = 0.0;
  for (int k = 0; k < 10 * 10'000; ++k) {
    const foc::RotorVector measured = {0, q27(current / 40.0)};
    const foc::Limits l = foc::limit_currents(s, c, {0, q27(0.9)}, measured, {0, 0}, 1 << 24, 5);
    exact += (current * current - exact) / (2.0 * 10e3);
    current = amperes(l.set_point.q);
    if (current > 19.9) peak_s += 1e-4;
    most_heat = std::max(most_heat, exact);
    ASSERT_LE(current, 20.01);
  }
  std::printf("I2t: 20 A for %.3f s, then %.3f A; heat at most %.4f of the continuous one\n", peak_s, current,
              most_heat / 64.0);
  EXPECT_NEAR(current, 8.0, 0.02);
  EXPECT_LT(most_heat, 64.0 * 1.002);
  // Up to 0.8 of 8^2 of 20^2: -ln(1 - 0.128) time constants.
  EXPECT_NEAR(peak_s, 0.274, 0.005);
  EXPECT_NEAR(std::ldexp(static_cast<double>(s.heat), -62) * 1600.0, exact, 0.01);
}

TEST(FocLimits, CoolingGivesThePeakBack) {
  const Bench b;
  const foc::LimitSettings c = deployment::foc_limits(setup_of(b), limits_of());
  foc::LimitState s;
  s.heat = std::uint64_t{c.continuous_square} << 32;
  EXPECT_NEAR(amperes(foc::heat_limit(c, s)), 8.0, 0.01);
  foc::Limits l;
  for (int k = 0; k < 10'000; ++k) l = foc::limit_currents(s, c, {0, q27(0.9)}, {0, 0}, {0, 0}, 1 << 24, 5);
  EXPECT_NEAR(amperes(l.current), 20.0, 0.01);
  EXPECT_FALSE(l.by_heat);
}

TEST(FocLimits, TheCircleHoldsForEverySetPointAndLeavesDFirst) {
  const Bench b;
  const foc::LimitSettings c = deployment::foc_limits(setup_of(b), limits_of());
  for (double d = -1.9; d <= 1.9; d += 0.1) {
    for (double q = -1.9; q <= 1.9; q += 0.1) {
      foc::LimitState s;
      const foc::Limits l = foc::limit_currents(s, c, {q27(d), q27(q)}, {0, 0}, {0, 0}, 1 << 24, 5);
      EXPECT_LE(std::hypot(amperes(l.set_point.d), amperes(l.set_point.q)), 20.0 * 1.0002);
      EXPECT_NEAR(amperes(l.set_point.d), std::clamp(40.0 * d, -20.0, 20.0), 0.002);
      if (std::hypot(40.0 * d, 40.0 * q) < 19.99) {
        EXPECT_NEAR(amperes(l.set_point.q), 40.0 * q, 0.002);
      }
    }
  }
}

// Torque at a speed whose back-EMF is above the voltage, with field weakening and without, at the rates of a drive.
struct Weakened {
  double torque = 0.0, d = 0.0, use = 0.0;
};
Weakened at_speed(double hertz, bool weakening) {
  Bench b;
  b.motor.flux_vs = 0.012;
  b.motor.inductance_d_h = b.motor.inductance_q_h = 0.5e-3;
  const auto setup = setup_of(b);
  auto limits = limits_of();
  if (!weakening) limits.weakening_a = 0.0;
  const foc::LimitSettings c = deployment::foc_limits(setup, limits);
  Rig rig(b, setup, motor::Fidelity::averaged, kTurn * hertz / 2.0);
  foc::LimitState s;
  foc::Limits l;
  Weakened w;
  constexpr int kTicks = 20'000, kMean = 2'000;
  for (int k = 0; k < kTicks; ++k) {
    rig.set_speed(kTurn * hertz * std::min(1.0, 0.5 + k / 8000.0));
    rig.step(amperes(l.set_point.d), amperes(l.set_point.q));
    const auto& o = rig.outputs();
    if (k % 2 == 0)
      l = foc::limit_currents(s, c, {0, q27(4.0 / 40.0)}, o.measured, o.wanted, o.most,
                              rig.settings().current.voltage_exponent);
    if (k < kTicks - kMean) continue;
    w.torque += rig.sample().torque_nm / kMean;
    w.d += rig.sample().current.d / kMean;
    w.use += std::hypot(o.wanted.d, o.wanted.q) / o.most / kMean;
  }
  return w;
}

TEST(FocLimits, FieldWeakeningKeepsTheTorqueAboveTheSpeedAtWhichTheVoltageEnds) {
  // 27.7 V of phase amplitude are reached at about 360 Hz by the back-EMF alone.
  const double wanted = 1.5 * 7 * 0.012 * 4.0;
  const Weakened slow = at_speed(200.0, true), with = at_speed(450.0, true), without = at_speed(450.0, false);
  std::printf("450 Hz: %.3f N m of %.3f with %.2f A in d, %.3f of the voltage; without field weakening %.3f N m\n",
              with.torque, wanted, with.d, with.use, without.torque);
  EXPECT_NEAR(slow.d, 0.0, 0.05);
  EXPECT_NEAR(slow.torque, wanted, 0.02 * wanted);
  EXPECT_NEAR(with.torque, wanted, 0.03 * wanted);
  EXPECT_NEAR(with.use, 0.95, 0.01);
  EXPECT_LT(with.d, -3.0);
  EXPECT_LT(without.torque, 0.5 * wanted);
}

}  // namespace
}  // namespace flexspline::foc_rig::foc_limits_test
