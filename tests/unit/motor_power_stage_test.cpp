// The twin's motor and power stage: closed forms, and the averaged model beside the switched one.
#include "hil/motor/power_stage.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <cstdio>

#include "hil/motor/shunts.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/unit/foc_rig.hpp"

namespace flexspline::motor::motor_power_stage_test {
namespace {

TEST(Motor, CurrentRisesAsAnExponentialOfItsWindingAtStandstill) {
  MotorParameters p;
  Motor m(p);
  for (int k = 0; k < 1000; ++k) m.step({1.0, 0.0}, {0.0, 0.0}, 1e-6);
  const double expected = 1.0 / p.resistance_ohm * -std::expm1(-1e-3 * p.resistance_ohm / p.inductance_d_h);
  EXPECT_NEAR(m.currents(0.0).d, expected, 1e-4 * expected);
  EXPECT_NEAR(m.currents(0.0).q, 0.0, 1e-9);
}

TEST(Motor, WhatItTakesIsWhatItTurnsStoresAndLosesWithSaliencySaturationAndHarmonics) {
  MotorParameters p;
  p.inductance_q_h = 0.45e-3;
  p.saturation_d_a = 60.0;
  p.saturation_q_a = 40.0;
  p.harmonic_5 = 0.04;
  p.harmonic_7 = 0.02;
  p.thermal_resistance_k_w = 1e9;
  p.heat_capacity_j_k = 1e12;
  Motor m(p);
  const double speed = kTurn * 100.0, dt = 0.2e-6;
  double angle = 0.0, in = 0.0, turned = 0.0, lost = 0.0;
  // A whole electrical turn in the steady state: what is stored is the same at both ends.
  const auto voltage = [&](double at) { return to_plane(Axes{-3.0, 8.0}, at); };
  const int turn = static_cast<int>(std::lround(1.0 / 100.0 / dt));
  for (int k = 0; k < 6 * turn; ++k) {
    if (k == 5 * turn) in = turned = lost = 0.0;
    const Axes before = m.currents(angle);
    const double torque = m.torque_nm(angle);
    const Plane v = voltage(angle);
    m.step(v, {angle, speed}, dt);
    angle += speed * dt;
    const Axes after = m.currents(angle), i = {(before.d + after.d) / 2.0, (before.q + after.q) / 2.0};
    const Axes u = to_axes(v, angle - speed * dt / 2.0);
    in += 1.5 * (u.d * i.d + u.q * i.q) * dt;
    lost += 1.5 * m.resistance_ohm() * (i.d * i.d + i.q * i.q) * dt;
    turned += (torque + m.torque_nm(angle)) / 2.0 * speed / p.pole_pairs * dt;
  }
  std::printf("energy of a turn: %.5f J in, %.5f turned, %.5f lost\n", in, turned, lost);
  EXPECT_NEAR(in, turned + lost, 1e-3 * in);
  EXPECT_GT(turned, 0.2 * in);
}

TEST(Motor, ItsWindingWarmsUpToWhatItsLossesAndThermalResistanceSay) {
  MotorParameters p;
  p.heat_capacity_j_k = 0.01;
  Motor m(p);
  for (int k = 0; k < 400'000; ++k) m.step({1.0, 0.0}, {0.0, 0.0}, 1e-6);
  const double i = m.currents(0.0).d, heat = 1.5 * m.resistance_ohm() * i * i;
  EXPECT_NEAR(m.temperature_c(), p.ambient_c + heat * p.thermal_resistance_k_w, 0.5);
  EXPECT_GT(m.temperature_c(), 25.0);
  EXPECT_NEAR(i, 1.0 / m.resistance_ohm(), 1e-3);
}

// Currents of both models under the same duties, as a difference over the amplitude.
double difference(const MotorParameters& p, const InverterParameters& inverter, double hertz, double volts) {
  SensorParameters sensors;
  PowerStage switched(p, inverter, sensors, Fidelity::switched), averaged(p, inverter, sensors, Fidelity::averaged);
  double angle = 0.0, square = 0.0, all = 0.0;
  const double speed = kTurn * hertz, period = switched.period_s();
  for (int k = 0; k < 3000; ++k) {
    const Triple u = to_phases(to_plane(Axes{0.0, volts}, angle + speed * period / 2.0));
    Triple duties{};
    for (std::size_t x = 0; x < 3; ++x) duties[x] = 0.5 + u[x] / inverter.supply_v;
    const Sample a = switched.run(duties, {angle, speed}), b = averaged.run(duties, {angle, speed});
    angle += speed * period;
    if (k < 1000) continue;
    square += std::pow(a.current.d - b.current.d, 2) + std::pow(a.current.q - b.current.q, 2);
    all += std::pow(a.current.d, 2) + std::pow(a.current.q, 2);
  }
  return std::sqrt(square / all);
}

TEST(PowerStage, TheAveragedModelIsWithinTwoPerCentOfTheSwitchedOne) {
  const MotorParameters p;
  InverterParameters ideal, real;
  ideal.dead_time_s = 0.0;
  const double a = difference(p, ideal, 100.0, 6.0), b = difference(p, real, 100.0, 6.0),
               c = difference(p, real, 5.0, 2.0), d = difference(p, real, 300.0, 14.0);
  std::printf(
      "averaged beside switched, currents: %.4f without dead time; with it %.4f at 100 Hz, %.4f at 5 Hz, %.4f at 300 "
      "Hz\n",
      a, b, c, d);
  EXPECT_LT(a, 0.01);
  EXPECT_LT(b, 0.02);
  EXPECT_LT(c, 0.02);
  EXPECT_LT(d, 0.02);
}

TEST(PowerStage, DeadTimeTakesItsShareOfTheBusFromEachLegThatCarriesCurrent) {
  // Standstill, current from a into b and c: a loses, b and c gain.
  MotorParameters p;
  p.resistance_ohm = 1.0;
  InverterParameters with, without;
  with.leg_capacitance_f = 1e-11;
  without.dead_time_s = 0.0;
  with.diode_drop_v = 0.0;
  PowerStage a(p, with, {}, Fidelity::switched), b(p, without, {}, Fidelity::switched);
  Sample x, y;
  const Triple duties{0.7, 0.4, 0.4};
  for (int k = 0; k < 400; ++k) {
    x = a.run(duties, {0.0, 0.0});
    y = b.run(duties, {0.0, 0.0});
  }
  const double share = with.dead_time_s * with.pwm_hz;
  EXPECT_NEAR((y.current.d - x.current.d) * (p.resistance_ohm + with.on_resistance_ohm), 4.0 / 3.0 * share * y.bus_v,
              0.04);
}

TEST(Shunts, AReadingHasTheSensorsOffsetGainStepsAndSettling) {
  SensorParameters s;
  s.offset_a = {0.5, 0.0, 0.0};
  s.gain = {1.0, 1.02, 1.0};
  Sample sample;
  sample.seen_a = {10.0, 10.0, 100.0};
  sample.bus_v = 48.0;
  const Readings r = Shunts(s, 1).read(sample);
  EXPECT_NEAR(r.current[0], 10.5 / 40.0 * 32768.0, 8.0);
  EXPECT_NEAR(r.current[1], 10.2 / 40.0 * 32768.0, 8.0);
  EXPECT_EQ(r.current[2], 32768 - 16);
  EXPECT_EQ(r.current[0] % 16, 0);
  EXPECT_NEAR(r.bus, 48.0 / 60.0 * 32768.0, 8.0);
}

TEST(Shunts, ALowSideThatIsOnForTooShortShowsTooLittle) {
  MotorParameters p;
  SensorParameters s;
  s.settling_s = 0.3e-6;
  PowerStage stage(p, {}, s, Fidelity::switched);
  Sample sample;
  for (int k = 0; k < 100; ++k) sample = stage.run({0.97, 0.9, 0.9}, {0.0, 0.0});
  // On for 0.03 of 50 us less the dead time: half of it before the sample.
  const double before = 0.015 * 50e-6 - 0.5e-6, share = -std::expm1(-before / 0.3e-6);
  const Triple i = to_phases({sample.current.d, sample.current.q});
  EXPECT_NEAR(sample.seen_a[0] / i[0], share, 0.05);
  EXPECT_NEAR(sample.seen_a[1] / i[1], 1.0, 0.01);
  for (int k = 0; k < 3; ++k) sample = stage.run({1.0, 0.9, 0.9}, {0.0, 0.0});
  EXPECT_EQ(sample.seen_a[0], 0.0);
}

}  // namespace
}  // namespace flexspline::motor::motor_power_stage_test
