// Where a drive's shafts are after it was switched on: what an encoder of each kind knows, what is left out until it is
// known, and what loses it again.
#include <gtest/gtest.h>

#include <random>

#include "firmware/fault_texts.hpp"
#include "tests/support/service_host.hpp"
#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::position_reference_test {
namespace {

using control::SensorKind;

plant::Drive drive_with(std::initializer_list<const char*> effects) {
  plant::Drive drive = demo_drive();
  for (const char* effect : effects) plant::with(drive, effect);
  return drive;
}
// A drive that woke somewhere, with these encoders.
std::unique_ptr<VirtualDrive> woken(const plant::Drive& drive, double turns, SensorKind encoders,
                                    const control::DriveSetup<double>* setup = nullptr) {
  auto controller = std::make_unique<SoftwareController>();
  controller->state(board::hardware_of(drive, encoders));
  const Block block(board::parameters_of(drive, setup != nullptr ? *setup : board::setup_of(drive)),
                    board::constants_of(drive));
  auto all = std::make_unique<VirtualDrive>(
      RigSetup{.drive = drive, .seed = 3, .start_turns = turns, .encoders = encoders}, block,
      firmware::TelemetrySetup{.every = 1, .count = 2, .channels = {Channel::motor_turns, Channel::motor_fraction}},
      std::move(controller));
  all->run(120);
  EXPECT_EQ(all->status().mode, Mode::idle);
  return all;
}
double shown_turns(const VirtualDrive& drive) {
  const auto& frame = drive.last().frame;
  return static_cast<std::int32_t>(frame[2]) + std::ldexp(frame[3], -32);
}
double true_turns(const VirtualDrive& drive) {
  return drive.rig().truth().motor_angle / kTurn;
}
Command home_at(double turns) {
  Command c = of_kind(Command::Kind::home);
  c.position = {std::llround(std::ldexp(turns, 32))};
  return c;
}
// Deviation of the velocity from its mean over two turns at 5 rad/s, rad/s rms.
double ripple_of_velocity(VirtualDrive& drive) {
  Command c = arm_velocity(5.0);
  c.compensate = true;
  EXPECT_EQ(drive.command(c).refusal, Refusal::none);
  run_with_host(drive, 1.0);
  double sum = 0.0, squares = 0.0;
  constexpr int kSteps = 2500;
  for (int k = 0; k < kSteps; ++k) {
    run_with_host(drive, 1e-3);
    const double w = drive.rig().truth().motor_velocity;
    sum += w, squares += w * w;
  }
  drive.command(of_kind(Command::Kind::disarm));
  return std::sqrt(std::max(0.0, squares / kSteps - sum * sum / kSteps / kSteps));
}

TEST(PositionReference, AbsoluteEncodersTellItFromTheStartHoweverTheDriveWakes) {
  std::mt19937 random(17);
  std::uniform_real_distribution<double> turns(-45.0, 45.0);
  for (int k = 0; k < 20; ++k) {
    const double at = turns(random);
    const auto drive = woken(demo_drive(), at, SensorKind::absolute);
    EXPECT_TRUE(drive->status().knows_turn);
    EXPECT_TRUE(drive->status().knows_output);
    EXPECT_NEAR(shown_turns(*drive), true_turns(*drive), 1e-3) << at;
  }
}

TEST(PositionReference, CountersThatBeginAtZeroKnowNothingUntilTheHostSaysWhereTheShaftIs) {
  const auto drive = woken(demo_drive(), 0.3, SensorKind::incremental);
  EXPECT_FALSE(drive->status().knows_turn);
  EXPECT_FALSE(drive->status().knows_output);
  EXPECT_NEAR(shown_turns(*drive), 0.0, 1e-3);
  EXPECT_EQ(drive->command(home_at(-7.25)).refusal, Refusal::none);
  drive->run(2);
  EXPECT_TRUE(drive->status().knows_turn);
  EXPECT_TRUE(drive->status().knows_output);
  EXPECT_NEAR(shown_turns(*drive), -7.25, 1e-3);
  drive->command(arm_position(-6.25));
  run_with_host(*drive, 1.0);
  EXPECT_EQ(drive->status().mode, Mode::position) << firmware::info_of(drive->status().fault.fault).name;
  EXPECT_NEAR(true_turns(*drive), 1.3, 0.01);
  EXPECT_EQ(drive->command(home_at(0.0)).refusal, Refusal::armed);
}

TEST(PositionReference, AnIndexPulseGivesTheMotorsTurnOnceTheShaftPassedItAndStands) {
  for (const double wake : {0.3, -0.4, 0.05}) {
    const auto drive = woken(demo_drive(), wake, SensorKind::indexed);
    EXPECT_FALSE(drive->status().knows_turn);
    drive->command(arm_velocity(wake < 0.0 ? -20.0 : 20.0));
    run_with_host(*drive, 0.8);
    EXPECT_FALSE(drive->status().knows_turn) << "not while armed";
    const double moved = shown_turns(*drive);
    drive->command(of_kind(Command::Kind::disarm));
    run_with_host(*drive, 1.0);
    EXPECT_TRUE(drive->status().knows_turn);
    EXPECT_FALSE(drive->status().knows_output);
    EXPECT_LT(std::abs(shown_turns(*drive) - moved), 1.5);
    const double off = shown_turns(*drive) - true_turns(*drive);
    EXPECT_NEAR(off, std::round(off), 1e-3) << wake;
  }
}

// The figures: ripple of order 2, woken a quarter of a turn away.
TEST(PositionReference, RippleIsCompensatedWhereTheTurnIsKnownAndLeftOutWhereItIsNot) {
  const plant::Drive drive = drive_with({"torque_ripple:2"});
  const auto of = [&](double wake, SensorKind encoders) {
    const auto woke = woken(drive, wake, encoders);
    return ripple_of_velocity(*woke);
  };
  const double known = of(0.25, SensorKind::absolute), unknown = of(0.25, SensorKind::incremental);
  const double at_zero = of(0.0, SensorKind::incremental), homed = [&] {
    const auto woke = woken(drive, 0.25, SensorKind::incremental);
    woke->command(home_at(0.25));
    return ripple_of_velocity(*woke);
  }();
  EXPECT_LT(known, 0.3 * unknown);
  EXPECT_LT(homed, 0.3 * unknown);
  // No worse than without the compensation, wherever it wakes.
  EXPECT_NEAR(unknown, at_zero, 0.1 * at_zero);
}

TEST(PositionReference, LimitsOfPositionHoldOnceTheOutputIsKnown) {
  control::DriveSetup<double> setup = demo_setup();
  setup.trajectory.lowest = 0;
  setup.trajectory.highest = std::int64_t{1} << 32;
  const auto drive = woken(demo_drive(), 0.5, SensorKind::incremental, &setup);
  drive->command(arm_position(3.0));
  run_with_host(*drive, 1.0);
  EXPECT_NEAR(shown_turns(*drive), 3.0, 0.01) << "where it is, nobody knows";
  drive->command(of_kind(Command::Kind::disarm));
  run_with_host(*drive, 0.5);
  ASSERT_EQ(drive->command(home_at(0.5)).refusal, Refusal::none);
  drive->command(arm_position(3.0));
  run_with_host(*drive, 1.0);
  EXPECT_NEAR(shown_turns(*drive), 1.0, 0.01);
}

TEST(PositionReference, IsLostWithTheCountAndSaidSo) {
  const auto drive = woken(demo_drive(), 0.3, SensorKind::incremental);
  ASSERT_EQ(drive->command(home_at(0.3)).refusal, Refusal::none);
  drive->command(arm_velocity(60.0));
  run_with_host(*drive, 0.3);
  EXPECT_TRUE(drive->status().knows_turn);
  drive->rig().inject(Injection::motor_encoder_stale);
  drive->run(5);
  EXPECT_EQ(drive->status().mode, Mode::fault);
  EXPECT_FALSE(drive->status().knows_turn);
  EXPECT_FALSE(drive->status().knows_output);
  drive->rig().clear(Injection::motor_encoder_stale);
  run_with_host(*drive, 1.0);
  drive->command(of_kind(Command::Kind::clear_fault));
  run_with_host(*drive, 0.1);
  EXPECT_EQ(drive->status().mode, Mode::idle);
  EXPECT_FALSE(drive->status().knows_turn);
}

// Flash memory that was written, or a tick that did not come: counts of more than a turn at once are counts lost.
TEST(PositionReference, IsLostWhereTheCounterWasNotReadForMoreThanATurn) {
  const auto at_home = [] {
    auto drive = woken(demo_drive(), 0.0, SensorKind::incremental);
    drive->command(home_at(0.0));
    return drive;
  };
  const auto skip = [](VirtualDrive& drive, int counts) {
    firmware::CoSimulationInput down;
    drive.rig().sense(down.readings);
    down.readings.motor_samples = down.readings.output_samples = down.readings.analog_samples = 1000;
    down.readings.motor_counter += static_cast<std::uint32_t>(counts);
    return drive.controller().tick(down).status;
  };
  auto little = at_home();
  EXPECT_TRUE(skip(*little, demo_drive().sensors.motor_counts / 2).knows_turn);
  auto more = at_home();
  EXPECT_FALSE(skip(*more, demo_drive().sensors.motor_counts * 3 / 2).knows_turn);
}

TEST(PositionReference, AHostOfATwinHearsOfItAndHomesAShaftThatStands) {
  for (const std::uint64_t seed : {1U, 2U, 3U}) {
    twin::TwinDrive absolute({.drive = demo_drive(), .seed = seed});
    absolute.run(200);
    EXPECT_NE(absolute.rig().truth().motor_angle, 0.0) << "a twin wakes anywhere";
    EXPECT_TRUE(absolute.status().knows_turn && absolute.status().knows_output);
  }
  twin::TwinDrive drive({.drive = demo_drive(), .encoders = SensorKind::incremental});
  ServiceHost host(drive);
  drive.run(200);
  ASSERT_EQ(host.identify(), protocol::Code::done);
  const auto reference = [&] {
    protocol::Reference known;
    EXPECT_EQ(protocol::take_payload(host.ask(protocol::Kind::reference).content(), known), protocol::Code::done);
    return known;
  };
  EXPECT_EQ(reference(), (protocol::Reference{false, false}));
  EXPECT_EQ(host.code(protocol::Kind::home, protocol::Home{INT64_MAX}), protocol::Code::wrong_value);
  EXPECT_EQ(host.code(protocol::Kind::home, protocol::Home{5}), protocol::Code::done);
  EXPECT_EQ(reference(), (protocol::Reference{true, true}));
  host.arm(protocol::Mode::velocity);
  EXPECT_EQ(host.code(protocol::Kind::home, protocol::Home{5}), protocol::Code::refused);
}

}  // namespace
}  // namespace flexspline::tests::position_reference_test
