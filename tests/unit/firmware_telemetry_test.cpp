// Telemetry, watchdog and the parameter block of the application.
#include <gtest/gtest.h>

#include <array>
#include <cmath>
#include <cstring>
#include <random>
#include <span>
#include <string>

#include "shared/model/block_texts.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_telemetry_test {
namespace {

using firmware::BlockFinding;
using firmware::TelemetrySetup;

constexpr std::size_t kWords = 64;
using Ring = firmware::Telemetry<kWords>;

firmware::ChannelValues values_at(std::uint32_t tick) {
  firmware::ChannelValues values;
  for (std::size_t i = 0; i < values.size(); ++i) values[i] = tick * 100 + static_cast<std::uint32_t>(i);
  return values;
}

TEST(Telemetry, FramesHoldSequenceTickAndTheChannelsAskedFor) {
  Ring ring;
  ASSERT_TRUE(ring.configure({.every = 3, .count = 2, .channels = {Channel::torque, Channel::velocity}}));
  std::array<std::uint32_t, 8> room{};
  std::uint32_t frames = 0;
  for (std::uint32_t tick = 10; tick < 1000; ++tick) {
    ring.record(tick, values_at(tick));
    for (auto frame = ring.read(room); !frame.empty(); frame = ring.read(room)) {
      ASSERT_EQ(frame.size(), 4u);
      EXPECT_EQ(frame[0], frames);
      EXPECT_EQ(frame[1], 10 + 3 * frames);
      EXPECT_EQ(frame[2], frame[1] * 100 + static_cast<std::uint32_t>(Channel::torque));
      EXPECT_EQ(frame[3], frame[1] * 100 + static_cast<std::uint32_t>(Channel::velocity));
      ++frames;
    }
  }
  EXPECT_EQ(frames, 330u);
  EXPECT_EQ(ring.dropped(), 0u);
}

TEST(Telemetry, AFullRingDropsTheNewFrameCountsItAndShowsItInTheSequence) {
  Ring ring;
  ASSERT_TRUE(ring.configure({.every = 1, .count = 5, .channels = {}}));
  constexpr std::uint32_t kFit = kWords / 7;
  for (std::uint32_t tick = 0; tick < 100; ++tick) ring.record(tick, values_at(tick));
  EXPECT_EQ(ring.dropped(), 100 - kFit);
  std::array<std::uint32_t, 16> room{};
  for (std::uint32_t i = 0; i < kFit; ++i) EXPECT_EQ(ring.read(room)[0], i);
  EXPECT_TRUE(ring.read(room).empty());
  ring.record(100, values_at(100));
  const auto frame = ring.read(room);
  ASSERT_FALSE(frame.empty());
  EXPECT_EQ(frame[0], 100u);  // 100 - kFit are missing before it
}

TEST(Telemetry, RefusesWhatItCannotRecordAndKeepsWhatItHad) {
  Ring ring;
  ASSERT_TRUE(ring.configure({.every = 1, .count = 1, .channels = {Channel::state}}));
  EXPECT_FALSE(ring.configure({.every = 0, .count = 1, .channels = {Channel::state}}));
  EXPECT_FALSE(ring.configure({.every = 1, .count = TelemetrySetup::kMost + 1, .channels = {}}));
  EXPECT_FALSE(ring.configure({.every = 1, .count = 1, .channels = {static_cast<Channel>(firmware::kChannels)}}));
  ring.record(1, values_at(1));
  std::array<std::uint32_t, 2> too_small{};
  EXPECT_TRUE(ring.read(too_small).empty());
  std::array<std::uint32_t, 3> room{};
  EXPECT_EQ(ring.read(room).size(), 3u);
  ASSERT_TRUE(ring.configure({}));
  ring.record(2, values_at(2));
  EXPECT_TRUE(ring.read(room).empty());
}

TEST(Telemetry, OfADriveSaysWhatThePlantDoes) {
  TelemetrySetup channels{
      .every = 20,
      .count = 8,
      .channels = {Channel::motor_turns, Channel::motor_fraction, Channel::velocity, Channel::current, Channel::torque,
                   Channel::temperature, Channel::output_fraction, Channel::state}};
  VirtualDrive drive({.drive = demo_drive(), .seed = 3, .noise = false}, demo_block(), channels);
  drive.keep_frames(true);
  drive.run(100);
  drive.command(arm_velocity(80.0));
  run_with_host(drive, 0.6);
  // A frame of the tick that just ran: its sensors were read before the plant moved on.
  while (drive.last().frame_words == 0) drive.run(1);
  const auto& v = drive.frames().back().values;
  const auto d = demo_constants();
  const double tick_s = 1.0 / kTickHz;
  const double turns = static_cast<std::int32_t>(v[0]) + std::ldexp(v[1], -32);
  const plant::State& truth = drive.rig().truth();
  const double motor = truth.motor_angle - truth.motor_velocity * tick_s;
  EXPECT_NEAR(turns * kTurn, motor, kTurn / 16384);
  EXPECT_NEAR(real(v[2]) * d.velocity_base, truth.motor_velocity, 0.5);
  EXPECT_NEAR(real(v[3]) * d.current_base, drive.rig().current_a(), 0.02);
  EXPECT_NEAR(real(v[4]) * d.output_torque_base, drive.rig().torque_nm(), 0.6);
  EXPECT_NEAR(real(v[5]) * d.temperature_base, 30.0, 0.01);
  EXPECT_NEAR(std::ldexp(v[6], -32) * kTurn, std::fmod(truth.output_angle, kTurn), 1e-3);
  EXPECT_EQ(v[7] & 0xFF, static_cast<std::uint32_t>(Mode::velocity));
}

TEST(Telemetry, AHostThatDoesNotReadIsToldWhatItLost) {
  VirtualDrive drive({.drive = demo_drive()}, demo_block(), {.every = 1, .count = 6, .channels = {}});
  drive.keep_frames(true);
  drive.read_frames(false);
  drive.run(1000);
  const std::uint32_t fit = board::SoftwareBoard::kTelemetryWords / 8;
  EXPECT_EQ(drive.last().dropped, 1000 - fit);
  drive.read_frames(true);
  drive.run(600);
  const auto& frames = drive.frames();
  std::uint32_t missing = 0;
  for (std::size_t i = 1; i < frames.size(); ++i) {
    missing += frames[i].sequence - frames[i - 1].sequence - 1;
    EXPECT_EQ(frames[i].tick - frames[i].sequence, frames[0].tick - frames[0].sequence);
  }
  EXPECT_EQ(missing, drive.last().dropped);
}

// Watchdog.

TEST(Watchdog, IsFedOnlyWhenTickAndBackgroundWorkHaveReported) {
  using firmware::Part;
  const std::array parts{Part::tick, Part::background};
  for (const Part missing : parts) {
    firmware::Watchdog watchdog;
    for (int k = 0; k < 10; ++k) {
      for (const Part part : parts)
        if (part != missing) watchdog.report(part);
      EXPECT_FALSE(watchdog.all_reported());
    }
    watchdog.report(missing);
    EXPECT_TRUE(watchdog.all_reported());
    EXPECT_FALSE(watchdog.all_reported());
  }
}

TEST(Watchdog, ResetsADriveWhoseTickOrBackgroundWorkHangsWhichThenSaysSo) {
  for (const bool tick_hangs : {true, false}) {
    const auto drive = idle_drive();
    drive->command(arm_velocity(60.0));
    run_with_host(*drive, 0.1);
    EXPECT_EQ(software(*drive).resets(), 0);
    if (tick_hangs) {
      software(*drive).hang_tick(true);
    } else {
      software(*drive).hang_background(true);
    }
    std::uint32_t ticks = 0;
    for (; ticks < 1000 && software(*drive).resets() == 0; ++ticks) drive->run(1);
    EXPECT_LE(ticks, firmware::kWatchdogTicks + 1);
    EXPECT_FALSE(drive->last().actuation.enabled);
    software(*drive).hang_tick(false);
    software(*drive).hang_background(false);
    drive->run(100);
    EXPECT_EQ(drive->status().mode, Mode::fault);
    EXPECT_EQ(drive->status().fault.fault, Fault::watchdog);
    EXPECT_TRUE(drive->status().has_parameters);
    drive->command(of_kind(Command::Kind::clear_fault));
    drive->run_seconds(0.5);
    EXPECT_EQ(drive->status().mode, Mode::idle);
    EXPECT_EQ(drive->command(arm_velocity(60.0)).refusal, Refusal::none);
  }
}

TEST(Watchdog, ADriveThatWasResetByItsOwnCrashSaysSo) {
  board::SoftwareController controller;
  controller.start(demo_block(), {}, firmware::ResetCause::crash);
  firmware::CoSimulationInput down;
  firmware::CoSimulationOutput up;
  for (int k = 0; k < 100; ++k) {
    ++down.readings.motor_samples, ++down.readings.output_samples, ++down.readings.analog_samples;
    down.readings.torque = static_cast<std::int16_t>(1 + k % 2);
    up = controller.tick(down);
  }
  EXPECT_EQ(up.status.mode, Mode::fault);
  EXPECT_EQ(up.status.fault.fault, Fault::crashed);
}

// Parameter block.

control::DriveSetup<double> other_setup() {
  auto setup = demo_setup();
  setup.loops.current_limit = 1.0;
  setup.safety.stuck_torque = demo_drive().torque_constant_nm_a;
  return setup;
}
double largest_current(VirtualDrive& drive) {
  EXPECT_EQ(drive.command(arm_current(3.0)).refusal, Refusal::none);
  run_with_host(drive, 0.01);
  const double current = drive.rig().current_a();
  drive.command(of_kind(Command::Kind::disarm));
  run_with_host(drive, 1.0);
  return current;
}

TEST(ParameterBlock, OfAnIdleDriveIsReplacedAsAWhole) {
  const auto drive = idle_drive();
  EXPECT_NEAR(largest_current(*drive), 3.0, 1e-3);
  EXPECT_EQ(drive->commit(demo_block(other_setup())), BlockFinding::none);
  drive->run(2);
  EXPECT_NEAR(largest_current(*drive), 1.0, 1e-3);
}

TEST(ParameterBlock, CannotChangeWhileTheDriveIsArmed) {
  const auto drive = idle_drive();
  drive->command(arm_current(3.0));
  EXPECT_EQ(drive->commit(demo_block(other_setup())), BlockFinding::armed);
  drive->run(10);
  EXPECT_EQ(drive->status().mode, Mode::current);
  EXPECT_NEAR(drive->rig().current_a(), 3.0, 1e-3);
  drive->command(of_kind(Command::Kind::disarm));
  run_with_host(*drive, 1.0);
  EXPECT_NEAR(largest_current(*drive), 3.0, 1e-3);
}

TEST(ParameterBlock, ThatIsBadIsRefusedWithItsReasonAndTheOldOneStays) {
  const auto drive = idle_drive();
  const Block good = demo_block(other_setup());
  const auto expect_refused = [&](const Block& block, BlockFinding finding) {
    EXPECT_EQ(drive->commit(block), finding) << model::text_of(finding);
    EXPECT_STRNE(model::text_of(finding), "unknown fault");
    EXPECT_TRUE(drive->status().has_parameters);
    EXPECT_EQ(drive->status().mode, Mode::idle);
  };
  Block cut = good;
  cut.cut(1000);
  expect_refused(cut, BlockFinding::wrong_length);
  std::mt19937_64 random(1);
  for (int k = 0; k < 200; ++k) {
    Block flipped = good;
    const std::size_t bit = random() % (good.bytes().size() * 8);
    flipped.bytes()[bit / 8] ^= std::byte{static_cast<unsigned char>(1U << (bit % 8))};
    const BlockFinding finding = drive->commit(flipped);
    EXPECT_NE(finding, BlockFinding::none) << "bit " << bit;
  }
  // Well-formed, but not for this drive.
  auto parameters = board::parameters_of(demo_drive(), other_setup());
  parameters.tick_hz = 16'000;
  expect_refused(Block(parameters, demo_constants()), BlockFinding::other_tick_rate);
  parameters = board::parameters_of(demo_drive(), other_setup());
  parameters.motor_encoder.counts = 0;
  expect_refused(Block(parameters, demo_constants()), BlockFinding::wrong_coefficient);
  parameters = board::parameters_of(demo_drive(), other_setup());
  parameters.loops.torque_limit = {};
  expect_refused(Block(parameters, demo_constants()), BlockFinding::wrong_coefficient);
  EXPECT_NEAR(largest_current(*drive), 3.0, 1e-3);
}

TEST(ParameterBlock, ThatWasDamagedInFlashLeavesADriveThatCannotBeArmed) {
  Block block = demo_block();
  block.bytes()[200] ^= std::byte{4};
  VirtualDrive drive({.drive = demo_drive()}, block);
  drive.run(100);
  EXPECT_TRUE(drive.last().has_finding);
  EXPECT_EQ(drive.last().finding, BlockFinding::wrong_checksum);
  EXPECT_EQ(drive.status().mode, Mode::idle);
  EXPECT_EQ(drive.command(arm_current(1.0)).refusal, Refusal::no_parameters);
}

}  // namespace
}  // namespace flexspline::tests::firmware_telemetry_test
