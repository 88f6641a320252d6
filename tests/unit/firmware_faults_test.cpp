// Every fault, brought about on the software board: it is found within the ticks that firmware/README.md states, and
// ends in the safe state that it states.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <set>
#include <string>

#include "firmware/fault_texts.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests {
namespace {

using firmware::SafeState;

struct Case {
  Fault fault;
  std::function<void(VirtualDrive&)> cause;
  std::uint32_t ticks;  // at most, until the fault is known
  bool host = true;     // says meanwhile that it is there
};
std::string_view name_of(Fault fault) {
  return firmware::info_of(fault).name;
}
std::ostream& operator<<(std::ostream& out, const Case& c) {
  return out << name_of(c.fault);
}
std::function<void(VirtualDrive&)> injected(Injection what) {
  return [what](VirtualDrive& drive) { drive.rig().inject(what); };
}
std::uint32_t ticks_of(double seconds) {
  return static_cast<std::uint32_t>(std::lround(seconds * kTickHz));
}

std::vector<Case> cases() {
  const auto& s = demo_setup().safety;
  const auto stated = [](Fault fault) { return firmware::info_of(fault).ticks; };
  // The encoder's filter has to show what the shaft cannot do, and a load has to speed the shaft up first.
  constexpr std::uint32_t kFilter = 60, kSpeedUp = 6000;
  return {
      {Fault::motor_encoder_stale, injected(Injection::motor_encoder_stale), stated(Fault::motor_encoder_stale)},
      {Fault::output_encoder_stale, injected(Injection::output_encoder_stale), stated(Fault::output_encoder_stale)},
      {Fault::analog_stale, injected(Injection::analog_stale), stated(Fault::analog_stale)},
      {Fault::motor_encoder_jump, injected(Injection::motor_encoder_jump), stated(Fault::motor_encoder_jump)},
      {Fault::implausible_motion, injected(Injection::motor_encoder_stuck), kFilter},
      {Fault::current_out_of_range, injected(Injection::current_out_of_range), stated(Fault::current_out_of_range)},
      {Fault::torque_out_of_range, injected(Injection::torque_out_of_range), stated(Fault::torque_out_of_range)},
      {Fault::temperature_out_of_range, injected(Injection::temperature_out_of_range),
       stated(Fault::temperature_out_of_range)},
      {Fault::torque_stuck, injected(Injection::torque_stuck), ticks_of(s.torque_same_s) + 1},
      {Fault::current_mismatch,
       [](VirtualDrive& drive) {
         drive.rig().inject(Injection::amplifier_dead);
         drive.post(as_set_point(arm_velocity(150.0)));
       },
       ticks_of(s.mismatch_s) + ticks_of(0.05)},
      {Fault::overcurrent, injected(Injection::current_surge), stated(Fault::overcurrent) + 1},
      {Fault::overspeed, [](VirtualDrive& drive) { drive.rig().set_load_torque(-60.0); }, kSpeedUp},
      {Fault::overtemperature, [](VirtualDrive& drive) { drive.rig().set_temperature(95.0); },
       stated(Fault::overtemperature)},
      {Fault::host_lost, [](VirtualDrive&) {}, ticks_of(s.host_s) + 1, false},
      {Fault::tick_overrun, injected(Injection::tick_overrun), stated(Fault::tick_overrun)},
  };
}

class Faults : public testing::TestWithParam<Case> {};

TEST_P(Faults, EndInTheirSafeStateWithinTheStatedTicks) {
  const Case& c = GetParam();
  const auto drive = idle_drive();
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.3);
  ASSERT_EQ(drive->status().mode, Mode::velocity);
  c.cause(*drive);
  std::uint32_t ticks = 0;
  for (; ticks < 20'000 && drive->status().fault.fault == Fault::none; ++ticks) {
    if (c.host && ticks % 20 == 19) drive->post(of_kind(Command::Kind::heartbeat));
    drive->run(1);
  }
  ASSERT_EQ(name_of(drive->status().fault.fault), name_of(c.fault));
  EXPECT_LE(ticks, c.ticks);
  const double velocity = drive->rig().truth().motor_velocity;
  if (firmware::ends_in(c.fault) == SafeState::off) {
    EXPECT_EQ(drive->status().mode, Mode::fault);
    EXPECT_FALSE(drive->last().actuation.enabled);
    EXPECT_EQ(drive->last().actuation.current, 0);
  } else {
    EXPECT_EQ(drive->status().mode, Mode::stop);
    EXPECT_NEAR(velocity, 60.0, 5.0);
    EXPECT_TRUE(drive->last().actuation.enabled);
    // With the limited deceleration, and a time to settle.
    const double stop_s = 60.0 / demo_setup().trajectory.acceleration_limit;
    drive->run_seconds(stop_s + 0.15);
    EXPECT_EQ(drive->status().mode, Mode::fault);
    EXPECT_LT(std::abs(drive->rig().truth().motor_velocity), 2.0);
    EXPECT_FALSE(drive->last().actuation.enabled);
  }
  // It stays off until somebody clears it, and says why.
  drive->run(1000);
  EXPECT_EQ(drive->command(arm_velocity(1.0)).refusal, Refusal::fault);
  EXPECT_EQ(drive->status().mode, Mode::fault);
  EXPECT_EQ(drive->status().fault.fault, c.fault);
  EXPECT_FALSE(drive->last().actuation.enabled);
}
INSTANTIATE_TEST_SUITE_P(All, Faults, testing::ValuesIn(cases()),
                         [](const auto& a_case) { return std::string(name_of(a_case.param.fault)); });

TEST(Fault, AnEncoderThatIsStuckFromTheStartIsFoundByTheTorqueThatMovesNothing) {
  const auto drive = idle_drive();
  drive->rig().inject(Injection::motor_encoder_stuck);
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 1.0);
  EXPECT_EQ(drive->status().mode, Mode::fault);
  EXPECT_EQ(drive->status().fault.fault, Fault::motor_encoder_stuck);
  // It drove for as long as the torque took to rise, and then for the stated time.
  EXPECT_LT(drive->status().fault.tick, 100 + ticks_of(0.4 + demo_setup().safety.stuck_s));
}

TEST(Fault, AStopThatDoesNotComeToRestSwitchesOffInTheStatedTime) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.3);
  // More than the drive can hold, below the overspeed at first: the host is lost and the load drives on.
  drive->rig().set_load_torque(-28.0);
  const std::uint32_t from = drive->status().tick;
  while (drive->status().mode != Mode::fault && drive->status().tick < from + 60'000) drive->run(1);
  EXPECT_EQ(drive->status().fault.fault, Fault::stop_failed);
  EXPECT_EQ(static_cast<Fault>(drive->status().fault.seen), Fault::host_lost);
  EXPECT_LE(drive->status().tick - from, ticks_of(demo_setup().safety.host_s + demo_setup().safety.stop_s) + 2);
  EXPECT_FALSE(drive->last().actuation.enabled);
}

TEST(Fault, ASecondFaultWhileStoppingSwitchesOffAtOnce) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(100.0));
  run_with_host(*drive, 0.5);
  drive->rig().inject(Injection::temperature_out_of_range);
  drive->run(5);
  ASSERT_EQ(drive->status().mode, Mode::stop);
  drive->rig().inject(Injection::motor_encoder_stale);
  drive->run(firmware::kStaleTicks);
  EXPECT_EQ(drive->status().mode, Mode::fault);
  EXPECT_EQ(drive->status().fault.fault, Fault::motor_encoder_stale);
  EXPECT_FALSE(drive->last().actuation.enabled);
}

TEST(Fault, IsClearedOnlyWhereItsCauseIsGone) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.2);
  drive->rig().inject(Injection::torque_out_of_range);
  drive->run(10);
  ASSERT_EQ(drive->status().mode, Mode::fault);
  run_with_host(*drive, 1.0);
  drive->command(of_kind(Command::Kind::clear_fault));
  drive->run(100);
  EXPECT_EQ(drive->status().mode, Mode::fault);
  drive->rig().clear(Injection::torque_out_of_range);
  drive->command(of_kind(Command::Kind::clear_fault));
  EXPECT_EQ(drive->command(arm_velocity(60.0)).refusal, Refusal::booting);
  drive->run(100);
  EXPECT_EQ(drive->status().mode, Mode::idle);
  EXPECT_EQ(drive->command(arm_velocity(60.0)).refusal, Refusal::none);
  run_with_host(*drive, 0.3);
  EXPECT_NEAR(drive->rig().truth().motor_velocity, 60.0, 2.0);
}

TEST(Fault, ASingleBadSampleOfAnAnalogueInputIsNone) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.2);
  for (int k = 0; k < 50; ++k) {
    drive->rig().inject(Injection::torque_out_of_range);
    drive->run(firmware::kRangeTicks - 1);
    drive->rig().clear(Injection::torque_out_of_range);
    drive->post(of_kind(Command::Kind::heartbeat));
    drive->run(20);
  }
  EXPECT_EQ(drive->status().mode, Mode::velocity);
}

// What is usual on a drive is no fault: full torque, reversals, standstill under load, a hard stop of the set point.
TEST(Fault, HardUseIsNone) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(0.0));
  for (int k = 0; k < 20; ++k) {
    const double v = k % 3 == 0 ? 190.0 : k % 3 == 1 ? -190.0 : 0.0;
    ASSERT_EQ(drive->command(as_set_point(arm_velocity(v))).refusal, Refusal::none);
    drive->rig().set_load_torque(k % 2 == 0 ? 8.0 : -8.0);
    run_with_host(*drive, 0.3);
    ASSERT_EQ(drive->status().mode, Mode::velocity) << name_of(drive->status().fault.fault);
  }
  // At rest against friction for long.
  drive->command(arm_current(0.3));
  run_with_host(*drive, 3.0);
  EXPECT_EQ(drive->status().mode, Mode::current) << name_of(drive->status().fault.fault);
}

TEST(Fault, EachHasANameOfItsOwnAReasonAndAStatedTime) {
  std::set<std::string_view> names, reasons;
  for (const firmware::FaultInfo& info : firmware::kFaultTable) {
    names.insert(info.name);
    reasons.insert(info.reason);
    // A time that is a parameter is named in the reason.
    if (info.ticks == 0 && info.fault != Fault::none) {
      EXPECT_NE(info.reason.find('('), std::string_view::npos) << info.name;
    }
  }
  EXPECT_EQ(names.size(), firmware::kFaults);
  EXPECT_EQ(reasons.size(), firmware::kFaults);
}

}  // namespace
}  // namespace flexspline::tests
