// Wires, shorts, shaft and encoder of the twin's motor, against Kirchhoff's and Newton's laws.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <stdexcept>

#include "hil/motor/power_stage.hpp"
#include "hil/motor/shaft.hpp"

namespace flexspline::motor::motor_wiring_test {
namespace {

Sample after(PowerStage& stage, const Triple& duties, double speed, int periods) {
  Sample s;
  double angle = 0.4;
  for (int k = 0; k < periods; ++k) {
    s = stage.run(duties, {angle, speed});
    angle += speed * stage.period_s();
  }
  return s;
}

TEST(MotorWiring, AnOpenPhaseCarriesNoCurrentAndTheOthersThatOfTwoWindingsInSeries) {
  MotorParameters m;
  m.inductance_q_h = 2.0 * m.inductance_d_h;
  InverterParameters p;
  p.dead_time_s = 0.0;
  WiringParameters w;
  w.open = {false, true, false};
  PowerStage stage(m, p, {}, Fidelity::averaged, w);
  const Sample turning = after(stage, {0.52, 0.5, 0.48}, 300.0, 400);
  EXPECT_NEAR(turning.seen_a[1], 0.0, 1e-6);
  EXPECT_GT(std::abs(turning.seen_a[0]), 0.1);
  const Sample s = after(stage, {0.52, 0.5, 0.48}, 0.0, 4000);
  const double ohm = 2.0 * (m.resistance_ohm + p.on_resistance_ohm);
  EXPECT_NEAR(s.seen_a[0], 0.04 * s.bus_v / ohm, 1e-3);
  EXPECT_NEAR(s.seen_a[2], -s.seen_a[0], 1e-9);
}

TEST(MotorWiring, AShortBetweenPhasesCarriesItsOwnCurrentBesideTheMotors) {
  InverterParameters p;
  p.dead_time_s = 0.0;
  WiringParameters w;
  w.short_ohm = 0.1;
  w.short_from = 1;
  w.short_to = 2;
  PowerStage stage({}, p, {}, Fidelity::averaged, w);
  const Sample s = after(stage, {0.5, 0.51, 0.49}, 0.0, 4000);
  // Between b and c: the short and two windings side by side.
  const double motor = 2.0 * MotorParameters{}.resistance_ohm, both = 1.0 / (1.0 / motor + 1.0 / w.short_ohm);
  EXPECT_NEAR(s.seen_a[1], 0.02 * s.bus_v / (both + 2.0 * p.on_resistance_ohm), 0.01);
  EXPECT_NEAR(s.seen_a[0] + s.seen_a[1] + s.seen_a[2], 0.0, 1e-9);
}

TEST(MotorWiring, AShortToGroundMakesTheCurrentsAddUpToItsOwn) {
  InverterParameters p;
  p.dead_time_s = 0.0;
  WiringParameters w;
  w.ground_ohm = 0.5;
  w.ground_leg = 2;
  PowerStage stage({}, p, {}, Fidelity::averaged, w);
  const Sample s = after(stage, {0.1, 0.1, 0.1}, 0.0, 2000);
  EXPECT_NEAR(s.seen_a[0] + s.seen_a[1] + s.seen_a[2], 0.1 * s.bus_v / (0.5 + p.on_resistance_ohm), 0.2);
}

TEST(MotorWiring, TwoSwappedWiresTurnTheTorqueAround) {
  WiringParameters swapped;
  swapped.motor_phase = {0, 2, 1};
  PowerStage straight({}, {}, {}, Fidelity::averaged), crossed({}, {}, {}, Fidelity::averaged, swapped);
  // The stator's vector mirrored at phase a, on a rotor at zero.
  const Sample a = straight.run({0.5, 0.6, 0.4}, {0.0, 0.0}), b = crossed.run({0.5, 0.6, 0.4}, {0.0, 0.0});
  EXPECT_GT(a.torque_nm, 0.001);
  EXPECT_NEAR(b.torque_nm, -a.torque_nm, 1e-9);
}

TEST(MotorWiring, TheSwitchedModelRefusesWhatItDoesNotHave) {
  WiringParameters w;
  w.open = {true, false, false};
  EXPECT_THROW(PowerStage({}, {}, {}, Fidelity::switched, w), std::invalid_argument);
}

TEST(MotorShaft, FallsBehindByFrictionAndStaysWhereTheTorqueDoesNotBreakIt) {
  ShaftParameters p;
  p.viscous_nms = 0.0;
  Shaft shaft(p, 7);
  for (int k = 0; k < 1000; ++k) shaft.step(0.9 * p.coulomb_nm, 1e-4);
  EXPECT_EQ(shaft.speed_rad_s(), 0.0);
  for (int k = 0; k < 1000; ++k) shaft.step(3.0 * p.coulomb_nm, 1e-4);
  EXPECT_NEAR(shaft.speed_rad_s(), 2.0 * p.coulomb_nm / p.inertia_kg_m2 * 0.1, 1e-9);
  EXPECT_NEAR(shaft.electrical().angle, 7.0 * p.coulomb_nm / p.inertia_kg_m2 * 0.01, 1e-6);
  p.blocked = true;
  Shaft blocked(p, 7);
  blocked.step(100.0, 1e-4);
  EXPECT_EQ(blocked.turns(), 0.0);
}

TEST(MotorShaft, AnEncoderShowsItInSteps) {
  EncoderParameters p;
  p.counts_per_turn = 1000;
  p.reversed = true;
  p.offset_turns = 0.25;
  ShaftEncoder encoder(p);
  EXPECT_NEAR(std::ldexp(encoder.read(0.1), -32), 0.15, 0.001);
  EXPECT_EQ(encoder.read(0.1003), encoder.read(0.1004));
  p = {};
  p.slip_turns = 0.1;
  p.slip_every_turns = 0.5;
  ShaftEncoder slips(p);
  double last = 0.0;
  for (int k = 0; k <= 90; ++k) last = std::ldexp(slips.read(k * 0.01), -32);
  EXPECT_NEAR(last, 0.9 - 0.1, 0.001);
}

}  // namespace
}  // namespace flexspline::motor::motor_wiring_test
