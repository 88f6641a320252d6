// The watch for an encoder of the motor that is stuck, and all that looks like one: torque faster than the shaft,
// what braked it, friction that holds most of what the drive can give.
#include <gtest/gtest.h>

#include <cmath>

#include "firmware/fault_texts.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_stuck_encoder_test {
namespace {

std::string fault_of(const VirtualDrive& drive) {
  return std::string(firmware::info_of(drive.status().fault.fault).name);
}
double torque_nm(double amperes) {
  return amperes * demo_drive().torque_constant_nm_a;
}
void set_current(VirtualDrive& drive, double amperes) {
  ASSERT_EQ(drive.command(as_set_point(arm_current(amperes))).refusal, Refusal::none);
}
double ticks_in(double seconds) {
  return seconds * kTickHz;
}

// 3 A to and fro at 1 kHz turn a free shaft by half a count of 16384; at 5 kHz by a fiftieth.
TEST(StuckEncoder, ATorqueThatGoesToAndFroFasterThanTheShaftFollowsShowsNone) {
  for (const double hz : {1000.0, 2000.0, 5000.0}) {
    const auto drive = idle_drive();
    drive->command(arm_current(0.0));
    const auto half = static_cast<std::uint32_t>(std::lround(0.5 * kTickHz / hz));
    ASSERT_GT(torque_nm(6.0), demo_setup().safety.stuck_torque);
    for (std::uint32_t k = 0; k < kTickHz && drive->status().mode == Mode::current; k += half) {
      set_current(*drive, k / half % 2 == 0 ? 3.0 : -3.0);
      drive->run(half);
    }
    EXPECT_EQ(fault_of(*drive), "none") << hz << " Hz";
  }
}

// A host with loops of its own brakes as hard as it may, sees standstill and lets go. What braked does not hold.
TEST(StuckEncoder, WhatBrakedTheShaftToRestIsNotHeldByFriction) {
  const auto drive = idle_drive();
  drive->command(arm_current(3.5));
  for (const double way : {1.0, -1.0, 1.0, -1.0}) {
    set_current(*drive, way * 3.5);
    run_with_host(*drive, 0.05);
    ASSERT_GT(way * drive->rig().truth().motor_velocity, 20.0);
    set_current(*drive, way * -3.5);
    while (way * drive->rig().truth().motor_velocity > 0.0 && drive->status().mode == Mode::current) drive->run(1);
    set_current(*drive, 0.0);
    run_with_host(*drive, 0.2);
    ASSERT_EQ(fault_of(*drive), "none");
  }
}

// Slowly from one side of what friction holds to the other, which here is more than three quarters of all torque.
TEST(StuckEncoder, AShaftThatFrictionHoldsIsNoneHoweverWeakTheDrive) {
  plant::Drive weak = demo_drive();
  weak.current_limit_a = 1.2;
  const auto& friction = weak.find("coulomb_friction")->value("torque");
  const auto setup = board::setup_of(weak);
  const double held_a = friction / weak.torque_constant_nm_a;
  ASSERT_GT(2.0 * held_a, 0.75 * weak.current_limit_a);
  VirtualDrive drive({.drive = weak, .seed = 1}, Block(board::parameters_of(weak, setup), board::constants_of(weak)));
  drive.run(100);
  Command c = arm(Mode::current);
  const auto current = [&](double amperes) {
    c.current = N::value(amperes / board::constants_of(weak).current_base);
    return drive.command(c).refusal;
  };
  ASSERT_EQ(current(0.0), Refusal::none);
  c.kind = Command::Kind::set;
  for (int ms = 0; ms < 4000; ++ms) {
    ASSERT_EQ(current(0.95 * held_a * std::sin(kTurn * 1e-3 * ms)), Refusal::none) << ms << " " << fault_of(drive);
    drive.run(kTickHz / 1000);
  }
  EXPECT_EQ(fault_of(drive), "none");
}

TEST(StuckEncoder, IsFoundWithinTheStatedTimeWhereTheShaftStoodBefore) {
  for (const double rest_s : {0.02, 0.5}) {
    const auto drive = idle_drive();
    drive->command(arm_velocity(60.0));
    run_with_host(*drive, 0.2);
    drive->command(as_set_point(arm_velocity(0.0)));
    run_with_host(*drive, 0.3 + rest_s);
    ASSERT_LT(std::abs(drive->rig().truth().motor_velocity), 1.0);
    drive->rig().inject(Injection::motor_encoder_stuck);
    const std::uint32_t from = drive->status().tick;
    drive->command(as_set_point(arm_velocity(-60.0)));
    run_with_host(*drive, 0.5);
    ASSERT_EQ(fault_of(*drive), "motor_encoder_stuck") << rest_s;
    EXPECT_EQ(drive->status().mode, Mode::fault);
    // The torque rises to its limit in a hundredth of a second, and as long it takes to be felt.
    EXPECT_LT(drive->status().fault.tick - from, ticks_in(0.02 + 1.2 * demo_setup().safety.stuck_s));
  }
}

}  // namespace
}  // namespace flexspline::tests::firmware_stuck_encoder_test
