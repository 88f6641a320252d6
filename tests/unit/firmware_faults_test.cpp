// Most faults, injected on the software board: each is found within the ticks that firmware/OPERATION.md states, and
// ends in the safe state that it states. Others: firmware_stuck_encoder_test, firmware_sensor_faults_test,
// firmware_host_errors_test, firmware_telemetry_test (watchdog).
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <functional>
#include <ostream>
#include <set>
#include <string>

#include "firmware/fault_texts.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_faults_test {
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

// By how much the output may turn before its encoder has to show it, and a twentieth for the velocity's waves.
std::uint32_t stuck_output_ticks(double motor_rad_s) {
  return ticks_of(1.05 * demo_setup().safety.output_stuck * demo_drive().gear_ratio / motor_rad_s);
}

std::vector<Case> cases() {
  const auto& s = demo_setup().safety;
  const auto stated = [](Fault fault) { return firmware::info_of(fault).ticks; };
  // The encoder's filter has to show what the shaft cannot do, and a load has to speed the shaft up first.
  constexpr std::uint32_t kFilter = 60, kSpeedUp = 6000;
  // What the amplifier does wrong in a tick is sampled by the next one.
  constexpr std::uint32_t kSampled = 1;
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
      {Fault::torque_stuck, injected(Injection::torque_stuck), ticks_of(s.torque_same_s)},
      {Fault::current_mismatch, injected(Injection::amplifier_dead), ticks_of(s.mismatch_s) + kSampled},
      {Fault::overcurrent, injected(Injection::current_surge), stated(Fault::overcurrent) + kSampled},
      {Fault::overspeed, [](VirtualDrive& drive) { drive.rig().set_load_torque(-60.0); }, kSpeedUp},
      {Fault::overtemperature, [](VirtualDrive& drive) { drive.rig().set_temperature(95.0); },
       stated(Fault::overtemperature)},
      {Fault::amplifier_fault, [](VirtualDrive& drive) { software(drive).trip_amplifier(true); },
       stated(Fault::amplifier_fault)},
      {Fault::host_lost, [](VirtualDrive&) {}, ticks_of(s.host_s), false},
      {Fault::tick_overrun, injected(Injection::tick_overrun), stated(Fault::tick_overrun)},
      // At 60 rad/s the motor has turned by so much within:
      {Fault::output_encoder_stuck, injected(Injection::output_encoder_stuck), stuck_output_ticks(60.0)},
      // More than the drive can hold turns it backwards.
      {Fault::following_error, [](VirtualDrive& drive) { drive.rig().set_load_torque(45.0); },
       kSpeedUp + ticks_of(s.following_s)},
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

// Of two lines that are a quarter of a period apart one is lost: the count goes to and fro by one.
TEST(Fault, ALostLineOfTheOutputsEncoderIsFoundAsOneThatIsStuckAndTheShaftComesToRest) {
  for (const double velocity : {60.0, -10.0}) {
    const auto drive = idle_drive();
    drive->command(arm_velocity(velocity));
    run_with_host(*drive, 0.3);
    drive->rig().inject(Injection::output_line_lost);
    const std::uint32_t from = drive->status().tick;
    run_with_host(*drive, 1.0);
    EXPECT_EQ(name_of(drive->status().fault.fault), "output_encoder_stuck");
    EXPECT_LE(drive->status().fault.tick - from, stuck_output_ticks(std::abs(velocity)));
    EXPECT_EQ(drive->status().mode, Mode::fault);
    EXPECT_EQ(drive->rig().truth().motor_velocity, 0.0);
  }
}

// Locked, the motor twists the gear by all that it can, to and fro.
TEST(Fault, ALockedOutputIsNoStuckEncoder) {
  VirtualDrive drive({.drive = demo_drive(), .seed = 1, .locked = true}, demo_block());
  drive.run(100);
  drive.command(arm_current(0.0));
  for (int k = 0; k < 10; ++k) {
    drive.command(as_set_point(arm_current(k % 2 == 0 ? 3.5 : -3.5)));
    run_with_host(drive, 0.1);
    ASSERT_EQ(drive.status().mode, Mode::current) << name_of(drive.status().fault.fault);
  }
}

// A load that the drive cannot hold drags it away from its target position. At standstill an eighth of the limit is
// allowed.
TEST(Fault, AFollowingErrorIsFoundTheStatedTimeAfterItsLimitWasPassed) {
  const auto& s = demo_setup().safety;
  const double allowed = s.following_error / 8.0;
  for (const double load : {-45.0, 30.0}) {
    const auto drive = idle_drive();
    drive->command(arm_position(0.0));
    run_with_host(*drive, 1.0);
    drive->rig().set_load_torque(load);
    std::uint32_t passed = 0;
    while (drive->status().fault.fault == Fault::none && drive->status().tick < 60'000) {
      if (passed == 0 && std::abs(drive->rig().truth().motor_angle) > allowed) passed = drive->status().tick;
      drive->post(of_kind(Command::Kind::heartbeat));
      drive->run(1);
    }
    EXPECT_EQ(name_of(drive->status().fault.fault), "following_error");
    EXPECT_EQ(drive->status().mode, Mode::fault);
    EXPECT_FALSE(drive->last().actuation.enabled);
    EXPECT_NEAR(drive->status().fault.tick - passed, ticks_of(s.following_s), 3.0);
    // What was seen and what its limit was, in 2^-16 turns of the motor.
    EXPECT_NEAR(drive->status().fault.limit / 65536.0 * kTurn, allowed, 1e-3);
    EXPECT_GT(drive->status().fault.seen, drive->status().fault.limit);
  }
}

TEST(Fault, AStreamThatBeginsFarAwayIsReachedAndOneThatJumpsThenIsAFollowingError) {
  const auto drive = idle_drive();
  const auto stream = [](double turns) {
    Command c = arm_position(turns);
    c.stream = true;
    return c;
  };
  const double far = 5.0 * demo_setup().safety.following_error / kTurn;
  ASSERT_EQ(drive->command(stream(far)).refusal, Refusal::none);
  run_with_host(*drive, 1.0);
  ASSERT_EQ(drive->status().mode, Mode::position) << name_of(drive->status().fault.fault);
  EXPECT_NEAR(drive->rig().truth().motor_angle / kTurn, far, 0.01);
  drive->command(as_set_point(stream(0.0)));
  run_with_host(*drive, 2.0 * demo_setup().safety.following_s);
  EXPECT_EQ(name_of(drive->status().fault.fault), "following_error");
}

// Blocks of drives that were packed before there were these limits.
TEST(Fault, ABlockWithoutLimitsOfFollowingIsTakenAndTheyAreNotWatched) {
  auto setup = demo_setup();
  setup.safety.following_error = 0.0;
  const auto drive = idle_drive(setup);
  drive->rig().inject(Injection::output_encoder_stuck);
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 1.0);
  EXPECT_EQ(drive->status().mode, Mode::velocity) << name_of(drive->status().fault.fault);
  drive->command(arm_position(20.0));
  drive->rig().set_load_torque(21.0);
  run_with_host(*drive, 0.3);
  EXPECT_NE(drive->status().fault.fault, Fault::following_error);
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

// Some causes of a controlled stop last as long as the stop: their fault is found again in each tick of it.
TEST(Fault, WhileTheCauseOfAStopLastsEveryFaultThatSwitchesOffIsStillFound) {
  const std::pair<Fault, std::function<void(VirtualDrive&)>> first_causes[] = {
      {Fault::overtemperature, [](VirtualDrive& drive) { drive.rig().set_temperature(95.0); }},
      {Fault::temperature_out_of_range, injected(Injection::temperature_out_of_range)},
      {Fault::torque_stuck, injected(Injection::torque_stuck)}};
  const std::pair<Fault, std::function<void(VirtualDrive&)>> second_causes[] = {
      {Fault::motor_encoder_stale, injected(Injection::motor_encoder_stale)},
      {Fault::motor_encoder_jump, injected(Injection::motor_encoder_jump)},
      {Fault::current_out_of_range, injected(Injection::current_out_of_range)},
      {Fault::overcurrent, injected(Injection::current_surge)},
      {Fault::amplifier_fault, [](VirtualDrive& drive) { software(drive).trip_amplifier(true); }}};
  for (const auto& [first, begin] : first_causes) {
    for (const auto& [second, add] : second_causes) {
      const auto drive = idle_drive();
      drive->command(arm_velocity(150.0));
      run_with_host(*drive, 0.5);
      begin(*drive);
      for (int k = 0; k < 4000 && drive->status().mode != Mode::stop; ++k) run_with_host(*drive, 1.0 / kTickHz);
      ASSERT_EQ(drive->status().mode, Mode::stop) << name_of(first);
      ASSERT_EQ(drive->status().fault.fault, first);
      add(*drive);
      drive->run(firmware::info_of(second).ticks + 1);
      EXPECT_EQ(drive->status().mode, Mode::fault) << name_of(first) << ", then " << name_of(second);
      EXPECT_EQ(name_of(drive->status().fault.fault), name_of(second)) << "after " << name_of(first);
      EXPECT_FALSE(drive->last().actuation.enabled);
    }
  }
}

TEST(Fault, ATorqueSensorThatIsStuckForLongCannotBeCleared) {
  const auto drive = idle_drive();
  drive->rig().inject(Injection::torque_stuck);
  drive->run((1U << 16) + 10);
  ASSERT_EQ(name_of(drive->status().fault.fault), "torque_stuck");
  drive->command(of_kind(Command::Kind::clear_fault));
  drive->run(100);
  EXPECT_EQ(drive->status().mode, Mode::fault);
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
  // From turn to turn as fast as the limits allow, and held against a load.
  for (int k = 0; k < 8; ++k) {
    ASSERT_EQ(drive->command(arm_position(k % 2 == 0 ? 8.0 : -3.0)).refusal, Refusal::none);
    drive->rig().set_load_torque(k % 3 == 0 ? 3.0 : -3.0);
    run_with_host(*drive, 0.5);
    ASSERT_EQ(drive->status().mode, Mode::position) << name_of(drive->status().fault.fault);
  }
  // At rest against friction for long.
  drive->command(arm_current(0.3));
  run_with_host(*drive, 3.0);
  EXPECT_EQ(drive->status().mode, Mode::current) << name_of(drive->status().fault.fault);
}

TEST(Fault, EachHasANameOfItsOwnAReasonAndAStatedTime) {
  std::set<std::string_view> names, reasons, without_time;
  for (const firmware::FaultInfo& info : firmware::kFaultTable) {
    names.insert(info.name);
    reasons.insert(info.reason);
    // A time that is a parameter is named in the reason.
    if (!info.time_parameter.empty()) {
      EXPECT_NE(info.reason.find(info.time_parameter), std::string_view::npos) << info.name;
      EXPECT_EQ(info.ticks, 0U) << info.name;
    } else if (info.ticks == 0) {
      without_time.insert(info.name);
    }
  }
  const std::set<std::string_view> levels{"none", "implausible_motion", "output_encoder_stuck", "encoders_disagree",
                                          "crashed"};
  EXPECT_EQ(without_time, levels);
  EXPECT_EQ(names.size(), firmware::kFaults);
  EXPECT_EQ(reasons.size(), firmware::kFaults);
}

}  // namespace
}  // namespace flexspline::tests::firmware_faults_test
