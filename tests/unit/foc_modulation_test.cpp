// Space-vector modulation against the textbook's sectors, its bound, its pulses, and the compensation of the dead time.
#include "shared/control/foc/modulation.hpp"

#include <gtest/gtest.h>

#include <algorithm>
#include <array>
#include <cmath>
#include <complex>
#include <cstdio>

#include "shared/fixed/turn.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::foc_rig::foc_modulation_test {
namespace {

constexpr int kCounts = 1 << 20;  // so that counts do not hide what the duties are

foc::ModulationSettings bare_settings(double pulse = 0.0, double window = 0.0) {
  foc::ModulationSettings c;
  c.pulse = static_cast<std::int32_t>(std::lround(std::ldexp(pulse, foc::kDutyBits)));
  c.window = static_cast<std::int32_t>(std::lround(std::ldexp(window, foc::kDutyBits)));
  c.period = kCounts * 4;
  return c;
}
struct Duties {
  motor::Triple of{};
  int unmeasured = 0;
};
// A vector in shares of the bus voltage, which is 0.8 of full scale.
Duties duties_of(const foc::ModulationSettings& c, double size, double angle) {
  const std::int32_t bus = 26214;
  const auto q28 = [&](double x) { return static_cast<std::int32_t>(std::lround(std::ldexp(x * bus / 32768.0, 28))); };
  const foc::Pulses p =
      foc::modulate(c, {q28(size * std::cos(angle)), q28(size * std::sin(angle))}, foc::per_bus(bus), {});
  return {{p.counts.a / double{kCounts}, p.counts.b / double{kCounts}, p.counts.c / double{kCounts}}, p.unmeasured};
}
// By sectors: times of the two active vectors, the rest in halves to both zero vectors.
motor::Triple by_sectors(double size, double angle) {
  const double sixth = kTurn / 6.0;
  const int sector = static_cast<int>(angle / sixth) % 6;
  const double in = angle - sector * sixth;
  const double first = std::sqrt(3.0) * size * std::sin(sixth - in), second = std::sqrt(3.0) * size * std::sin(in);
  const double zero = 1.0 - first - second;
  static constexpr int kActive[6][3] = {{1, 0, 0}, {1, 1, 0}, {0, 1, 0}, {0, 1, 1}, {0, 0, 1}, {1, 0, 1}};
  motor::Triple duty{};
  for (int x = 0; x < 3; ++x)
    duty[static_cast<std::size_t>(x)] = zero / 2.0 + first * kActive[sector][x] + second * kActive[(sector + 1) % 6][x];
  return duty;
}

TEST(FocModulation, ItsDutiesAreThoseOfTheSpaceVectorsSectors) {
  double worst = 0.0;
  for (const double size : {0.0, 0.1, 0.3, 0.5, 0.577}) {
    for (double angle = 0.001; angle < kTurn; angle += 0.01) {
      const Duties d = duties_of(bare_settings(), size, angle);
      const motor::Triple expected = by_sectors(size, angle);
      for (std::size_t x = 0; x < 3; ++x) worst = std::max(worst, std::abs(d.of[x] - expected[x]));
    }
  }
  std::printf("duties by sectors: %.1e of a period apart at most\n", worst);
  EXPECT_LT(worst, 5e-5);  // of the bus voltage's reciprocal, 17 bits
}

TEST(FocModulation, WhatTheLoopAsksForAtItsLimitIsWithinOnePerCentOfTheBound) {
  Bench b;
  b.inverter.dead_time_s = 0.0;
  b.inverter.supply_resistance_ohm = 1e-4;
  b.motor.flux_vs = 0.05;
  b.motor.resistance_ohm = 1.0;
  // Driven against a back-EMF of more than there is, for a current that the voltage does not reach.
  Rig rig(b, setup_of(b), motor::Fidelity::averaged, kTurn * 90.0);
  for (int k = 0; k < 2000; ++k) rig.step(0.0, 30.0);
  double least = 1.0, most = 0.0;
  for (int k = 0; k < 2000; ++k) {
    rig.step(0.0, 30.0);
    const motor::Plane u = motor::to_plane(rig.duties());
    const double share = std::hypot(u.alpha, u.beta) * std::sqrt(3.0);
    least = std::min(least, share);
    most = std::max(most, share);
  }
  std::printf("modulation at its limit: %.4f to %.4f of 1/sqrt(3) of the bus voltage\n", least, most);
  EXPECT_GT(least, 0.99);
  EXPECT_LT(most, 1.001);
}

TEST(FocModulation, NoPulseIsShorterThanTheShortestAndTwoPhasesCanAlwaysBeSampled) {
  const double pulse = 0.01, window = 0.04;
  const foc::ModulationSettings c = bare_settings(pulse, window);
  double worst = 0.0;
  int clamped = 0, reconstructed = 0;
  for (double size = 0.0; size < (1.0 - pulse) / std::sqrt(3.0); size += 0.01) {
    for (double angle = 0.0; angle < kTurn; angle += 0.01) {
      const Duties d = duties_of(c, size, angle);
      const motor::Triple ideal = by_sectors(size, angle);
      int sampled = 0;
      for (std::size_t x = 0; x < 3; ++x) {
        EXPECT_TRUE(d.of[x] == 0.0 || d.of[x] > pulse - 2e-6) << d.of[x];
        EXPECT_TRUE(1.0 - d.of[x] > pulse - 1e-4) << d.of[x];
        if (static_cast<int>(x) + 1 != d.unmeasured && 1.0 - d.of[x] > window - 1e-5) ++sampled;
        const std::size_t y = (x + 1) % 3;
        worst = std::max(worst, std::abs(d.of[x] - d.of[y] - (ideal[x] - ideal[y])));
        clamped += d.of[x] == 0.0 ? 1 : 0;
      }
      EXPECT_GE(sampled, 2);
      reconstructed += d.unmeasured != 0 ? 1 : 0;
    }
  }
  EXPECT_LT(worst, 1e-4);
  EXPECT_GT(clamped, 100);
  EXPECT_GT(reconstructed, 100);
}

// Amplitudes of the torque at orders 6, 12, 18 and 24 of the electrical turn, as a share of its mean, by a current loop
// or (`loop` false) by a voltage that turns with the rotor.
double ripple(const Bench& b, const deployment::FocSetup& setup, double hertz, double current, bool loop) {
  constexpr int kTurns = 3;
  const double period = 1.0 / b.inverter.pwm_hz;
  const int settling_ticks = static_cast<int>(1.0 / hertz / period / 2.0);
  // Whole turns to the sample, or the mean would show in the amplitudes.
  const int samples = static_cast<int>(std::lround(kTurns / hertz / period));
  Rig rig(b, setup, motor::Fidelity::switched, kTurn * hertz);
  motor::PowerStage stage(b.motor, b.inverter, b.sensors, motor::Fidelity::switched);
  const foc::Settings settings = deployment::foc_settings(setup);
  motor::Triple duties{0.5, 0.5, 0.5};
  double angle = 0.0, mean = 0.0;
  std::array<std::complex<double>, 4> amplitude{};
  for (int k = 0; k < settling_ticks + samples; ++k) {
    double torque = 0.0;
    if (loop) {
      torque = rig.step(0.0, current).torque_nm;
    } else {
      const motor::Sample s = stage.run(duties, {angle, kTurn * hertz * 1.0});
      torque = s.torque_nm;
      angle += kTurn * hertz * period;
      // The voltage that the winding needs, in the middle of the next period.
      const double v =
          current * (b.motor.resistance_ohm + b.inverter.on_resistance_ohm) + kTurn * hertz * b.motor.flux_vs;
      const motor::Plane u = motor::to_plane(motor::Axes{0.0, v}, angle + kTurn * hertz * period / 2.0);
      const motor::Triple i = motor::to_phases(motor::to_plane(s.current, angle + kTurn * hertz * period / 2.0));
      const auto q28 = [&](double x) {
        return static_cast<std::int32_t>(std::lround(std::ldexp(x / b.sensors.bus_full_scale_v, 28)));
      };
      const auto bus = static_cast<std::int32_t>(s.bus_v / b.sensors.bus_full_scale_v * 32768.0);
      const double base = b.sensors.full_scale_a;
      const foc::Pulses p = foc::modulate(settings.modulation, {q28(u.alpha), q28(u.beta)}, foc::per_bus(bus),
                                          {q27(i[0] / base) / 4, q27(i[1] / base) / 4, q27(i[2] / base) / 4});
      duties = {p.counts.a / 4200.0, p.counts.b / 4200.0, p.counts.c / 4200.0};
    }
    if (k < settling_ticks) continue;
    mean += torque / samples;
    for (std::size_t n = 0; n < 4; ++n)
      amplitude[n] += torque * std::polar(2.0 / samples, -kTurn * hertz * 6.0 * static_cast<double>(n + 1) *
                                                             (k - settling_ticks) * period);
  }
  double square = 0.0;
  for (const auto& a : amplitude) square += std::norm(a);
  return std::sqrt(square) / std::abs(mean);
}

TEST(FocDeadTime, CompensationTakesTheTorqueRippleAtLowSpeedDownTenfoldByAVoltage) {
  Bench b;
  b.motor.resistance_ohm = 0.5;
  auto with = setup_of(b), without = with;
  without.dead_time_s = 0.0;
  const double before = ripple(b, without, 5.0, 5.0, false), after = ripple(b, with, 5.0, 5.0, false);
  std::printf("dead time, by a voltage, 5 Hz, 5 A: ripple %.4f of the mean torque without, %.5f with: %.1f times\n",
              before, after, before / after);
  EXPECT_GT(before, 0.02);
  EXPECT_GT(before / after, 10.0);
}

// Of the ripple, in a current loop at 20 Hz and 5 A, the share of that by a voltage without compensation.
struct RippleInLoop {
  double without = 0.0, with = 0.0;
};
RippleInLoop ripple_in_loop(const deployment::Corrections& corrections) {
  Bench b;
  b.motor.resistance_ohm = 0.5;
  b.sensors.bits = 16;
  auto with = setup_of(b);
  with.corrections = corrections;
  auto without = with;
  without.dead_time_s = 0.0;
  const double by_voltage = ripple(b, without, 20.0, 5.0, false);
  const RippleInLoop found = {ripple(b, without, 20.0, 5.0, true) / by_voltage,
                              ripple(b, with, 20.0, 5.0, true) / by_voltage};
  std::printf("dead time, 20 Hz, 5 A: of the ripple by a voltage, %.5f in the loop, %.5f with compensation\n",
              found.without, found.with);
  return found;
}

// The loop takes most of it out by itself; what compensation adds is near the steps of a converter of 16 bits.
TEST(FocDeadTime, TheCurrentLoopLeavesLessThanATenthOfItAndCompensationHalvesThatOrMore) {
  const RippleInLoop found = ripple_in_loop(deployment::usual_corrections(40e3, 1000.0));
  EXPECT_LT(found.without, 1.0 / 10.0);
  EXPECT_LT(found.with, found.without / 2.0);
}
TEST(FocDeadTime, TheLargerGainsOfALowRateLeaveLessThanAHundredthOfItAndCompensationTakesMore) {
  const RippleInLoop found = ripple_in_loop(deployment::usual_corrections(20e3, 1000.0));
  EXPECT_LT(found.without, 1.0 / 100.0);
  EXPECT_LT(found.with, found.without / 1.2);
}

}  // namespace
}  // namespace flexspline::foc_rig::foc_modulation_test
