// The ODrive v3.6: its gate driver, two shunts, its brake resistor, USB.
#include <gtest/gtest.h>

#include <algorithm>
#include <string>

#include "tests/board/stage_boards.hpp"
#include "tests/board/usb_bus.hpp"

namespace flexspline::tests {
namespace {

TEST(BoardOdrive, SetsItsGateDriverUpAndHoldsAllSwitchesOpen) {
  OdriveBench bench;
  bench.come_up();
  Chip& chip = bench.chip;
  EXPECT_EQ(chip.clock.core_hz(), 168e6);
  EXPECT_TRUE(chip.ports[1].high(12)) << "its enable";
  EXPECT_EQ(chip.spi3.control(0), (21U << 6) | (1U << 4)) << "overcurrent at 0.73 V, latched; six inputs";
  EXPECT_EQ(chip.spi3.control(1), 2U << 2) << "amplifiers of 40";
  EXPECT_LE(chip.spi3.clock_hz(chip.clock.apb1_hz()), 10e6);
  EXPECT_FALSE(chip.tim1.outputs_on());
  EXPECT_NEAR((chip.tim1.at(0x44) & 0x7F) / timer_hz(chip), 240e-9, 10e-9);
  for (const std::uint32_t channel : {1U, 2U, 3U}) {
    EXPECT_EQ(chip.tim1.at(0x20) >> (4 * (channel - 1)) & 15, 5U) << "active high, both";
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, false));
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, true));
  }
  const double instant = chip.tim1.trigger_us(timer_hz(chip)) + chip.converter.sample_us(chip.clock.apb2_hz());
  EXPECT_NEAR(instant, chip.tim1.top_us(timer_hz(chip)), 0.01) << "held in the middle of the low sides' time";
  EXPECT_EQ(bench.brake_high(), 0.0);
  EXPECT_EQ(bench.status().mode, Mode::idle);
  bench.expect_no_violation();
}

TEST(BoardOdrive, WithAGateDriverThatDoesNotHoldItsSettingsItNeverSwitchesOn) {
  for (const bool absent : {false, true}) {
    OdriveBench bench;
    (absent ? bench.chip.spi3.is_absent : bench.chip.spi3.forgets) = true;
    bench.come_up();
    const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 6.0);
    bench.ask(Kind::commissioning_begin, begin_of(setup));
    bench.chip.periods(10);
    EXPECT_FALSE(bench.chip.tim1.outputs_on());
    EXPECT_EQ(bench.status().fault_limit, static_cast<int>(protocol::StageFault::driver));
  }
}

TEST(BoardOdrive, MeasuresAMotorWithTwoShunts) {
  OdriveBench bench;
  bench.come_up();
  const auto stage = bench.get<protocol::CommissioningStage>(Kind::commissioning_stage);
  EXPECT_TRUE(stage.two_sensors);
  expect_measured(bench, some_motor(), 8.0);
}

TEST(BoardOdrive, ItsMotorTurnsAndAnOvercurrentOfTheDriverIsAFaultThatAResetEnds) {
  const Turned turned(odrive());
  control::MotorSettings found;
  {
    OdriveBench bench(turned.motor, turned.shaft);
    bench.come_up();
    found = motor_found(bench, 8.0);
  }
  OdriveBench bench(turned.motor, turned.shaft);
  store(SectorsPort<0x4000>(bench.chip.flash), turned.block(found, 82.5, 40.0));
  bench.come_up();
  ASSERT_TRUE(bench.status().has_parameters);
  bench.chip.periods(1200);
  const auto constants = board::constants_of(turned.drive, 10'000);
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                           .mode = Mode::velocity,
                           .velocity = per_unit(-80.0, constants.velocity_base)}),
            protocol::Refusal::none);
  run_with_host(bench, 0.4);
  EXPECT_NEAR(bench.rotor.speed_rad_s(), -80.0, 4.0);
  expect_loop_within(bench, 1000);
  bench.chip.spi3.overcurrent = true;
  bench.chip.periods(2);
  bench.chip.spi3.overcurrent = false;
  bench.chip.periods(4);
  EXPECT_FALSE(bench.chip.tim1.outputs_on());
  const auto status = bench.status();
  EXPECT_EQ(protocol::fault_text(status.fault).name, "amplifier_fault");
  EXPECT_EQ(status.fault_limit, static_cast<int>(protocol::StageFault::driver));
  bench.chip.periods(50);
  EXPECT_TRUE(bench.chip.spi3.is_good()) << "the reset of its latch";
  EXPECT_EQ(bench.chip.spi3.control(0), (21U << 6) | (1U << 4)) << "its settings stay";
  bench.expect_no_violation();
}

TEST(BoardOdrive, ABusAboveItsLimitGoesIntoTheBrakeResistorWithADeadTime) {
  for (const double volt : {48.0, 52.5, 55.0}) {
    OdriveBench bench(some_motor(), {}, volt);
    bench.come_up();
    bench.chip.periods(10);
    const double wanted = volt < 51.0 ? 0.0 : std::min(0.9, 0.9 * (volt - 51.0) / 3.0);
    EXPECT_NEAR(bench.brake_high(), wanted, 0.02) << volt;
    if (wanted > 0.0) {
      EXPECT_NEAR(bench.brake_gap_us(), 0.5, 0.02);
    }
    EXPECT_FALSE(bench.is_on());
    bench.expect_no_violation();
  }
}

TEST(BoardOdrive, UsbWorksWithoutAPinThatSensesItsPower) {
  OdriveBench bench;
  ASSERT_EQ(bench.chip.start(), Stop::waits) << bench.chip.machine.where();
  UsbBus bus(bench.chip);
  ASSERT_TRUE(bus.enumerate());
  bench.chip.periods(300);
  EXPECT_EQ(bus.code(Kind::identify, protocol::Hello{}), protocol::Code::done);
  EXPECT_EQ(bench.chip.ports[0].mode(9), 2U) << "PA9 drives a switch";
  bench.expect_no_violation();
}

TEST(BoardOdrive, ItsBootLoaderWaitsForAnImageOverUsbWithItsGateDriverOff) {
  Chip chip(
      std::string(FLEXSPLINE_BOARDS) + "/odrive_v36/odrive-boot.elf",
      {.address = 0x0800C000,
       .sectors = {
           {3, 0, 0x4000}, {4, 0x4000, 0x10000}, {5, 0x14000, 0x20000}, {6, 0x34000, 0x20000}, {7, 0x54000, 0x20000}}});
  ASSERT_EQ(chip.start(), Stop::waits) << chip.machine.where();
  UsbBus bus(chip);
  ASSERT_TRUE(bus.enumerate());
  EXPECT_FALSE(chip.ports[1].high(12));
  EXPECT_FALSE(chip.tim1.outputs_on());
  for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
}

}  // namespace
}  // namespace flexspline::tests
