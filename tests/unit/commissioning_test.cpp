// Commissioning of a few motors; the campaign has two hundred, and each fault many times.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>

#include "tests/support/commissioning_faults.hpp"

namespace flexspline::commissioning_rig::commissioning_test {
namespace {

TEST(Commissioning, FindsAMotorItsEncoderAndItsSensors) {
  std::mt19937_64 random(2);
  for (int k = 0; k < 4; ++k) {
    const Bench b = random_bench(random);
    const Outcome o = commission(b, setup_of(b));
    ASSERT_EQ(name_of(o.result.fault), "none") << k;
    const double g = common_gain(b);
    EXPECT_NEAR(o.found.resistance_ohm * g, b.motor.resistance_ohm + b.inverter.on_resistance_ohm,
                0.03 * b.motor.resistance_ohm);
    EXPECT_NEAR(o.found.inductance_d_h * g, b.motor.inductance_d_h, 0.05 * b.motor.inductance_d_h);
    EXPECT_NEAR(o.found.inductance_q_h * g, b.motor.inductance_q_h, 0.05 * b.motor.inductance_q_h);
    EXPECT_NEAR(o.found.flux_vs, b.motor.flux_vs, 0.02 * b.motor.flux_vs);
    EXPECT_EQ(o.found.pole_pairs, b.motor.pole_pairs);
    EXPECT_EQ(o.found.reversed, (b.wiring.motor_phase[1] == 2) != b.encoder.reversed);
    const double off = o.found.offset_turns - true_offset_turns(b);
    EXPECT_NEAR((off - std::round(off)) * 360.0, 0.0, 2.5);
    for (std::size_t x = 0; x < 3; ++x) {
      EXPECT_NEAR(o.found.gain[x] * b.sensors.gain[x], g, 0.003);
      EXPECT_NEAR(o.found.offset_a[x], b.sensors.offset_a[x], 0.05);
    }
    EXPECT_LT(o.most_current_a, 15.0);
  }
}

TEST(Commissioning, NamesEachFaultAndItsPhase) {
  for (const Fault fault : kBenchFaults) {
    std::mt19937_64 random(static_cast<std::uint64_t>(fault));
    const FaultCase c = random_fault(fault, random);
    const Outcome o = commission(c.bench, c.setup);
    EXPECT_EQ(name_of(o.result.fault), name_of(fault));
    if (c.phase != 0) {
      EXPECT_EQ(o.result.phase, c.phase) << name_of(fault);
    }
  }
}

// Reluctance turns such a rotor away from the current until the magnet's voltage across it cannot be told from that of
// the inductances at another current; against what the inductances give at a standing rotor it can.
TEST(Commissioning, ARotorThatReluctanceTurnsIsNotTakenForABlockedOne) {
  std::mt19937_64 random(31);
  for (int k = 0; k < 3; ++k) {
    FaultCase c = random_fault(Fault::encoder_stands, random);
    motor::MotorParameters& m = c.bench.motor;
    m.flux_vs = 0.002;
    m.inductance_d_h = 0.3e-3 + 0.25e-3 * k;
    m.inductance_q_h = 2.0 * m.inductance_d_h;
    c.bench.shaft.coulomb_nm = 0.15 * 1.5 * m.pole_pairs * m.flux_vs * 10.0;
    c.bench.shaft.inertia_kg_m2 = c.bench.shaft.coulomb_nm / 600.0;
    EXPECT_EQ(name_of(commission(c.bench, c.setup).result.fault), "encoder_stands") << k;
    c.bench.encoder.stands = false;
    c.bench.shaft.blocked = true;
    EXPECT_EQ(name_of(commission(c.bench, c.setup).result.fault), "rotor_blocked") << k;
  }
}

TEST(Commissioning, SwitchesOffAtOnceWhereACurrentPassesItsLimit) {
  const Bench b;
  commissioning::Commissioning control;
  control.begin(deployment::commissioning_settings(setup_of(b)));
  commissioning::Inputs in;
  in.bus = 26214;  // 48 V of 60
  commissioning::Outputs out;
  for (int k = 0; k < 200000 && control.step() < commissioning::Step::resistance; ++k) out = control.update(in);
  ASSERT_TRUE(out.enabled);
  in.readings = {14000, -7000, -7000};  // 17 A of 40
  out = control.update(in);
  EXPECT_FALSE(out.enabled);
  EXPECT_EQ(control.result().fault, Fault::overcurrent);
  EXPECT_EQ(control.result().phase, 1);
  EXPECT_FALSE(control.update({}).enabled) << "it stays off";
}

// All low sides on short-circuit a rotor that something turns.
TEST(Commissioning, SwitchesOffAtOnceWhereARotorThatIsDrivenMakesACurrentBeforeTheFirstVoltage) {
  const Bench b;
  const auto settings = deployment::commissioning_settings(setup_of(b));
  for (const int period : {0, 1, 500, 1200}) {
    commissioning::Commissioning control;
    control.begin(settings);
    commissioning::Inputs in;
    in.bus = 26214;
    for (int k = 0; k < period; ++k) ASSERT_TRUE(control.update(in).enabled);
    in.readings = {-8000, 16000, -8000};  // 19.5 A of 40
    EXPECT_FALSE(control.update(in).enabled) << period;
    EXPECT_NE(control.result().fault, Fault::none);
    EXPECT_EQ(control.result().phase, 2);
  }
  // The zero of a sensor may be off by its limit and is measured in these periods.
  commissioning::Commissioning control;
  control.begin(settings);
  commissioning::Inputs in;
  in.bus = 26214;
  in.readings = {settings.offsets.offset - 1, 0, 0};
  for (int k = 0; k < 500; ++k) ASSERT_TRUE(control.update(in).enabled);
}

TEST(Commissioning, WithTwoSensorsMeasuresTheSameMotor) {
  std::mt19937_64 random(8);
  Bench b = random_bench(random);
  b.sensors.gain = {1.0, 1.0, 0.0};
  auto setup = setup_of(b);
  setup.two_sensors = true;
  const Outcome o = commission(b, setup);
  ASSERT_EQ(name_of(o.result.fault), "none");
  EXPECT_NEAR(o.found.resistance_ohm, b.motor.resistance_ohm + b.inverter.on_resistance_ohm,
              0.03 * b.motor.resistance_ohm);
  EXPECT_NEAR(o.found.flux_vs, b.motor.flux_vs, 0.02 * b.motor.flux_vs);
  EXPECT_EQ(o.found.pole_pairs, b.motor.pole_pairs);
}

TEST(Commissioning, RefusesNumbersThatItCannotMeasureWith) {
  const Bench b;
  const auto refused = [&](auto change) {
    auto setup = setup_of(b);
    change(setup);
    EXPECT_THROW(deployment::commissioning_settings(setup), std::invalid_argument);
  };
  refused([](auto& s) { s.current_a = 0.5; });
  refused([](auto& s) { s.current_a = 35.0; });
  refused([](auto& s) { s.bus_v = 70.0; });
  refused([](auto& s) { s.voltage_share = 0.6; });
  refused([](auto& s) { s.fast_hz = 5.0; });
  refused([](auto& s) { s.pole_pairs = 99; });
  EXPECT_NO_THROW(deployment::commissioning_settings(setup_of(b)));
}

}  // namespace
}  // namespace flexspline::commissioning_rig::commissioning_test
