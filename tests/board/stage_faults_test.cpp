// Faults of wires, sensors and supplies around the real images: each by its name.
#include <gtest/gtest.h>

#include <memory>
#include <string>

#include "tests/board/stage_boards.hpp"

namespace flexspline::tests {
namespace {

using control::commissioning::Fault;

std::unique_ptr<StageBench> bench_of(bool is_odrive, const motor::WiringParameters& wires) {
  std::unique_ptr<StageBench> bench;
  if (is_odrive) {
    bench = std::make_unique<OdriveBench>(some_motor(), motor::ShaftParameters{}, 24.0, wires);
  } else {
    bench = std::make_unique<NucleoBench>("ihm08m1", some_motor(), motor::ShaftParameters{}, wires);
  }
  bench->come_up();
  return bench;
}
protocol::CommissioningProgress measured(StageBench& bench) {
  return measure(bench, setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 8.0));
}

TEST(BoardStageFaults, AnOpenWireIsNamedWithItsPhase) {
  for (const bool is_odrive : {false, true})
    for (std::size_t leg = 0; leg < 3; ++leg) {
      motor::WiringParameters wires;
      wires.open[leg] = true;
      const auto bench = bench_of(is_odrive, wires);
      const auto end = measured(*bench);
      EXPECT_EQ(end.state, CommissioningState::fault) << is_odrive << leg;
      EXPECT_EQ(end.fault, Fault::phase_open) << deployment::commissioning_fault_text(end.fault).name;
      // The ODrive's leg B is phase a, C is b, A is c.
      EXPECT_EQ(end.phase, 1 + (is_odrive ? (leg + 2) % 3 : leg));
      EXPECT_FALSE(bench->chip.tim1.outputs_on());
    }
}

TEST(BoardStageFaults, NoMotorADeadSensorAndACrossedOneAreNamed) {
  motor::WiringParameters nothing;
  nothing.open = {true, true, true};
  for (const bool is_odrive : {false, true})
    EXPECT_EQ(measured(*bench_of(is_odrive, nothing)).fault, Fault::not_connected) << is_odrive;
  NucleoBench dead;
  dead.come_up();
  dead.wiring.has_shunt[1] = false;  // its input stays where it is
  const auto end = measured(dead);
  EXPECT_EQ(end.fault, Fault::current_sum) << deployment::commissioning_fault_text(end.fault).name;
  EXPECT_EQ(end.phase, 2);
  NucleoBench crossed;
  crossed.come_up();
  std::swap(crossed.wiring.currents[0], crossed.wiring.currents[1]);
  EXPECT_EQ(measured(crossed).fault, Fault::sensor_order);
  NucleoBench inverted;
  inverted.come_up();
  inverted.wiring.currents_fall = false;  // an amplifier of the other sign
  EXPECT_EQ(measured(inverted).fault, Fault::sensor_order);
}

// On the board whose legs are in another order than its phases; stage_test.cpp measures on the other one.
TEST(BoardStageFaults, TwoSwappedWiresTurnTheEncoderTheOtherWayAndNothingElse) {
  motor::WiringParameters wires;
  wires.motor_phase = {1, 0, 2};
  const auto bench = bench_of(true, wires);
  ASSERT_EQ(measured(*bench).state, CommissioningState::done);
  EXPECT_TRUE(result_of(*bench).reversed);
  EXPECT_EQ(result_of(*bench).pole_pairs, some_motor().pole_pairs);
}

// What happens to a motor that turns, and what the drive says.
struct Happens {
  const char* what;
  protocol::StageFault fault;
  void (*make)(StageBench&);
};
TEST(BoardStageFaults, WhatHappensWhileItTurnsOpensTheSwitchesAndHasItsName) {
  using protocol::StageFault;
  constexpr Happens kAll[] = {
      {"a wire falls off", StageFault::phase_lost,
       [](StageBench& b) {
         motor::WiringParameters wires;
         wires.open[1] = true;
         b.power.set_wiring(wires);
       }},
      {"the supply is switched off", StageFault::bus_low, [](StageBench& b) { b.power.set_supply_v(3.0); }},
      {"the thermistor's wire breaks", StageFault::thermistor_open,
       [](StageBench& b) { b.wiring.temperature_share = 0.0; }},
      {"the thermistor is shorted", StageFault::thermistor_shorted,
       [](StageBench& b) { b.wiring.temperature_share = 1.0; }},
      // 10 kiloohm are 0.63 at 110 degrees Celsius.
      {"the power stage gets hot", StageFault::hot,
       [](StageBench& b) { b.wiring.temperature_share = 4.7 / (0.63 + 4.7); }},
      {"the shield's comparators trip", StageFault::driver, [](StageBench& b) { b.chip.tim1.trip(); }},
      {"a current amplifier goes to its rail", StageFault::overcurrent,
       [](StageBench& b) { b.wiring.zero_share = -1.0; }},
  };
  const Turned turned(nucleo());
  NucleoBench first("ihm08m1", turned.motor, turned.shaft);
  first.come_up();
  const control::MotorSettings found = motor_found(first, 5.0);
  // A load of 2.2 A: a phase without current is only missed where the others have some.
  motor::ShaftParameters loaded = turned.shaft;
  loaded.coulomb_nm = 0.12;
  for (const Happens& h : kAll) {
    NucleoBench bench("ihm08m1", turned.motor, loaded);
    store(SectorsPort<0x20000>(bench.chip.flash), turned.block(found, 31.842, 15.0));
    bench.come_up();
    bench.chip.periods(1200);
    const auto constants = board::constants_of(turned.drive, 10'000);
    ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                             .mode = Mode::velocity,
                             .velocity = per_unit(60.0, constants.velocity_base)}),
              protocol::Refusal::none);
    run_with_host(bench, 0.1);
    ASSERT_TRUE(bench.is_on()) << h.what;
    h.make(bench);
    run_with_host(bench, 0.05);
    EXPECT_FALSE(bench.is_on()) << h.what;
    const auto status = bench.status();
    EXPECT_EQ(protocol::fault_text(status.fault).name, "amplifier_fault") << h.what;
    EXPECT_EQ(status.fault_limit, static_cast<int>(h.fault))
        << h.what << ": " << protocol::stage_fault_text(status.fault_limit).name;
    bench.expect_no_violation();
  }
}

}  // namespace
}  // namespace flexspline::tests
