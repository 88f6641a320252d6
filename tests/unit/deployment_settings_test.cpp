// Settings of a drive: what follows from the ratings, what a file says, and where it is wrong.
#include <gtest/gtest.h>

#include <cmath>
#include <initializer_list>
#include <string>
#include <utility>
#include <vector>

#include "host/drive_link/deployment/bases.hpp"
#include "host/drive_link/deployment/drive_settings.hpp"
#include "host/drive_link/deployment/pack.hpp"
#include "host/physics/catalogue/constants.hpp"
#include "shared/control/drive_block.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/two_ampere_drive.hpp"

namespace flexspline::tests::deployment_settings_test {
namespace {

using deployment::PackError;

model::Model some_model() {
  return tests::two_ampere_drive();
}
control::DriveSetup<double> parsed(const std::string& tables, const model::Model& m = some_model()) {
  const auto d = deployment::bases_of(m, 1.0 / 20'000.0);
  return deployment::parse_drive_setup("format = \"flexspline-drive/1\"\n" + tables, "d.toml", m, d);
}
std::string error_of(const std::string& tables, const model::Model& m = some_model()) {
  try {
    parsed(tables, m);
  } catch (const PackError& error) {
    return error.what();
  }
  return "none";
}
const std::string kCounts = "[motor_encoder]\ncounts = 4096\n";

TEST(DriveSettings, FollowFromTheRatingsWhereTheFileDoesNotStateThem) {
  const auto s = parsed(kCounts);
  EXPECT_EQ(s.tick_hz, 20'000u);
  EXPECT_EQ(s.motor_counts, 4096u);
  EXPECT_EQ(s.output_counts, 0u);
  EXPECT_FALSE(s.has_torque_sensor);
  // A first-order velocity loop of 50 Hz around an inertia has this gain; position closes at 10 Hz around it.
  EXPECT_NEAR(s.loops.velocity_gain, 1e-4 * kTurn * 50.0, 1e-12);
  EXPECT_NEAR(s.loops.position_gain, kTurn * 10.0, 1e-12);
  EXPECT_NEAR(s.loops.integral_gain / s.loops.velocity_gain, kTurn * 10.0, 1e-9);
  EXPECT_NEAR(s.loops.current_limit, 2.0, 1e-6);
  EXPECT_NEAR(s.loops.torque_limit, 0.1, 1e-6);
  EXPECT_NEAR(s.trajectory.acceleration_limit, 0.5 * 0.1 / 1e-4, 0.1);
  EXPECT_NEAR(s.feedforward.stiffness, 6300.0, 0.1);
  EXPECT_NEAR(s.torsion.output_inertia, 0.06, 1e-12);
  // Twice where the position loop asks for the limit of the velocity.
  EXPECT_NEAR(s.safety.following_error, 2.0 * 200.0 / (kTurn * 10.0), 1e-9);
  EXPECT_NEAR(s.safety.following_velocity, 150.0, 1e-9);
  // Eight times what rated torque twists the gear by.
  EXPECT_NEAR(s.safety.output_stuck, 8.0 * 40.0 / 6300.0, 1e-4);
}

model::Model with_friction(std::initializer_list<std::pair<const char*, std::vector<double>>> effects) {
  model::Model m = some_model();
  for (const auto& [type, values] : effects) {
    model::Effect effect = catalogue::blank_effect(catalogue::get(type), m.drive.axis);
    effect.id = type;
    for (std::size_t k = 0; k < values.size(); ++k) effect.parameters[k].value = values[k];
    m.effects.push_back(effect);
  }
  return m;
}

// The motor has 0.1 N m. What friction holds is its height on both sides; of what acts alike on both it holds nothing.
TEST(DriveSettings, AStuckEncoderIsToldFromFrictionThatHoldsMostOfTheTorque) {
  const auto stuck_torque = [](const model::Model& m) { return parsed(kCounts, m).safety.stuck_torque; };
  EXPECT_NEAR(stuck_torque(some_model()), 0.05, 1e-6);
  EXPECT_NEAR(stuck_torque(with_friction({{"coulomb_friction", {0.01}}})), 0.05, 1e-6);
  EXPECT_NEAR(stuck_torque(with_friction({{"coulomb_friction", {0.045}}})), 1.5 * 0.09, 1e-6);
  EXPECT_NEAR(stuck_torque(with_friction({{"coulomb_friction", {0.045}}, {"coulomb_asymmetry", {0.01}}})), 1.5 * 0.09,
              1e-6);
  EXPECT_NEAR(stuck_torque(with_friction({{"coulomb_friction", {0.03}}, {"stribeck_gaussian", {0.01, 0.02, 3.0}}})),
              1.5 * (0.04 + 0.05), 1e-6);
  EXPECT_NEAR(stuck_torque(with_friction({{"dahl_friction", {0.045, 0.05}}})), 1.5 * 0.09, 1e-6);
  EXPECT_NEAR(stuck_torque(with_friction({{"lugre_friction", {0.045, 0.055, 3.0, 0.4, 0.0}}})), 1.5 * 0.11, 1e-5);
  // A tenth of the load of 40 N m behind a gear of 100.
  EXPECT_NEAR(stuck_torque(with_friction({{"load_dependent_friction", {0.1}}})), 1.5 * 2.0 * 0.04, 1e-6);
}

// Full torque turns 1e-4 kg m^2 by a 64th of a turn in 14 ms, by a 4096th in 1.8 ms.
TEST(DriveSettings, ACoarseEncoderIsGivenLongerToShowThatTheShaftFollows) {
  EXPECT_NEAR(parsed("[motor_encoder]\ncounts = 64\n").safety.stuck_s, 16.0 * std::sqrt(2.0 * 1e-4 * kTurn / 64 / 0.1),
              1e-9);
  EXPECT_NEAR(parsed("[motor_encoder]\ncounts = 65536\n").safety.stuck_s, 0.05, 1e-9);
}

TEST(DriveSettings, AreThoseOfTheFile) {
  const auto s = parsed(
      "[motor_encoder]\ncounts = 8192\ncorner_hz = 80\n[output_encoder]\ncounts = 65536\n[velocity_loop]\n"
      "bandwidth_hz = 30\nintegral_nm_rad = 0\n[position_loop]\nbandwidth_hz = 4\n[limits]\ncurrent_a = 1.5\n"
      "velocity_rad_s = 100\nlowest_rad = -6.283185307179586\nhighest_rad = 12.566370614359172\n[torque_sensor]\n"
      "full_scale_nm = 90\nripple_order = 4\n[faults]\nhost_s = 0.5\nfollowing_error_rad = 2.5\n"
      "following_velocity_rad_s = 30\nfollowing_s = 0.1\noutput_stuck_rad = 0.02\n[excitation]\nshape = \"composite\"\n"
      "amplitude = 0.05\nduration_s = 2\n");
  EXPECT_NEAR(s.motor_corner, kTurn * 80.0, 1e-9);
  EXPECT_EQ(s.output_counts, 65536u);
  EXPECT_NEAR(s.loops.velocity_gain, 1e-4 * kTurn * 30.0, 1e-12);
  EXPECT_EQ(s.loops.integral_gain, 0.0);
  EXPECT_NEAR(s.loops.position_gain, kTurn * 4.0, 1e-12);
  EXPECT_EQ(s.loops.current_limit, 1.5);
  EXPECT_EQ(s.trajectory.velocity_limit, 100.0);
  // A turn is 2^32.
  EXPECT_NEAR(static_cast<double>(s.trajectory.lowest), -0x1p32, 16.0);
  EXPECT_NEAR(static_cast<double>(s.trajectory.highest), 0x1p33, 32.0);
  EXPECT_TRUE(s.has_torque_sensor);
  EXPECT_EQ(s.torque.full_scale, 90.0);
  EXPECT_EQ(s.ripple.order, 4.0);
  EXPECT_EQ(s.safety.host_s, 0.5);
  EXPECT_EQ(s.safety.following_error, 2.5);
  EXPECT_EQ(s.safety.following_velocity, 30.0);
  EXPECT_EQ(s.safety.following_s, 0.1);
  EXPECT_EQ(s.safety.output_stuck, 0.02);
  EXPECT_EQ(s.excitation.line_count, 3u);
  EXPECT_EQ(s.excitation.ticks, 40'000u);
}

TEST(DriveSettings, ThatAreWrongAreRefusedWithTheirPlace) {
  const auto expect = [](const std::string& error, std::initializer_list<const char*> parts) {
    for (const char* part : parts) EXPECT_NE(error.find(part), std::string::npos) << error;
  };
  EXPECT_EQ(error_of(kCounts), "none");
  expect(error_of(""), {"d.toml", "counts", "[motor_encoder]"});
  expect(error_of(kCounts + "[limits]\ncurrent_a = 4.5\n"), {"d.toml:5:", "[limits] current_a is 4.5", "at most 4"});
  expect(error_of(kCounts + "[limits]\ncurrent_a = 0\n"), {"d.toml:5:", "above zero"});
  expect(error_of(kCounts + "[limits]\ncurrent_a = nan\n"), {"d.toml:5:"});
  expect(error_of(kCounts + "[limits]\ncurrent_a = \"1\"\n"), {"d.toml:5:", "has to be a number", "text"});
  expect(error_of(kCounts + "[limits]\ncurrent = 1\n"),
         {"d.toml:5:", "[limits] current is not a setting", "current_a"});
  expect(error_of(kCounts + "[limit]\ncurrent_a = 1\n"), {"d.toml:4:", "[limit] is not a table", "limits"});
  expect(error_of("limits = 3\n" + kCounts), {"d.toml:2:", "limits has to be a table"});
  expect(error_of("[motor_encoder]\ncounts = 4096.5\n"), {"d.toml:3:", "no whole number"});
  expect(error_of("[motor_encoder]\ncounts = 3\n"), {"d.toml:3:", "between 4 and"});
  expect(error_of(kCounts + "[output_encoder]\n"), {"[output_encoder] needs counts"});
  expect(error_of(kCounts + "[excitation]\nshape = \"round\"\n"), {"d.toml:5:", "round", "multi_sine"});
  expect(error_of(kCounts + "[faults]\nfollowing_error_rad = 0\n"), {"d.toml:5:", "following_error_rad", "above zero"});
  expect(error_of(kCounts + "[faults]\nfollowing_s = 4\n"), {"d.toml:5:", "following_s is 4", "at most 3"});
  expect(error_of(kCounts + "[faults]\noutput_stuck_rad = -1\n"), {"d.toml:5:", "output_stuck_rad"});
  expect(error_of("[motor_encoder\n"), {"d.toml:2:"});
  model::Model m = some_model();
  m.effects.erase(m.effects.begin());
  expect(error_of(kCounts, m), {"inertia_kg_m2", "[motor]"});
  m = some_model();
  m.effects.pop_back();
  expect(error_of(kCounts, m), {"inertia_kg_m2", "[load]"});
  EXPECT_EQ(error_of(kCounts + "[output_encoder]\ncounts = 4096\n", m), "none");
  try {
    deployment::parse_drive_setup("format = \"flexspline-model/1\"\n", "d.toml", m, deployment::bases_of(m, 5e-5));
    ADD_FAILURE();
  } catch (const PackError& error) {
    expect(error.what(), {"d.toml:1:", "flexspline-drive/1"});
  }
}

TEST(DriveSettings, ThatContradictEachOtherDoNotFit) {
  const auto d = deployment::bases_of(some_model(), 1.0 / 20'000.0);
  const auto s = parsed(kCounts + "[limits]\nvelocity_rad_s = 150\noverspeed_rad_s = 100\n");
  EXPECT_THROW(deployment::settings_of(s, d, "d.toml"), PackError);
  // An encoder too coarse to show the stated angle: a turn over 1000, of which 8 counts are 0.05 rad.
  const std::string coarse = kCounts + "[output_encoder]\ncounts = 1000\n";
  EXPECT_NO_THROW(deployment::settings_of(parsed(coarse), d, "d.toml"));
  EXPECT_NO_THROW(deployment::settings_of(parsed(coarse + "[faults]\noutput_stuck_rad = 0.051\n"), d, "d.toml"));
  EXPECT_THROW(deployment::settings_of(parsed(coarse + "[faults]\noutput_stuck_rad = 0.05\n"), d, "d.toml"), PackError);
}

// What is packed is what a drive takes, and unpack says it again.
TEST(DriveSettings, ComeBackFromABlock) {
  deployment::PackOptions options;
  options.samples = 300;
  options.tick_hz = 20'000;
  for (const char* more :
       {"", "[output_encoder]\ncounts = 65536\n[torque_sensor]\n[excitation]\nshape = \"multi_sine\"\n"}) {
    options.settings = "format = \"flexspline-drive/1\"\n" + kCounts + more;
    const auto packed = deployment::pack(some_model(), options);
    const auto verdict = control::check_for_drive(packed.bytes, 20'000);
    EXPECT_TRUE(verdict.good()) << static_cast<int>(verdict.fault) << " " << verdict.kind << " " << verdict.field;
    const auto unpacked = deployment::unpack(packed.bytes);
    EXPECT_TRUE(unpacked.refusal.empty());
    EXPECT_EQ(unpacked.header.encoder_counts, 4096u);
    const auto value = [&](const std::string& name) {
      for (const auto& q : unpacked.settings)
        if (q.name == name) return q.value;
      return std::nan("");
    };
    EXPECT_EQ(value("tick_rate"), 20'000.0);
    EXPECT_NEAR(value("velocity_gain"), 1e-4 * kTurn * 50.0, 1e-8);
    EXPECT_NEAR(value("position_gain"), kTurn * 10.0, 1e-5);
    EXPECT_NEAR(value("integral_gain"), 1e-4 * kTurn * 50.0 * kTurn * 10.0, 1e-6);
    EXPECT_NEAR(value("current_limit"), 2.0, 1e-6);
    EXPECT_NEAR(value("velocity_limit"), 200.0, 1e-4);
    EXPECT_NEAR(value("acceleration_limit"), 500.0, 0.1);
    EXPECT_NEAR(value("fault_host"), 0.1, 1e-9);
    EXPECT_NEAR(value("residual_map_largest"), 0.025, 1e-6);
    EXPECT_NEAR(value("fault_following_error"), 2.0 * 200.0 / (kTurn * 10.0), 1e-6);
    EXPECT_NEAR(value("fault_following_velocity"), 150.0, 1e-4);
    EXPECT_NEAR(value("fault_following"), 0.02, 1e-9);
    EXPECT_NEAR(value("fault_output_stuck"), *more == '\0' ? 0.0 : 8.0 * 40.0 / 6300.0, 1e-4);
  }
}

}  // namespace
}  // namespace flexspline::tests::deployment_settings_test
