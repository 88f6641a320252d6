// The real image in closed loop with a simulated drive; its flash memory, its bridge and its watchdog.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "shared/protocol/texts.hpp"
#include "tests/board/drive_bench.hpp"

namespace flexspline::tests {
namespace {

using protocol::Code, protocol::CommandKind, protocol::Kind, protocol::Mode;

void expect_no_violation(const Chip& chip) {
  for (const std::string& what : chip.machine.violations()) ADD_FAILURE() << what;
}
double base_velocity() {
  return board::constants_of(demo()).velocity_base;
}

TEST(BoardDrive, ReadsConverterAndEncodersWithTheRightSignAndScale) {
  DriveBench bench("dac");
  bench.wired = false;
  // Shares of full scale: current 0.25, torque -0.5; temperature a quarter of its range above zero.
  bench.chip.converter.inputs[10] = 2559;
  bench.chip.converter.inputs[11] = 1024;
  bench.chip.converter.inputs[12] = 1024;
  bench.come_up();
  protocol::Subscription wanted;
  wanted.every = 50;
  wanted.count = 3;
  wanted.channels[0] = protocol::Channel::readings;
  wanted.channels[1] = protocol::Channel::current;
  wanted.channels[2] = protocol::Channel::torque;
  ASSERT_EQ(bench.bus.code(Kind::telemetry, wanted), Code::done);
  bench.chip.tim2.move_to(static_cast<std::uint32_t>(-1234));
  bench.chip.ticks(1000);
  bench.bus.frames.clear();
  bench.bus.status();
  ASSERT_FALSE(bench.bus.frames.empty());
  model::Reader r(bench.bus.frames.back().content());
  r.skip(8);
  EXPECT_EQ(r.take<std::uint32_t>(), static_cast<std::uint32_t>(-1234));
  const auto constants = board::constants_of(demo());
  const board::AnalogScales scales = board::scales_of(demo());
  const double current_a = std::ldexp(r.take<std::int32_t>(), -27) * constants.current_base;
  const double torque_nm = std::ldexp(r.take<std::int32_t>(), -27) * constants.output_torque_base;
  // A step of the converter is 1/2048 of full scale; the ripple filter learns nothing at standstill.
  EXPECT_NEAR(current_a, 0.25 * scales.current_a, 0.001 * scales.current_a);
  EXPECT_NEAR(torque_nm, -0.5 * scales.torque_nm, 0.1 * scales.torque_nm);
  expect_no_violation(bench.chip);
}

TEST(BoardDrive, TurnsASimulatedMotorAsFastAsTheHostOverUsbSays) {
  DriveBench bench("dac");
  bench.come_up();
  EXPECT_FALSE(bench.enabled());
  constexpr double kWanted = 60.0;  // rad/s
  const auto answer = bench.command(
      {.kind = CommandKind::arm, .mode = Mode::velocity, .velocity = DriveBench::per_unit(kWanted, base_velocity())});
  ASSERT_EQ(answer.refusal, protocol::Refusal::none);
  bench.run_with_host(0.3);
  EXPECT_TRUE(bench.enabled());
  EXPECT_EQ(bench.bus.status().mode, Mode::velocity);
  EXPECT_NEAR(bench.rig.truth().motor_velocity, kWanted, 0.05 * kWanted);
  bench.command({.kind = CommandKind::disarm});
  EXPECT_FALSE(bench.enabled());
  EXPECT_EQ(bench.chip.dac.at(0x08), 2048U);
  EXPECT_FALSE(bench.chip.watchdog.bit);
  expect_no_violation(bench.chip);
}

TEST(BoardDrive, AHostThatGoesSilentBringsItToRestAndOff) {
  DriveBench bench("dac");
  bench.come_up();
  bench.command(
      {.kind = CommandKind::arm, .mode = Mode::velocity, .velocity = DriveBench::per_unit(40.0, base_velocity())});
  bench.run_with_host(0.1);
  ASSERT_TRUE(bench.enabled());
  bench.chip.ticks(6000);  // 0.3 s
  EXPECT_FALSE(bench.enabled());
  EXPECT_EQ(bench.bus.status().mode, Mode::fault);
  EXPECT_LT(std::fabs(bench.rig.truth().motor_velocity), 2.0);
}

TEST(BoardFlash, ABlockThatIsSentIsErasedForProgrammedReadBackAndUsed) {
  DriveBench bench("dac", false);
  bench.come_up();
  EXPECT_FALSE(bench.bus.status().has_parameters);
  const std::vector<std::uint8_t> block = twin::factory_block(demo());
  const auto size = static_cast<std::uint32_t>(block.size());
  ASSERT_EQ(bench.bus.code(Kind::block_begin, protocol::BlockBegin{size, model::crc32(block)}), Code::done);
  EXPECT_EQ(bench.chip.flash.erases, 1);
  for (std::size_t at = 0; at < block.size(); at += protocol::kMostChunk) {
    protocol::Chunk chunk;
    chunk.offset = static_cast<std::uint32_t>(at);
    chunk.count = static_cast<std::uint8_t>(std::min(protocol::kMostChunk, block.size() - at));
    std::copy_n(block.begin() + static_cast<std::ptrdiff_t>(at), chunk.count, chunk.bytes.begin());
    ASSERT_EQ(bench.bus.code(Kind::block_chunk, chunk), Code::done) << at;
  }
  ASSERT_EQ(bench.bus.code(Kind::block_commit, protocol::Empty{}), Code::done);
  EXPECT_TRUE(bench.bus.status().has_parameters);
  EXPECT_EQ(bench.bus.status().mode, Mode::idle) << "the ticks that the memory delayed are no fault";
  EXPECT_TRUE(bench.chip.flash.locked());
  EXPECT_TRUE(std::equal(block.begin(), block.end(), bench.chip.flash.bytes.begin() + 256));
  expect_no_violation(bench.chip);
}

TEST(BoardFlash, ErrorsOfTheMemoryAreTold) {
  DriveBench bench("dac", false);
  bench.come_up();
  constexpr std::uint32_t kWriteProtected = 1U << 4, kParallelism = 1U << 6;
  bench.chip.flash.error = kWriteProtected;
  EXPECT_EQ(bench.bus.code(Kind::block_begin, protocol::BlockBegin{100, 0}), Code::flash);
  EXPECT_EQ(bench.bus.code(Kind::block_begin, protocol::BlockBegin{100, 0}), Code::done) << "errors do not stay";
  protocol::Chunk chunk;
  chunk.count = 8;
  bench.chip.flash.error = kParallelism;
  EXPECT_EQ(bench.bus.code(Kind::block_chunk, chunk), Code::flash);
  EXPECT_TRUE(bench.chip.flash.locked());
  expect_no_violation(bench.chip);
}

TEST(BoardBridge, HasDeadTimeActiveHighOutputsAndIsOffUntilItIsArmed) {
  DriveBench bench("pwm");
  bench.come_up();
  const std::uint32_t bdtr = bench.chip.tim1.at(0x44);
  EXPECT_NEAR((bdtr & 0x7F) / 168e6, 500e-9, 10e-9);
  EXPECT_EQ(bdtr & 0x80, 0U) << "above 127 the field means something else";
  EXPECT_EQ(bench.chip.tim1.at(0x20), 0x505U) << "channels 1 and 3 with their complements, none inverted";
  EXPECT_EQ(bdtr & 0xC00, 0xC00U) << "off is driven low";
  EXPECT_EQ(bdtr & 0x3000, 0x1000U) << "a low break input opens the bridge";
  EXPECT_EQ(bench.chip.tim1.at(0x04) & 0x3F00, 0U) << "idle levels are low";
  EXPECT_FALSE(bench.enabled());
  EXPECT_EQ(bench.chip.tim1.duty(), 0.0);
  expect_no_violation(bench.chip);
}

TEST(BoardBridge, ItsCurrentLoopMakesTheCurrentThatIsWanted) {
  DriveBench bench("pwm");
  bench.come_up();
  const double base = board::constants_of(demo()).current_base, wanted_a = 0.2 * base;
  bench.command({.kind = CommandKind::arm, .mode = Mode::current, .current = DriveBench::per_unit(wanted_a, base)});
  bench.run_with_host(0.02);
  EXPECT_TRUE(bench.enabled());
  EXPECT_NEAR(bench.bridge_a, wanted_a, 0.1 * base);
  EXPECT_GT(bench.bridge_a, 0.0);
  expect_no_violation(bench.chip);
}

// Of the sensor and the amplifier of another board: the drive would regulate another current than it shows.
TEST(BoardBridge, ABlockOfOtherFullScalesThanTheBridgesIsNotUsed) {
  DriveBench bench("pwm", false);
  bench.store(twin::factory_block(demo()));
  bench.come_up();
  EXPECT_FALSE(bench.bus.status().has_parameters);
  EXPECT_EQ(bench.command({.kind = CommandKind::arm, .mode = Mode::current}).refusal, protocol::Refusal::no_parameters);
}

TEST(BoardBridge, AFaultOpensAllSwitchesWithinTicks) {
  DriveBench bench("pwm");
  bench.come_up();
  bench.command({.kind = CommandKind::arm, .mode = Mode::current});
  bench.run_with_host(0.005);
  ASSERT_TRUE(bench.enabled());
  bench.wired = false;
  bench.chip.converter.inputs[10] = 4095;  // a broken wire
  bench.chip.ticks(3);
  EXPECT_FALSE(bench.chip.tim1.outputs_on());
  EXPECT_FALSE(bench.chip.ports[2].high(6));
}

TEST(BoardBridge, ABreakStaysUntilTheHostArmsAgain) {
  DriveBench bench("pwm");
  bench.come_up();
  bench.command({.kind = CommandKind::arm, .mode = Mode::current});
  bench.run_with_host(0.005);
  bench.chip.tim1.trip();
  EXPECT_FALSE(bench.chip.tim1.outputs_on());
  bench.chip.tim1.break_input = false;
  bench.run_with_host(0.005);
  EXPECT_FALSE(bench.chip.tim1.outputs_on()) << "it does not come back by itself";
  const protocol::Status status = bench.bus.status();
  EXPECT_EQ(status.mode, Mode::fault);
  EXPECT_EQ(protocol::fault_text(status.fault).name, "amplifier_fault");
  EXPECT_EQ(bench.command({.kind = CommandKind::arm, .mode = Mode::current}).refusal, protocol::Refusal::fault);
  bench.command({.kind = CommandKind::clear_fault});
  bench.run_with_host(0.005);
  bench.command({.kind = CommandKind::arm, .mode = Mode::current});
  EXPECT_TRUE(bench.chip.tim1.outputs_on());
}

TEST(BoardDrive, AStartAfterACrashEndsInAFaultThatTheHostHasToClear) {
  DriveBench bench("dac");
  bench.chip.machine.set_word(kHandover, 0x43525348);
  ASSERT_EQ(bench.chip.start(), Stop::waits) << bench.chip.machine.where();
  ASSERT_TRUE(bench.bus.enumerate());
  bench.chip.ticks(100);
  ASSERT_EQ(bench.bus.code(protocol::Kind::identify, protocol::Hello{}), protocol::Code::done);
  EXPECT_EQ(bench.bus.status().mode, Mode::fault);
  EXPECT_EQ(protocol::fault_text(bench.bus.status().fault).name, "crashed");
  bench.command({.kind = CommandKind::clear_fault});
  bench.chip.ticks(100);
  EXPECT_EQ(bench.bus.status().mode, Mode::idle);
}

TEST(BoardWatchdog, IsFedWhileAllPartsReportAndBitesWhenTheTickStops) {
  DriveBench bench("dac");
  bench.come_up();
  bench.chip.ticks(2000);
  EXPECT_FALSE(bench.chip.watchdog.bit);
  const int fed = bench.chip.watchdog.fed;
  bench.chip.timer_is_dead = true;  // the main loop goes on
  bench.chip.ticks(200);
  EXPECT_LE(bench.chip.watchdog.fed, fed + 1);
}

TEST(BoardWatchdog, ItsLimitIsTenMillisecondsWhileArmedEvenWithTheSlowestOscillator) {
  DriveBench bench("dac");
  bench.chip.watchdog.oscillator_hz = 17'000;
  bench.come_up();
  bench.command({.kind = CommandKind::arm, .mode = Mode::current});
  bench.run_with_host(0.01);
  ASSERT_TRUE(bench.enabled());
  EXPECT_LE(bench.chip.watchdog.limit_s(), 0.0101);
  bench.chip.timer_is_dead = true;
  bench.chip.ticks(210);
  EXPECT_TRUE(bench.chip.watchdog.bit);
}

TEST(BoardWatchdog, ItsLimitOutlastsAnEraseWhileNotArmedEvenWithTheFastestOscillator) {
  DriveBench bench("dac");
  bench.chip.watchdog.oscillator_hz = 47'000;
  bench.come_up();
  EXPECT_GT(bench.chip.watchdog.limit_s(), 2.0);
  EXPECT_FALSE(bench.chip.watchdog.bit);
}

}  // namespace
}  // namespace flexspline::tests
