// Encoders that know their angle, and an index pulse, on the register models: what the drive knows after it woke
// anywhere, and samples that do not come.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "shared/fixed/turn.hpp"
#include "shared/protocol/texts.hpp"
#include "tests/board/drive_bench.hpp"

namespace flexspline::tests {
namespace {

using protocol::Code, protocol::CommandKind, protocol::Kind, protocol::Mode;
using SpiFault = AngleSensorOnSpi::Fault;

void expect_no_violation(const Chip& chip) {
  for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
}
std::string fault_of(DriveBench& bench) {
  return std::string(protocol::fault_text(bench.bus.status().fault).name);
}
protocol::Reference reference_of(DriveBench& bench) {
  protocol::Reference known;
  EXPECT_EQ(protocol::take_payload(bench.bus.ask(Kind::reference, protocol::Empty{}).content(), known), Code::done);
  return known;
}
// Turns of the motor and of the output, as telemetry has them.
struct Angles {
  double motor, output;
};
Angles angles_of(DriveBench& bench) {
  protocol::Subscription wanted;
  wanted.every = 20;
  wanted.count = 4;
  using protocol::Channel;
  wanted.channels = {Channel::motor_turns, Channel::motor_fraction, Channel::output_turns, Channel::output_fraction};
  EXPECT_EQ(bench.bus.code(Kind::telemetry, wanted), Code::done);
  bench.chip.ticks(200);
  bench.bus.frames.clear();
  bench.bus.status();
  if (bench.bus.frames.empty()) return {NAN, NAN};
  model::Reader r(bench.bus.frames.back().content());
  r.skip(8);
  const auto turns = [&] {
    const auto whole = r.take<std::int32_t>();
    return whole + std::ldexp(r.take<std::uint32_t>(), -32);
  };
  const double motor = turns();
  return {motor, turns()};
}
double true_turns(const DriveBench& bench) {
  return bench.rig.truth().motor_angle / kTurn;
}
void arm_velocity(DriveBench& bench, double rad_s) {
  const double base = board::constants_of(demo()).velocity_base;
  ASSERT_EQ(
      bench.command({.kind = CommandKind::arm, .mode = Mode::velocity, .velocity = DriveBench::per_unit(rad_s, base)})
          .refusal,
      protocol::Refusal::none);
}

TEST(BoardEncoders, OnSpiAndI2cTellTheAnglesFromTheStartWhereverTheDriveWakes) {
  for (const double initial_turns : {0.3, -1.4, 20.6}) {
    DriveBench bench("dac-abs", true, initial_turns);
    bench.come_up();
    EXPECT_EQ(reference_of(bench).knows_turn, true) << initial_turns;
    EXPECT_EQ(reference_of(bench).knows_output, true) << initial_turns;
    const Angles shown = angles_of(bench);
    EXPECT_NEAR(shown.motor, true_turns(bench), 2.0 / 16384) << initial_turns;
    EXPECT_NEAR(shown.output, true_turns(bench) / demo().gear_ratio, 2.0 / 4096) << initial_turns;
    expect_no_violation(bench.chip);
  }
}

TEST(BoardEncoders, OnSpiAndI2cServeTheLoops) {
  DriveBench bench("dac-abs", true, 0.3);
  bench.come_up();
  arm_velocity(bench, 60.0);
  bench.run_with_host(0.4);
  EXPECT_EQ(bench.bus.status().mode, Mode::velocity) << fault_of(bench);
  EXPECT_NEAR(bench.rig.truth().motor_velocity, 60.0, 3.0);
  const double before = true_turns(bench);
  bench.command({.kind = CommandKind::disarm});
  EXPECT_GT(before, 2.0);
  bench.chip.ticks(4000);
  EXPECT_NEAR(angles_of(bench).motor, true_turns(bench), 2.0 / 16384) << "no turn is lost";
  expect_no_violation(bench.chip);
}

TEST(BoardEncoders, TheirBusesRunWithinTheirLimitsAndASampleOfTheOutputTakesFewTicks) {
  DriveBench bench("dac-abs", true, 0.3);
  bench.come_up();
  EXPECT_LE(bench.chip.spi1.clock_hz(bench.chip.clock.apb2_hz()), 10e6);
  EXPECT_GT(bench.chip.spi1.clock_hz(bench.chip.clock.apb2_hz()), 4e6) << "a frame ends within a tenth of a tick";
  EXPECT_LE(bench.chip.i2c1.bus_hz(bench.chip.clock.apb1_hz()), 400e3);
  EXPECT_GT(bench.chip.i2c1.bus_hz(bench.chip.clock.apb1_hz()), 350e3);
  const int before = bench.chip.i2c1.samples;
  bench.chip.ticks(1000);
  EXPECT_GT(bench.chip.i2c1.samples - before, 1000 / 20);
}

TEST(BoardEncoders, AMotorEncoderThatDoesNotAnswerWellIsStaleWithinThreeTicks) {
  for (const SpiFault fault : {SpiFault::no_magnet, SpiFault::wrong_parity, SpiFault::error_flag, SpiFault::all_ones,
                               SpiFault::all_zeros, SpiFault::bus_hangs}) {
    DriveBench bench("dac-abs", true, 0.3);
    bench.come_up();
    arm_velocity(bench, 20.0);
    bench.run_with_host(0.02);
    ASSERT_TRUE(bench.enabled()) << static_cast<int>(fault);
    bench.chip.spi1.fault = fault;
    bench.chip.ticks(5);  // of which two pass until a bad answer is seen
    EXPECT_FALSE(bench.enabled()) << static_cast<int>(fault);
    EXPECT_EQ(fault_of(bench), "motor_encoder_stale") << static_cast<int>(fault);
    EXPECT_FALSE(reference_of(bench).knows_turn);
    bench.chip.spi1.fault = SpiFault::none;
    bench.chip.ticks(8000);
    bench.command({.kind = CommandKind::clear_fault});
    bench.chip.ticks(100);
    EXPECT_TRUE(reference_of(bench).knows_turn) << "it knows its angle again";
    EXPECT_NEAR(angles_of(bench).motor, true_turns(bench), 2.0 / 16384);
  }
}

TEST(BoardEncoders, AFlagOfAnErrorIsClearedAndNotAFault) {
  DriveBench bench("dac-abs", true, 0.3);
  bench.come_up();
  arm_velocity(bench, 20.0);
  bench.run_with_host(0.02);
  bench.chip.spi1.had_error = true;
  bench.run_with_host(0.02);
  EXPECT_FALSE(bench.chip.spi1.had_error);
  EXPECT_EQ(bench.bus.status().mode, Mode::velocity) << fault_of(bench);
}

TEST(BoardEncoders, AnOutputEncoderThatDoesNotAnswerIsStaleAndComesBack) {
  for (const bool magnet : {true, false}) {
    DriveBench bench("dac-abs", true, 0.3);
    bench.come_up();
    arm_velocity(bench, 20.0);
    bench.run_with_host(0.02);
    ASSERT_TRUE(bench.enabled());
    (magnet ? bench.chip.i2c1.has_magnet : bench.chip.i2c1.answers) = false;
    bench.chip.ticks(40);
    EXPECT_FALSE(bench.enabled());
    EXPECT_EQ(fault_of(bench), "output_encoder_stale");
    (magnet ? bench.chip.i2c1.has_magnet : bench.chip.i2c1.answers) = true;
    bench.chip.ticks(8000);
    bench.command({.kind = CommandKind::clear_fault});
    bench.chip.ticks(100);
    EXPECT_EQ(bench.bus.status().mode, Mode::idle);
    expect_no_violation(bench.chip);
  }
}

TEST(BoardEncoders, AnIndexPulseGivesTheTurn) {
  DriveBench bench("dac-index", true, 0.3);
  bench.come_up();
  EXPECT_FALSE(reference_of(bench).knows_turn);
  EXPECT_NEAR(angles_of(bench).motor, 0.0, 1e-3) << "it counts from where it woke";
  arm_velocity(bench, 30.0);
  bench.run_with_host(0.3);
  EXPECT_FALSE(reference_of(bench).knows_turn) << "not while armed";
  bench.command({.kind = CommandKind::disarm});
  bench.chip.ticks(8000);
  EXPECT_TRUE(reference_of(bench).knows_turn);
  EXPECT_FALSE(reference_of(bench).knows_output);
  const double off = angles_of(bench).motor - true_turns(bench);
  EXPECT_NEAR(off, std::round(off), 1e-3);
  expect_no_violation(bench.chip);
}

TEST(BoardEncoders, QuadratureKnowsNothingUntilItIsHomed) {
  DriveBench bench("dac", true, 0.3);
  bench.come_up();
  EXPECT_EQ(reference_of(bench), (protocol::Reference{}));
  EXPECT_EQ(bench.bus.code(Kind::home, protocol::Home{0}), Code::done);
  EXPECT_TRUE(reference_of(bench).knows_turn && reference_of(bench).knows_output);
  EXPECT_EQ(reference_of(bench).zero, control::StoredZero{}) << "nothing that could be stored";
}

// The three `stale` faults of the boards with quadrature: the timer or the converter does not work any more.
TEST(BoardEncoders, ATimerThatStopsCountingIsAStaleEncoder) {
  for (const bool motor : {true, false}) {
    DriveBench bench("dac", true, 0.3);
    bench.come_up();
    arm_velocity(bench, 20.0);
    bench.run_with_host(0.02);
    ASSERT_TRUE(bench.enabled());
    (motor ? bench.chip.tim2 : bench.chip.tim5).words[motor ? 0x00 : 0x08] = 0;  // CR1 or SMCR
    bench.chip.ticks(4);
    EXPECT_FALSE(bench.enabled());
    EXPECT_EQ(fault_of(bench), motor ? "motor_encoder_stale" : "output_encoder_stale");
  }
}

TEST(BoardEncoders, AConverterThatHangsIsAFaultAndTheTickGoesOn) {
  for (const char* variant : {"dac", "pwm"}) {
    DriveBench bench(variant);
    bench.come_up();
    bench.command({.kind = CommandKind::arm, .mode = Mode::current});
    bench.run_with_host(0.005);
    ASSERT_TRUE(bench.enabled());
    const auto tick = bench.bus.status().tick;
    bench.chip.converter_is_dead = true;
    bench.chip.ticks(4);
    EXPECT_FALSE(bench.enabled()) << variant;
    EXPECT_EQ(fault_of(bench), "analog_stale") << variant;
    bench.chip.ticks(1000);
    EXPECT_GT(bench.bus.status().tick, tick + 1000) << variant;
    EXPECT_FALSE(bench.chip.watchdog.bit) << "the watchdog is not needed";
  }
}

TEST(BoardEncoders, TheTickBeginsWhenTheConversionsHaveEnded) {
  DriveBench bench("pwm");
  bench.come_up();
  const double timer_hz = 2 * bench.chip.clock.apb2_hz();
  EXPECT_GT(bench.chip.tim1.compare4_us(timer_hz),
            bench.chip.converter.conversion_us(bench.chip.clock.apb2_hz()) + 1.0);
  EXPECT_LT(bench.chip.tim1.compare4_us(timer_hz), 8.0);
}

}  // namespace
}  // namespace flexspline::tests
