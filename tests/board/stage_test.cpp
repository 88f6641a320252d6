// Boards with three half bridges: set-up, the instant of the samples, what opens the switches, and the measurement of a
// motor by the real image.
#include <gtest/gtest.h>

#include <algorithm>
#include <cstdio>
#include <random>
#include <set>
#include <string>

#include "tests/board/stage_boards.hpp"

namespace flexspline::tests {
namespace {

TEST(BoardStage, StartsWithAllSwitchesOpenADeadTimeAndABreakInput) {
  NucleoBench bench;
  Chip& chip = bench.chip;
  bench.come_up();
  EXPECT_EQ(chip.clock.core_hz(), 160e6);
  EXPECT_FALSE(chip.tim1.outputs_on());
  const std::uint32_t bdtr = chip.tim1.at(0x44);
  EXPECT_NEAR((bdtr & 0x7F) / timer_hz(chip), 500e-9, 10e-9);
  EXPECT_EQ(bdtr & 0x80, 0U);
  EXPECT_EQ(bdtr & 0x3000, 0x1000U) << "a low break input opens all switches";
  EXPECT_EQ(bdtr & 0x4000, 0U) << "they do not close by themselves";
  for (const std::uint32_t channel : {1U, 2U, 3U}) {
    EXPECT_EQ(chip.tim1.at(0x20) >> (4 * (channel - 1)) & 15, 13U) << "high side active high, low side active low";
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, false)) << channel;
    EXPECT_FALSE(chip.tim1.is_on_while_off(channel, true)) << channel;
  }
  EXPECT_DOUBLE_EQ(chip.tim1.period_us(timer_hz(chip)), 50.0);
  EXPECT_EQ(chip.machine.tick_priority(), 0xFFU) << "the current loop interrupts the tick";
  // Pins of the timer with pulls that hold the switches open before it drives them.
  for (const auto& [port, pin, pull] : {std::array{0, 8, 2}, {0, 9, 2}, {0, 10, 2}, {0, 7, 1}, {1, 0, 1}, {1, 1, 1}}) {
    EXPECT_EQ(chip.ports[port].mode(pin), 2U);
    EXPECT_EQ(chip.ports[port].function(pin), 1U);
    EXPECT_EQ(chip.ports[port].at(0x0C) >> (2 * pin) & 3, static_cast<std::uint32_t>(pull));
  }
  const auto status = bench.status();
  EXPECT_EQ(status.mode, Mode::idle) << protocol::fault_text(status.fault).name << " " << status.fault_seen << " "
                                     << status.fault_limit;
  bench.expect_no_violation();
}

TEST(BoardStage, TheIndexPulseOfTheMotorsEncoderGivesItsTurn) {
  const StageWiring w = nucleo("ihm08m1-index");
  NucleoBench bench("ihm08m1-index");
  const Turned turned(w);
  store(SectorsPort<0x20000>(bench.chip.flash), turned.block({}, 31.842, 15.0));
  bench.come_up();
  ASSERT_TRUE(bench.status().has_parameters);
  EXPECT_FALSE(bench.get<protocol::Reference>(Kind::reference).knows_turn);
  EXPECT_EQ(bench.command({.kind = protocol::CommandKind::arm, .mode = Mode::current}),
            protocol::Refusal::not_commissioned);
  bench.chip.tim2.pulse(3);
  bench.chip.periods(4);
  EXPECT_TRUE(bench.get<protocol::Reference>(Kind::reference).knows_turn);
  bench.expect_no_violation();
}

// The instant at which the currents are held is a number of the timer's and of the converters' registers: nothing that
// the processor does moves it.
TEST(BoardStage, TheInstantOfTheSamplesIsTheTimersWhateverTheProcessorDoes) {
  NucleoBench bench;
  Chip& chip = bench.chip;
  bench.come_up();
  const double hz = timer_hz(chip), apb2 = chip.clock.apb2_hz();
  ASSERT_TRUE(chip.tim1.triggers_by_compare4());
  const int timer_set_ups = chip.tim1.set_ups_while_it_runs, converter_set_ups = chip.converter.set_ups;
  std::mt19937 random{3};
  std::set<double> instants;
  for (int k = 0; k < 2000; ++k) {
    instants.insert(chip.tim1.trigger_us(hz) + chip.converter.sample_us(apb2) - chip.tim1.top_us(hz));
    // The tick, an interrupt that waits, a command, a loop that ends late: whatever delays instructions.
    if (random() % 8 == 0) bench.ask(Kind::status, protocol::Empty{});
    chip.loop_is_late = random() % 16 == 0;
    ASSERT_EQ(chip.period(), Stop::waits);
  }
  EXPECT_EQ(instants.size(), 1U) << "no jitter";
  EXPECT_NEAR(*instants.begin(), 0.0, 0.01) << "us: held in the middle of the low sides' time";
  EXPECT_EQ(chip.tim1.set_ups_while_it_runs, timer_set_ups) << "no register that the instant depends on is written";
  EXPECT_EQ(chip.converter.set_ups, converter_set_ups);
  EXPECT_LT(chip.converter.conversion_us(apb2), 4.0);
  bench.expect_no_violation();
}

TEST(BoardStage, AConverterThatStopsOpensTheSwitchesWithinThreePeriodsAndIsAFault) {
  NucleoBench bench;
  bench.come_up();
  Chip& chip = bench.chip;
  chip.tim1.write(0x44, chip.tim1.at(0x44) | 1U << 15);  // as if it were on
  ASSERT_TRUE(chip.tim1.outputs_on());
  chip.converter_is_dead = true;
  chip.converter.words[0x00] = 0;
  chip.periods(3);
  EXPECT_FALSE(chip.tim1.outputs_on());
  const auto status = bench.status();
  EXPECT_EQ(status.mode, Mode::fault);
  EXPECT_EQ(protocol::fault_text(status.fault).name, "motor_encoder_stale") << "nothing is sampled any more";
  EXPECT_GT(bench.status().tick, status.tick) << "the application goes on";
  bench.expect_no_violation();
}

TEST(BoardStage, ACurrentLoopThatEndsAfterTheTimersBottomIsAnOverrun) {
  NucleoBench bench;
  bench.come_up();
  bench.chip.loop_is_late = true;
  bench.chip.periods(4);
  bench.chip.loop_is_late = false;
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "tick_overrun");
  // The cause is gone: the fault can be cleared.
  EXPECT_EQ(bench.command({.kind = protocol::CommandKind::clear_fault}), protocol::Refusal::none);
  bench.chip.periods(300);
  EXPECT_EQ(bench.status().mode, Mode::idle);
  bench.expect_no_violation();
}

// The timer counts down again, as in a loop that is in time.
TEST(BoardStage, ACurrentLoopThatTakesAWholePeriodIsAnOverrun) {
  NucleoBench bench;
  bench.come_up();
  bench.chip.loop_takes_a_period = true;
  bench.chip.periods(4);
  bench.chip.loop_takes_a_period = false;
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "tick_overrun");
}

// Two sectors of 128 KB, each of which may take two seconds, are longer than the watchdog's longest time.
TEST(BoardStage, AFactoryResetOfASlowFlashMemoryIsNotEndedByTheWatchdog) {
  NucleoBench bench;
  Chip& chip = bench.chip;
  chip.watchdog.oscillator_hz = 47'000;
  chip.flash.erased = [&] { chip.watchdog.pass(2.0); };
  bench.come_up();
  ASSERT_LT(chip.watchdog.limit_s(), 4.0);
  EXPECT_EQ(bench.ask(Kind::block_erase_all, protocol::Empty{}).code, 0);
  EXPECT_EQ(chip.flash.erases, 2);
  EXPECT_FALSE(chip.watchdog.bit) << "a reset in the middle of the operation";
  bench.expect_no_violation();
}

TEST(BoardStage, TheImageMeasuresAMotorThatNothingIsKnownOf) {
  NucleoBench bench;
  bench.come_up();
  bench.chip.machine.count_instructions();
  std::uint64_t most = 0;
  bench.observes = [&] { most = std::max(most, bench.chip.loop_instructions); };
  expect_measured(bench, some_motor(), 6.0);
  std::printf("at most %d instructions in a period\n", static_cast<int>(most));
  EXPECT_LT(most, 4'000U) << "half a PWM period has as many cycles";
}
// Half a PWM period has enough room for every period of it; one that is late all the same does no harm.
TEST(BoardStage, APeriodThatIsLateWhileAMotorIsMeasuredIsNoFault) {
  NucleoBench bench;
  bench.come_up();
  const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 6.0);
  ASSERT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  bench.chip.periods(3000);
  bench.chip.loop_is_late = true;
  bench.chip.periods(2);
  bench.chip.loop_is_late = false;
  EXPECT_EQ(bench.get<protocol::CommissioningProgress>(Kind::commissioning_state).state, CommissioningState::runs);
}
TEST(BoardStage, WithAnEncoderOnSpiOneFrameAPeriodIsEnough) {
  StageWiring w = nucleo("ihm08m1-abs");
  w.counts = 1 << 14;
  StageBench bench(w, some_motor(), inverter_of_24_v());
  AngleSensorOnSpi sensor(bench.chip.machine, [&] { return !bench.chip.ports[3].high(2); });
  bench.chip.machine.attach(0x40003C00, sensor);
  bench.encoder = [&](std::uint32_t counts) { sensor.angle = counts & 0x3FFF; };
  bench.come_up();
  EXPECT_EQ(bench.status().mode, Mode::idle);
  EXPECT_LE(sensor.clock_hz(bench.chip.clock.apb1_hz()), 10e6);
  expect_measured(bench, some_motor(), 6.0);
  sensor.fault = AngleSensorOnSpi::Fault::no_magnet;
  bench.chip.periods(600);
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "motor_encoder_stale");
}

TEST(BoardStage, TheMotorThatWasMeasuredTurnsAsTheHostSaysAndItsTorqueIsThatOfTheCurrent) {
  const StageWiring w = nucleo();
  const Turned turned(w);
  control::MotorSettings found;
  {
    StageBench bench(w, turned.motor, inverter_of_24_v(), turned.shaft);
    bench.come_up();
    found = motor_found(bench, 5.0);
  }
  StageBench bench(w, turned.motor, inverter_of_24_v(), turned.shaft);
  store(SectorsPort<0x20000>(bench.chip.flash), turned.block(found, 31.842, 15.0));
  bench.come_up();
  ASSERT_TRUE(bench.status().has_parameters);
  bench.chip.periods(1200);  // the zeros of the current sensors
  const auto constants = board::constants_of(turned.drive, 10'000);
  int low_sides_only = 0;
  bench.observes = [&] {
    const motor::Triple d = bench.duties();
    if (bench.is_on() && d[0] + d[1] + d[2] == 0.0) ++low_sides_only;
  };
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                           .mode = Mode::current,
                           .current = per_unit(2.0, constants.current_base)}),
            protocol::Refusal::none);
  bench.chip.periods(100);
  EXPECT_EQ(bench.status().mode, Mode::current)
      << protocol::fault_text(bench.status().fault).name << " " << bench.status().fault_limit;
  EXPECT_GE(low_sides_only, 39) << "2 ms of low sides charge the bootstrap supplies before the first voltage";
  double torque = 0.0;
  bench.observes = [&] { torque += bench.sample().torque_nm / 100.0; };
  bench.chip.periods(100);
  EXPECT_NEAR(torque, 2.0 * turned.drive.torque_constant_nm_a, 0.03 * 2.0 * turned.drive.torque_constant_nm_a);
  bench.observes = nullptr;
  expect_loop_within(bench, 1000);
  EXPECT_EQ(bench.command({.kind = protocol::CommandKind::disarm}), protocol::Refusal::none);
  EXPECT_FALSE(bench.is_on());
  bench.chip.periods(8000);         // it comes to rest
  constexpr double kWanted = 80.0;  // rad/s
  ASSERT_EQ(bench.command({.kind = protocol::CommandKind::arm,
                           .mode = Mode::velocity,
                           .velocity = per_unit(kWanted, constants.velocity_base)}),
            protocol::Refusal::none);
  run_with_host(bench, 0.4);
  EXPECT_EQ(bench.status().mode, Mode::velocity);
  EXPECT_NEAR(bench.rotor.speed_rad_s(), kWanted, 0.05 * kWanted);
  // Wherever the current loop interrupts the tick, nothing is torn.
  std::mt19937 random{11};
  double slowest = kWanted, fastest = kWanted;
  for (int k = 0; k < 1500; ++k) {
    if (k % 100 == 0) bench.command({.kind = protocol::CommandKind::heartbeat});
    bench.chip.interrupts_tick_after = 1 + random() % 3000;
    ASSERT_EQ(bench.chip.period(), Stop::waits) << bench.chip.machine.where();
    slowest = std::min(slowest, bench.rotor.speed_rad_s());
    fastest = std::max(fastest, bench.rotor.speed_rad_s());
  }
  std::printf("%d bytes of the stack were never used\n", static_cast<int>(bench.unused_stack()));
  EXPECT_GT(bench.unused_stack(), 2048U);
  EXPECT_GT(bench.chip.interrupted_ticks, 500);
  EXPECT_GT(slowest, 0.95 * kWanted);
  EXPECT_LT(fastest, 1.05 * kWanted);
  EXPECT_EQ(bench.status().mode, Mode::velocity);
  bench.expect_no_violation();
}

TEST(BoardStage, ABreakOpensTheSwitchesWithoutTheProcessorAndStopsTheMeasurement) {
  NucleoBench bench;
  bench.come_up();
  const auto setup = setup_of(bench.get<protocol::CommissioningStage>(Kind::commissioning_stage), 6.0);
  ASSERT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  bench.chip.periods(3000);
  ASSERT_TRUE(bench.is_on());
  bench.chip.tim1.trip();
  EXPECT_FALSE(bench.is_on()) << "before an instruction runs";
  bench.chip.tim1.break_input = false;
  bench.chip.periods(10);
  EXPECT_FALSE(bench.is_on());
  EXPECT_EQ(bench.get<protocol::CommissioningProgress>(Kind::commissioning_state).state,
            CommissioningState::drive_fault);
  EXPECT_EQ(protocol::fault_text(bench.status().fault).name, "amplifier_fault");
  EXPECT_EQ(bench.status().fault_limit, static_cast<int>(protocol::StageFault::driver));
  EXPECT_EQ(bench.command({.kind = protocol::CommandKind::clear_fault}), protocol::Refusal::none);
  bench.chip.periods(300);
  EXPECT_EQ(bench.ask(Kind::commissioning_begin, begin_of(setup)).code, 0);
  bench.chip.periods(3000);
  EXPECT_TRUE(bench.is_on()) << "the flag of the break was cleared";
  bench.expect_no_violation();
}

}  // namespace
}  // namespace flexspline::tests
