// The residual map on the drive: what a model lacks shows in its bins, and is read out by messages.
#include <gtest/gtest.h>

#include <array>
#include <cmath>

#include "tests/support/virtual_drive.hpp"

namespace flexspline::tests::firmware_map_test {
namespace {

using firmware::MapBin;
using Map = control::ResidualMap;

constexpr std::uint16_t kBins = Map::kVelocityBins * Map::kAngleBins;

// Turns at some velocities, to and fro, with the model's compensation.
void turn(VirtualDrive& drive, double seconds_each) {
  Command c = arm_velocity(20.0);
  c.compensate = true;
  ASSERT_EQ(drive.command(c).refusal, Refusal::none);
  for (const double velocity : {20.0, -20.0, 35.0, -35.0}) {
    c = as_set_point(arm_velocity(velocity));
    c.compensate = true;
    ASSERT_EQ(drive.command(c).refusal, Refusal::none);
    run_with_host(drive, seconds_each);
  }
}
std::uint64_t ticks_of(VirtualDrive& drive) {
  std::uint64_t ticks = 0;
  MapBin bin;
  for (std::uint16_t k = 0; k < kBins; ++k) {
    EXPECT_TRUE(software(drive).map_bin(k, bin));
    ticks += bin.count;
  }
  return ticks;
}
// Amplitude over the motor's angle of order `order`, N m, from the means of the bins of fast motion.
double amplitude(VirtualDrive& drive, double order) {
  const double unit = demo_setup().residual_map.largest_residual / static_cast<double>(Map::kLargest);
  double cosine = 0.0, sine = 0.0;
  int met = 0;
  for (std::size_t v = 0; v < Map::kVelocityBins; ++v)
    for (std::size_t a = 0; a < Map::kAngleBins; ++a) {
      MapBin bin;
      EXPECT_TRUE(software(drive).map_bin(static_cast<std::uint16_t>(v * Map::kAngleBins + a), bin));
      if (bin.count * Map::kEveryTicks < 200) continue;
      const double mean = unit * bin.sum / bin.count;
      const double angle = kTurn * (static_cast<double>(a) + 0.5) / Map::kAngleBins;
      cosine += mean * std::cos(order * angle);
      sine += mean * std::sin(order * angle);
      ++met;
    }
  EXPECT_GT(met, 32);
  return 2.0 * std::hypot(cosine, sine) / met;
}
VirtualDrive drive_with_ripple(bool known) {
  plant::Drive truth = demo_drive();
  plant::with(truth, "torque_ripple:2");
  plant::Drive stated = known ? truth : demo_drive();
  return VirtualDrive({.drive = truth, .seed = 7001},
                      Block(board::parameters_of(stated, board::setup_of(stated)), board::constants_of(stated)));
}

TEST(ResidualMapOnTheDrive, ShowsARippleThatTheModelLacks) {
  std::array<double, 2> found{};
  for (const bool known : {false, true}) {
    VirtualDrive drive = drive_with_ripple(known);
    drive.run(100);
    ASSERT_EQ(drive.command(of_kind(Command::Kind::start_map)).refusal, Refusal::none);
    EXPECT_TRUE(drive.status().maps_residual);
    turn(drive, 1.5);
    EXPECT_GT(ticks_of(drive) * Map::kEveryTicks, 20'000u);
    found[known ? 1 : 0] = amplitude(drive, 2.0);
  }
  // The plant's ripple has 4 mN m; the filter of the encoder, 150 Hz, lets it through at 20 and 35 rad/s.
  EXPECT_NEAR(found[0], 0.004, 0.001);
  EXPECT_LT(found[1], 0.1 * found[0]);
}

TEST(ResidualMapOnTheDrive, CountsOnlyWhileItIsOnAndAModelIsFedForward) {
  const auto drive = idle_drive();
  turn(*drive, 0.1);
  EXPECT_EQ(ticks_of(*drive), 0u);
  drive->command(of_kind(Command::Kind::disarm));
  run_with_host(*drive, 1.0);
  drive->command(of_kind(Command::Kind::start_map));
  drive->command(arm_velocity(20.0));  // without compensation
  run_with_host(*drive, 0.1);
  EXPECT_EQ(ticks_of(*drive), 0u);
  drive->command(of_kind(Command::Kind::disarm));
  run_with_host(*drive, 1.0);
  turn(*drive, 0.1);
  const std::uint64_t counted = ticks_of(*drive);
  EXPECT_NEAR(static_cast<double>(counted * Map::kEveryTicks), 0.4 * kTickHz, 100.0);
  EXPECT_EQ(drive->command(of_kind(Command::Kind::clear_map)).refusal, Refusal::armed);
  drive->command(of_kind(Command::Kind::stop_map));
  const std::uint64_t stopped = ticks_of(*drive);
  run_with_host(*drive, 0.1);
  EXPECT_EQ(ticks_of(*drive), stopped);
  drive->command(of_kind(Command::Kind::disarm));
  EXPECT_EQ(drive->command(of_kind(Command::Kind::clear_map)).refusal, Refusal::none);
  EXPECT_EQ(ticks_of(*drive), 0u);
}

TEST(ResidualMapOnTheDrive, NeedsParametersAndHasNoBinBeyondItsLast) {
  VirtualDrive drive({.drive = demo_drive()}, Block());
  drive.run(100);
  EXPECT_EQ(drive.command(of_kind(Command::Kind::start_map)).refusal, Refusal::no_parameters);
  MapBin bin;
  EXPECT_TRUE(software(drive).map_bin(kBins - 1, bin));
  EXPECT_EQ(bin.number, kBins - 1);
  EXPECT_FALSE(software(drive).map_bin(kBins, bin));
}

}  // namespace
}  // namespace flexspline::tests::firmware_map_test
