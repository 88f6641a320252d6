// The modes of the application: what leads from one to another, what is refused, and what each of them does to the
// shaft, on the software board with the demo's drive around it.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>

#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_modes_test {
namespace {

TEST(Modes, ADriveIsIdleOnceItsSensorsWereFoundGoodForAWhile) {
  VirtualDrive drive({.drive = demo_drive()}, demo_block());
  drive.run(49);
  EXPECT_EQ(drive.status().mode, Mode::boot);
  EXPECT_EQ(drive.command(arm(Mode::current)).refusal, Refusal::booting);
  drive.run(1);
  EXPECT_EQ(drive.status().mode, Mode::idle);
  EXPECT_FALSE(drive.last().actuation.enabled);
}

TEST(Modes, WithoutParametersADriveIsIdleAndCannotBeArmed) {
  VirtualDrive drive({.drive = demo_drive()}, Block());
  drive.run(100);
  EXPECT_EQ(drive.status().mode, Mode::idle);
  EXPECT_FALSE(drive.status().has_parameters);
  EXPECT_EQ(drive.command(arm(Mode::velocity)).refusal, Refusal::no_parameters);
  EXPECT_EQ(drive.commit(demo_block()), firmware::BlockFinding::none);
  drive.run(2);
  EXPECT_EQ(drive.command(arm(Mode::velocity)).refusal, Refusal::none);
  EXPECT_EQ(drive.status().mode, Mode::velocity);
}

TEST(Modes, ASetPointForAnotherModeAndOneForADriveThatIsOffAreRefused) {
  const auto drive = idle_drive();
  EXPECT_EQ(drive->command(as_set_point(arm_velocity(10.0))).refusal, Refusal::not_armed);
  EXPECT_EQ(drive->command(of_kind(Command::Kind::disarm)).refusal, Refusal::not_armed);
  EXPECT_EQ(drive->command(arm_velocity(10.0)).refusal, Refusal::none);
  EXPECT_EQ(drive->command(as_set_point(arm_position(1.0))).refusal, Refusal::other_mode);
  EXPECT_EQ(drive->command(as_set_point(arm_velocity(5.0))).refusal, Refusal::none);
  for (const Mode mode : {Mode::boot, Mode::idle, Mode::stop, Mode::fault})
    EXPECT_EQ(drive->command(arm(mode)).refusal, Refusal::no_mode);
  EXPECT_EQ(drive->command(arm(Mode::excitation)).refusal, Refusal::no_excitation);
}

TEST(Modes, AnAnswerCarriesTheCommandsNumber) {
  const auto drive = idle_drive();
  Command c = of_kind(Command::Kind::heartbeat);
  for (const std::uint16_t number : {7, 65535, 0}) {
    c.number = number;
    EXPECT_EQ(drive->command(c).number, number);
  }
  drive->run(1);
  EXPECT_FALSE(drive->last().has_answer);
}

TEST(Modes, DisarmingSwitchesTheAmplifierOffInTheSameTick) {
  const auto drive = idle_drive();
  drive->command(arm_current(1.0));
  run_with_host(*drive, 0.05);
  EXPECT_TRUE(drive->last().actuation.enabled);
  EXPECT_NEAR(drive->rig().current_a(), 1.0, 1e-3);
  EXPECT_EQ(drive->command(of_kind(Command::Kind::disarm)).mode, Mode::idle);
  EXPECT_FALSE(drive->last().actuation.enabled);
  EXPECT_EQ(drive->last().actuation.current, 0);
}

TEST(Modes, ATurningShaftCannotBeArmedFromIdle) {
  const auto drive = idle_drive();
  drive->command(arm_velocity(50.0));
  run_with_host(*drive, 0.2);
  drive->command(of_kind(Command::Kind::disarm));
  EXPECT_EQ(drive->command(arm_velocity(50.0)).refusal, Refusal::moving);
  run_with_host(*drive, 1.0);  // friction stops it
  EXPECT_EQ(drive->command(arm_velocity(50.0)).refusal, Refusal::none);
}

TEST(Modes, VelocityIsReachedWithTheLimitedAccelerationAndWithoutOvershoot) {
  const auto drive = idle_drive();
  const double limit = demo_setup().trajectory.acceleration_limit;
  drive->command(arm_velocity(100.0));
  double most_rise = 0.0, most = 0.0, before = 0.0;
  for (int ms = 0; ms < 500; ++ms) {
    run_with_host(*drive, 1e-3);
    const double w = drive->rig().truth().motor_velocity;
    most_rise = std::max(most_rise, (w - before) / 1e-3);
    most = std::max(most, w);
    before = w;
  }
  EXPECT_NEAR(before, 100.0, 1.0);
  EXPECT_LT(most, 104.0);
  EXPECT_LT(most_rise, 1.35 * limit);
  EXPECT_GT(most_rise, 0.8 * limit);
}

TEST(Modes, APositionIsReachedAndHeld) {
  const auto drive = idle_drive();
  drive->command(arm_position(12.25));
  run_with_host(*drive, 1.5);
  EXPECT_NEAR(drive->rig().truth().motor_angle / kTurn, 12.25, 2e-3);
  EXPECT_LT(std::abs(drive->rig().truth().motor_velocity), 0.3);
  drive->rig().set_load_torque(5.0);
  run_with_host(*drive, 1.0);
  EXPECT_NEAR(drive->rig().truth().motor_angle / kTurn, 12.25, 2e-3);
}

TEST(Modes, BetweenArmedModesTheShaftGoesOnWithoutAJump) {
  const auto drive = idle_drive();
  drive->command(arm_current(2.5));
  run_with_host(*drive, 0.1);
  const double velocity = drive->rig().truth().motor_velocity;
  EXPECT_GT(velocity, 30.0);
  // To a velocity that it has: neither current nor velocity jump.
  const double current = drive->rig().current_a();
  drive->command(arm_velocity(velocity));
  EXPECT_NEAR(drive->rig().current_a(), current, 0.15);
  double least = velocity, most = velocity;
  for (int k = 0; k < 200; ++k) {
    run_with_host(*drive, 1e-3);
    least = std::min(least, drive->rig().truth().motor_velocity);
    most = std::max(most, drive->rig().truth().motor_velocity);
  }
  EXPECT_GT(least, velocity - 10.0);
  EXPECT_LT(most, velocity + 10.0);
  // From velocity to position while it moves: it stops on the way with the limited deceleration and goes there.
  const double target = drive->rig().truth().motor_angle / kTurn;
  drive->command(arm_position(target));
  EXPECT_GT(drive->rig().truth().motor_velocity, 0.9 * least);
  run_with_host(*drive, 1.0);
  EXPECT_NEAR(drive->rig().truth().motor_angle / kTurn, target, 3e-3);
}

// The feedforward of the model ends with the mode that had it; the loops take its torque over in the same tick.
TEST(Modes, WhereTheFeedforwardEndsTheCurrentDoesNotJump) {
  const auto compensated = [](VirtualDrive& drive) {
    Command c = arm_velocity(120.0);
    c.compensate = true;
    EXPECT_EQ(drive.command(c).refusal, Refusal::none);
    run_with_host(drive, 0.5);
    return drive.last().actuation.current;
  };
  const auto again = idle_drive();
  const int before = compensated(*again);
  EXPECT_GT(before, 2000) << "the drive has enough friction to show it";
  again->command(arm_velocity(120.0));
  EXPECT_NEAR(again->last().actuation.current, before, 0.2 * before) << "armed again without compensation";
  const auto hot = idle_drive();
  compensated(*hot);
  hot->rig().set_temperature(95.0);
  int last = 0;
  for (int k = 0; k < 1000 && hot->status().mode != Mode::stop; ++k) {
    last = hot->last().actuation.current;
    run_with_host(*hot, 1.0 / kTickHz);
  }
  ASSERT_EQ(hot->status().mode, Mode::stop);
  EXPECT_NEAR(hot->last().actuation.current, last, 0.2 * last) << "a controlled stop";
}

TEST(Modes, NoOutputIsLeftOfAnArmedTickWhereTheNextOneIsNotArmed) {
  const auto control = std::make_unique<firmware::Control>();
  firmware::Output out;
  out.torque = out.current = out.error = N::value(0.5);
  out.limited = out.at_rest = out.finished = true;
  control->update({.mode = Mode::idle}, {}, 0, out);
  EXPECT_EQ(out.torque, N::Value{});
  EXPECT_EQ(out.current, N::Value{});
  EXPECT_EQ(out.error, N::Value{});
  EXPECT_FALSE(out.limited || out.at_rest || out.finished);
}

TEST(Modes, TheExcitationRunsToItsEndAndLeavesTheDriveIdle) {
  auto setup = demo_setup();
  control::ExcitationSetup<double> e;
  e.amplitude = 0.12;
  e.frequency_hz = 5.0;
  e.ticks = 10'000;
  e.fade_ticks = 1000;
  e.limit = 0.15;
  e.slope_limit = 50.0;
  e.velocity_limit = 150.0;
  e.overspeed = 200.0;
  setup.excitation = control::sine(e);
  const auto drive = idle_drive(setup);
  EXPECT_EQ(drive->command(arm(Mode::excitation)).refusal, Refusal::none);
  double most = 0.0;
  int ticks = 0;
  for (; ticks < 20'000 && drive->status().mode == Mode::excitation; ++ticks) {
    if (ticks % 20 == 0) drive->post(of_kind(Command::Kind::heartbeat));
    drive->run(1);
    most = std::max(most, std::abs(drive->rig().current_a()));
  }
  EXPECT_EQ(drive->status().mode, Mode::idle);
  EXPECT_NEAR(ticks, 10'000, 20);
  EXPECT_NEAR(most * demo_constants().torque_constant, 0.12, 0.002);
  EXPECT_EQ(drive->status().fault.fault, Fault::none);
}

TEST(Modes, LimitsOfTorqueAndVelocityHoldWhateverTheHostSays) {
  const auto drive = idle_drive();
  const double most_current = demo_drive().current_limit_a;
  double current = 0.0, velocity = 0.0;
  const auto run_closed_loop = [&](Command command) {
    ASSERT_EQ(drive->command(command).refusal, Refusal::none);
    for (int k = 0; k < 1000; ++k) {
      drive->post(as_set_point(command));
      drive->run(kTickHz / 1000);
      current = std::max(current, std::abs(drive->rig().current_a()));
      velocity = std::max(velocity, std::abs(drive->rig().truth().motor_velocity));
    }
  };
  for (const std::int32_t raw : {INT32_MAX, INT32_MIN, INT32_MIN + 1}) {
    Command c = arm_current(0.0);
    c.current.raw = raw;
    run_closed_loop(c);
    c = arm_velocity(0.0);
    c.velocity.raw = raw;
    run_closed_loop(c);
  }
  for (const std::int64_t raw : {INT64_MAX, INT64_MIN}) {
    Command c = arm_position(0.0);
    c.position.raw = raw;
    run_closed_loop(c);
    c.stream = true;
    c.velocity.raw = raw > 0 ? INT32_MAX : INT32_MIN;
    c.acceleration = c.velocity;
    run_closed_loop(c);
  }
  EXPECT_TRUE(is_armed(drive->status().mode));
  EXPECT_LE(current, most_current * 1.0001);
  EXPECT_GT(current, most_current * 0.99);
  EXPECT_LT(velocity, demo_setup().loops.overspeed);
  EXPECT_GT(velocity, 0.9 * demo_drive().rated_velocity_rad_s);
}

// Without an encoder at the output the drive estimates it; the plant knows better.
TEST(Modes, WithoutAnEncoderAtTheOutputItIsEstimatedCloserThanAStiffGearWouldBe) {
  auto setup = demo_setup();
  setup.output_counts = 0;
  // No structural damping, which no linear observer knows.
  plant::Drive drive_of = demo_drive();
  plant::without(drive_of, "structural_damping");
  const firmware::TelemetrySetup channels{
      .every = 1, .count = 3, .channels = {Channel::output_turns, Channel::output_fraction, Channel::torsion}};
  VirtualDrive drive({.drive = drive_of, .seed = 1},
                     Block(board::parameters_of(drive_of, setup), board::constants_of(drive_of)), channels);
  drive.keep_frames(true);
  drive.run(100);
  Command c = arm_velocity(60.0);
  c.compensate = true;
  ASSERT_EQ(drive.command(c).refusal, Refusal::none);
  double squares = 0.0, stiff_squares = 0.0;
  for (int k = 0; k < 40'000; ++k) {
    if (k % 4000 == 0) {
      c.kind = Command::Kind::set;
      c.velocity = -c.velocity;
      drive.post(c);
    } else if (k % 20 == 0) {
      drive.post(of_kind(Command::Kind::heartbeat));
    }
    drive.rig().set_load_torque(k % 8000 < 4000 ? 2.0 : -2.0);
    const double output = drive.rig().truth().output_angle, motor = drive.rig().truth().motor_angle;
    drive.run(1);
    const auto& v = drive.frames().back().values;
    const double estimated = (static_cast<std::int32_t>(v[0]) + std::ldexp(v[1], -32)) * kTurn;
    squares += std::pow(estimated - output, 2);
    stiff_squares += std::pow(motor / demo_drive().gear_ratio - output, 2);
  }
  EXPECT_EQ(drive.status().mode, Mode::velocity);
  RecordProperty("rms_over_stiff", std::to_string(std::sqrt(squares / stiff_squares)));
  EXPECT_LT(std::sqrt(squares / stiff_squares), 0.7);
}

}  // namespace
}  // namespace flexspline::tests::firmware_modes_test
