// A zero that the drive keeps in its parameter block: it holds after the next power-on, and what makes it invalid.
#include "host/drive_link/drive/stored_zero.hpp"

#include <gtest/gtest.h>

#include <cmath>

#include "hil/twin/factory_block.hpp"
#include "tests/support/loopback.hpp"
#include "tests/support/service_host.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::stored_zero_test {
namespace {

using control::SensorKind;

// Turns of the motor by which the drive's angle is off from the true one.
double offset_of(twin::TwinDrive& drive) {
  ServiceHost host(drive);
  EXPECT_EQ(host.identify(), protocol::Code::done);
  protocol::Subscription wanted;
  wanted.every = 10;
  wanted.count = 2;
  wanted.channels[0] = protocol::Channel::motor_turns;
  wanted.channels[1] = protocol::Channel::motor_fraction;
  EXPECT_EQ(host.code(protocol::Kind::telemetry, wanted), protocol::Code::done);
  drive.run(500);
  protocol::Message m, last;
  for (int k = 0; k < 500 && drive.service().next(m); ++k)
    if (m.is_unasked()) last = m;
  if (!last.is_unasked()) return NAN;
  model::Reader r(last.content());
  r.skip(8);
  const auto turns = r.take<std::int32_t>();
  const auto fraction = r.take<std::uint32_t>();
  return turns + std::ldexp(fraction, -32) - drive.rig().truth().motor_angle / kTurn;
}
// Within a turn of the motor.
double rest(double turns) {
  return turns - std::round(turns);
}
twin::TwinSetup setup_of(twin::FlashFile& flash, SensorKind encoders, double wakes) {
  return {.drive = demo_drive(), .start_turns = wakes, .encoders = encoders, .flash = &flash};
}
void home(twin::TwinDrive& drive, double turns, bool store) {
  drive::Session session = open_session(drive);
  const std::int64_t position = std::llround(std::ldexp(turns, 32));
  session.home(position);
  if (store) drive::store_zero(session, position);
}
// Twenty turns at 40 rad/s, so that an index pulse comes by.
void move(twin::TwinDrive& drive) {
  ServiceHost host(drive);
  host.identify();
  ASSERT_EQ(
      host.command({.kind = protocol::CommandKind::arm, .mode = protocol::Mode::velocity, .velocity = 1 << 25}).refusal,
      protocol::Refusal::none);
  for (int k = 0; k < 200; ++k) {
    host.command({.kind = protocol::CommandKind::heartbeat});
    drive.run(20);
  }
  host.command({.kind = protocol::CommandKind::disarm});
  drive.run(20'000);
}

TEST(StoredZero, OfAbsoluteEncodersHoldsAfterTheNextPowerOnWhereverTheShaftWakes) {
  twin::FlashFile flash;
  {
    twin::TwinDrive drive(setup_of(flash, SensorKind::absolute, 0.4));
    drive.run(200);
    EXPECT_NEAR(offset_of(drive), 0.0, 1e-3) << "the encoder's own zero";
    home(drive, -3.3, true);
    EXPECT_NEAR(offset_of(drive), -3.7, 1e-3);
  }
  for (const double wakes : {0.4, -1.7, 12.25, -30.0}) {
    twin::TwinDrive drive(setup_of(flash, SensorKind::absolute, wakes));
    drive.run(200);
    EXPECT_TRUE(drive.status().knows_turn && drive.status().knows_output);
    EXPECT_NEAR(offset_of(drive), -3.7, 3e-3) << wakes;
  }
}

TEST(StoredZero, OfAnIndexPulseHoldsOnceThePulseCameAgain) {
  twin::FlashFile flash;
  {
    twin::TwinDrive drive(setup_of(flash, SensorKind::indexed, 0.4));
    drive.run(200);
    drive::Session session = open_session(drive);
    session.home(0);
    EXPECT_THROW(drive::store_zero(session, 0), drive::DriveError) << "the pulse was not there yet";
    move(drive);
    home(drive, 5.1, true);
    EXPECT_TRUE(drive.status().knows_turn && drive.status().knows_output) << "as before it was stored";
  }
  double off = 0.0;
  {
    twin::TwinDrive drive(setup_of(flash, SensorKind::indexed, -0.6));
    drive.run(200);
    EXPECT_FALSE(drive.status().knows_turn);
    move(drive);
    EXPECT_TRUE(drive.status().knows_turn);
    EXPECT_FALSE(drive.status().knows_output);
    off = offset_of(drive);
  }
  twin::TwinDrive drive(setup_of(flash, SensorKind::indexed, 1.3));
  drive.run(200);
  move(drive);
  EXPECT_NEAR(rest(offset_of(drive) - off), 0.0, 1e-3) << "the same within a turn, wherever it wakes";
  EXPECT_GT(std::abs(rest(off)), 1e-3) << "and not that of the pulse alone";
}

TEST(StoredZero, OfIncrementalEncodersCannotBeStored) {
  twin::FlashFile flash;
  twin::TwinDrive drive(setup_of(flash, SensorKind::incremental, 0.4));
  EXPECT_THROW(home(drive, 1.0, true), drive::DriveError);
  EXPECT_TRUE(drive.status().knows_turn) << "the homing itself is good";
}

TEST(StoredZero, IsRefusedWhereItsEncoderIsAnotherOne) {
  const auto block = twin::factory_block(demo_drive());
  const auto fault = [&](const control::StoredZero& zero, SensorKind encoders) {
    const auto with = drive::with_stored_zero(block, zero);
    return control::check_for_drive(with, kTickHz, board::hardware_of(demo_drive(), encoders)).fault;
  };
  const auto counts = static_cast<std::uint32_t>(demo_drive().sensors.motor_counts);
  const auto of = [](SensorKind kind) { return static_cast<std::uint32_t>(kind); };
  using model::BlockFault;
  EXPECT_EQ(fault({{counts, counts - 1, of(SensorKind::absolute)}, {}}, SensorKind::absolute), BlockFault::none);
  EXPECT_EQ(fault({{counts, counts, of(SensorKind::absolute)}, {}}, SensorKind::absolute),
            BlockFault::unlike_coefficients)
      << "not within a turn";
  EXPECT_EQ(fault({{counts / 2, 1, of(SensorKind::absolute)}, {}}, SensorKind::absolute),
            BlockFault::unlike_coefficients)
      << "another number of counts";
  EXPECT_EQ(fault({{0, 1, 0}, {}}, SensorKind::absolute), BlockFault::unlike_coefficients);
  EXPECT_EQ(fault({{counts, 1, of(SensorKind::absolute)}, {}}, SensorKind::indexed), BlockFault::other_hardware);
  EXPECT_EQ(fault({{counts, 1, of(SensorKind::incremental)}, {}}, SensorKind::incremental), BlockFault::other_hardware);
}

TEST(StoredZero, StaysWithANewModelUnlessTheCountsDiffer) {
  const auto block = twin::factory_block(demo_drive());
  const auto counts = static_cast<std::uint32_t>(demo_drive().sensors.motor_counts);
  const control::StoredZero zero{{counts, 7, static_cast<std::uint32_t>(SensorKind::absolute)}, {}};
  const auto active = drive::with_stored_zero(block, zero);
  EXPECT_EQ(drive::stored_zero_of(drive::keeping_stored_zero(block, active)), zero);
  EXPECT_EQ(drive::with_stored_zero(active, {}), block) << "all else is as it was";
  plant::Drive other = demo_drive();
  other.sensors.motor_counts *= 2;
  const auto of_other = twin::factory_block(other);
  EXPECT_EQ(drive::keeping_stored_zero(of_other, active), of_other);
  EXPECT_EQ(drive::keeping_stored_zero(block, {}), block);
}

}  // namespace
}  // namespace flexspline::tests::stored_zero_test
