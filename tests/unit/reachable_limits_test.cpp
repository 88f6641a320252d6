// Every limit that stops the drive lies where its signal can show that it was passed: pack says which one does not, the
// drive's validator refuses it, and what both take acts.
#include <gtest/gtest.h>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/drive_settings.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "tests/support/limit_trial.hpp"
#include "tests/support/two_ampere_drive.hpp"

namespace flexspline::tests::reachable_limits_test {
namespace {

using firmware::BlockFinding;

// A drive of 2 A and 200 rad/s with these settings: what pack says, or "taken".
std::string packed(const std::string& tables) {
  const model::Model m = tests::two_ampere_drive();
  const auto d = deployment::bases_of(m, 1.0 / kTickHz);
  const std::string all = "format = \"flexspline-drive/1\"\n[motor_encoder]\ncounts = 16384\n" + tables;
  try {
    deployment::settings_of(deployment::parse_drive_setup(all, "d.toml", m, d), d, "d.toml");
  } catch (const deployment::PackError& error) {
    return error.what();
  }
  return "taken";
}
void expect_told(const std::string& said, std::initializer_list<const char*> parts) {
  for (const char* part : parts) EXPECT_NE(said.find(part), std::string::npos) << said;
}

TEST(ReachableLimits, PackSaysWhichLimitOfASettingOrOfADefaultNoSignalCanReach) {
  EXPECT_EQ(packed(""), "taken");
  EXPECT_EQ(packed("[limits]\ncurrent_a = 3.8\n"), "taken");
  EXPECT_EQ(packed("[faults]\novertemperature_c = 100\n"), "taken");
  expect_told(packed("[limits]\nvelocity_rad_s = 340\n"), {"overspeed_rad_s", "380", "velocity_rad_s"});
  expect_told(packed("[faults]\novertemperature_c = 195\n"), {"overtemperature_c is 195", "189.8"});
  expect_told(packed("[faults]\novercurrent_a = 5\n"), {"overcurrent_a is 5", "3.796", "full_scale_a"});
  expect_told(packed("[faults]\nstuck_torque_nm = 0.2\n"), {"stuck_torque_nm"});
  expect_told(packed("[faults]\ncurrent_mismatch_a = 2\n"), {"current_mismatch_a"});
  expect_told(packed("[faults]\nstandstill_rad_s = 150\n"), {"standstill_rad_s"});
  expect_told(packed("[faults]\nfollowing_velocity_rad_s = 300\n"), {"following_velocity_rad_s"});
}

// With a time that is too long a silent host, or a stop that does not end, would have no effect.
TEST(ReachableLimits, TimesUntilTheDriveStopsByItselfAreBounded) {
  EXPECT_EQ(packed("[faults]\nhost_s = 5\nstop_s = 30\n"), "taken");
  expect_told(packed("[faults]\nhost_s = 5.1\n"), {"host_s"});
  expect_told(packed("[faults]\nstop_s = 31\n"), {"stop_s"});
  const auto finding = [](double host_s, double stop_s) {
    auto setup = demo_setup();
    setup.safety.host_s = host_s;
    setup.safety.stop_s = stop_s;
    const Block block(board::parameters_of(demo_drive(), setup), demo_constants());
    return firmware::check_block(block.bytes(), kTickHz);
  };
  EXPECT_EQ(finding(5.0, 30.0), BlockFinding::none);
  EXPECT_EQ(finding(5.001, 30.0), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding(5.0, 30.001), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding(3600.0, 1.0), BlockFinding::unreachable_limit);
}

TEST(ReachableLimits, TheDriveRefusesABlockWithALimitThatItsSignalCannotReach) {
  const auto finding = [](auto&& change) {
    auto setup = demo_setup();
    change(setup);
    const Block block(board::parameters_of(demo_drive(), setup), demo_constants());
    return firmware::check_block(block.bytes(), kTickHz);
  };
  EXPECT_EQ(finding([](auto&) {}), BlockFinding::none);
  EXPECT_EQ(finding([](auto& s) { s.safety.overspeed = 390.0; }), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding([](auto& s) { s.safety.overcurrent = 6.9; }), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding([](auto& s) { s.current.full_scale = 4.0; }), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding([](auto& s) { s.current.highest_share = 0.5; }), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding([](auto& s) { s.safety.overtemperature = 195.0; }), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding([](auto& s) { s.motor_corner = kTurn * 10.0; }), BlockFinding::unreachable_limit);
  EXPECT_EQ(finding([](auto& s) { s.safety.stuck_torque = 0.38; }), BlockFinding::unreachable_limit);
}

// Half of what a current's sensor shows beyond two of its bases, and a temperature beyond two of 50 degrees.
TEST(ReachableLimits, CurrentsAndTemperaturesBeyondTwoBasesStopTheDrive) {
  auto setup = demo_setup();
  setup.loops.current_limit = 6.5;
  setup.loops.torque_limit = 6.5 * demo_drive().torque_constant_nm_a;
  setup.safety.overcurrent = 7.8;
  setup.current.full_scale = 14.0;
  setup.amplifier_full_scale = 8.0;
  setup.safety.overtemperature = 120.0;
  const auto block = accepted_block(setup);
  ASSERT_TRUE(block);
  Readout hot(*block, setup);
  hot.temperature(180.0);
  EXPECT_EQ(hot.fault_within(1.0), "overtemperature");
  Readout warm(*block, setup);
  warm.temperature(115.0);
  EXPECT_EQ(warm.fault_within(1.0), "none");
  Readout current(*block, setup);
  current.current(-12.0);
  EXPECT_EQ(current.fault_within(1.0), "overcurrent");
}

TEST(ReachableLimits, EveryLimitOfADrawnBlockThatTheDriveTakesActs) {
  std::mt19937_64 random(11);
  int accepted = 0;
  for (int k = 0; k < 400; ++k) {
    const auto setup = drawn_limits(random);
    const auto block = accepted_block(setup);
    if (!block) continue;
    ++accepted;
    ASSERT_EQ(limits_that_do_not_act(*block, setup), "") << k;
    arm_with_random_readings(*block, setup, random);
  }
  EXPECT_GT(accepted, 20);
}

}  // namespace
}  // namespace flexspline::tests::reachable_limits_test
