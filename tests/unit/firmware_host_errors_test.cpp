// What a host does wrong, or a moment too early: streams that end in motion, orders to a drive that comes to rest by
// itself, requests before answers, blocks for a shaft that still turns.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/fault_texts.hpp"
#include "hil/twin/factory_block.hpp"
#include "tests/support/service_host.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_host_errors_test {
namespace {

std::string fault_of(const VirtualDrive& drive) {
  return std::string(firmware::info_of(drive.status().fault.fault).name);
}
Command streamed(double turns, double rad_s, double rad_s2) {
  Command c = arm_position(turns);
  c.stream = true;
  c.velocity = N::value(rad_s / demo_constants().velocity_base);
  c.acceleration = N::value(rad_s2 / demo_constants().acceleration_base);
  return c;
}

TEST(HostErrors, AStreamThatEndsInMotionBringsTheShaftToRestThoughTheHostIsThere) {
  const auto drive = idle_drive();
  drive->command(streamed(0.0, 0.0, 100.0));
  const std::uint32_t from = drive->status().tick;
  run_with_host(*drive, 2.0);
  EXPECT_EQ(fault_of(*drive), "set_point_lost");
  EXPECT_LE(drive->status().fault.tick - from, std::lround(demo_setup().safety.host_s * kTickHz) + 1);
  EXPECT_EQ(drive->status().mode, Mode::fault);
  EXPECT_LT(std::abs(drive->rig().truth().motor_velocity), 1.0);
  EXPECT_LT(drive->rig().truth().motor_angle, kTurn);
}

TEST(HostErrors, AStreamThatEndsAtRestMayStay) {
  const auto drive = idle_drive();
  drive->command(streamed(0.5, 0.0, 0.0));
  run_with_host(*drive, 2.0);
  EXPECT_EQ(drive->status().mode, Mode::position) << fault_of(*drive);
}

TEST(HostErrors, DisarmingADriveThatComesToRestBecauseOfAFaultLeavesItInThatFault) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.3);
  drive->rig().inject(Injection::torque_stuck);
  run_with_host(*drive, 0.02);
  ASSERT_EQ(drive->status().mode, Mode::stop);
  const firmware::Answer answer = drive->command(of_kind(Command::Kind::disarm));
  EXPECT_EQ(answer.refusal, Refusal::none);
  EXPECT_EQ(answer.mode, Mode::fault);
  EXPECT_EQ(fault_of(*drive), "torque_stuck");
  EXPECT_FALSE(drive->last().actuation.enabled);
  EXPECT_EQ(drive->command(arm_velocity(1.0)).refusal, Refusal::fault);
}

TEST(HostErrors, ALateTickInAFaultDoesNotHideWhatTheFaultWas) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.3);
  drive->rig().inject(Injection::current_surge);
  run_with_host(*drive, 0.02);
  ASSERT_EQ(fault_of(*drive), "overcurrent");
  const std::uint32_t when = drive->status().fault.tick;
  drive->rig().inject(Injection::tick_overrun);
  drive->run(10);
  EXPECT_EQ(fault_of(*drive), "overcurrent");
  EXPECT_EQ(drive->status().fault.tick, when);
}

TEST(HostErrors, EveryOneOfManyRequestsAtOnceIsAnswered) {
  twin::TwinDrive drive({.drive = demo_drive()});
  ServiceHost host(drive);
  drive.run(200);
  ASSERT_EQ(host.identify(), protocol::Code::done);
  // The command waits for the tick; what comes meanwhile is refused, and both are told.
  ASSERT_TRUE(drive.service().take(
      protocol::request(protocol::Kind::command, 7, protocol::Command{.kind = protocol::CommandKind::heartbeat})));
  ASSERT_TRUE(drive.service().take(protocol::request(protocol::Kind::status, 8, protocol::Empty{})));
  drive.run(5);
  protocol::Message m;
  ASSERT_TRUE(drive.service().next(m));
  EXPECT_EQ(m.number, 8);
  EXPECT_EQ(static_cast<protocol::Code>(m.code), protocol::Code::busy);
  drive.run(5);
  ASSERT_TRUE(drive.service().next(m));
  EXPECT_EQ(m.number, 7);
  EXPECT_EQ(static_cast<protocol::Code>(m.code), protocol::Code::done);
  EXPECT_FALSE(drive.service().next(m));
}

TEST(HostErrors, FlashMemoryIsNotErasedWhileTheShaftCoasts) {
  twin::TwinDrive drive({.drive = demo_drive()});
  ServiceHost host(drive);
  drive.run(200);
  ASSERT_EQ(host.identify(), protocol::Code::done);
  const auto block = twin::factory_block(demo_drive());
  ASSERT_EQ(host.arm(protocol::Mode::velocity).refusal, protocol::Refusal::none);
  protocol::Command set{.kind = protocol::CommandKind::set, .mode = protocol::Mode::velocity};
  set.velocity = N::value(0.5).raw;
  for (int ms = 0; ms < 300; ++ms) {
    host.command(set);
    drive.run(10);
  }
  ASSERT_GT(drive.rig().truth().motor_velocity, 50.0);
  host.command({.kind = protocol::CommandKind::disarm});
  EXPECT_EQ(host.flash(block), protocol::Code::moving);
  drive.run(20'000);
  EXPECT_EQ(drive.rig().truth().motor_velocity, 0.0);
  EXPECT_EQ(host.flash(block), protocol::Code::done);
}

// A motor of 16384 counts passes 2^31 of them after 131,072 turns.
TEST(HostErrors, NewParametersLeaveTheAngleWhereItIsHoweverOftenTheCounterWrapped) {
  Block block = demo_block();
  board::SoftwareController controller;
  controller.start(block, {.every = 1, .count = 1, .channels = {Channel::motor_turns}}, firmware::ResetCause::power);
  firmware::CoSimulationInput down;
  std::uint32_t turns = 0;
  const auto tick = [&](std::uint32_t counts) {
    down.readings.motor_counter += counts;
    ++down.readings.motor_samples, ++down.readings.output_samples, ++down.readings.analog_samples;
    down.readings.torque = static_cast<std::int16_t>(1 + down.readings.motor_samples % 2);
    const firmware::CoSimulationOutput up = controller.tick(down);
    if (up.frame_words > 2) turns = up.frame[2];
    return up;
  };
  for (int k = 0; k < 100; ++k) tick(0);
  for (int k = 0; k < 150'000; ++k) tick(16384);
  ASSERT_EQ(turns, 150'000U);
  controller.offer(block.bytes());
  bool taken = false;
  for (int k = 0; k < 20; ++k) taken = tick(0).has_finding || taken;
  EXPECT_TRUE(taken);
  EXPECT_EQ(turns, 150'000U);
}

}  // namespace
}  // namespace flexspline::tests::firmware_host_errors_test
