// Scenario files: motions against their own derivatives, events against what they do, and what is refused.
#include <gtest/gtest.h>

#include <cmath>
#include <stdexcept>
#include <string>

#include "hil/scenario/scenario_file.hpp"

namespace flexspline::tests::scenario_file_test {
namespace {

using scenario::find_scenario;
using scenario::parse_scenario;
using scenario::ScenarioFile;

std::string reason_for(const std::string& lines) {
  try {
    parse_scenario("format = \"flexspline-scenario/1\"\nname = \"x\"\n" + lines, "x.toml");
  } catch (const std::runtime_error& error) {
    return error.what();
  }
  return "";
}
ScenarioFile with_event(const std::string& event, const std::string& top = "duration_s = 1.5\nhold_s = 0.0\n") {
  return parse_scenario(
      "format = \"flexspline-scenario/1\"\nname = \"x\"\nmotion = \"sine\"\n" + top + "[[event]]\n" + event, "x.toml");
}
board::ScenarioResult run(const ScenarioFile& file, bool compensation = false) {
  board::ScenarioPlan plan = scenario::plan_of(file, scenario::drive_of(file, ""));
  plan.compensation = compensation;
  plan.keeps_trace = true;
  return board::run_scenario(plan);
}

TEST(Scenarios, OfTheToolAllCanBeReadAndTheirMotionsAreSmooth) {
  ASSERT_GE(scenario::known_scenarios().size(), 15u);
  for (const scenario::Known& one : scenario::known_scenarios()) {
    SCOPED_TRACE(one.name);
    EXPECT_FALSE(one.what.empty());
    const ScenarioFile file = find_scenario(one.name);
    const auto& motion = file.motion;
    EXPECT_EQ(motion.at(0.0).position, 0.0);
    constexpr double h = 1e-5;
    for (double t = 0.0137; t < file.duration_s; t += 0.0731) {
      const double slope = (motion.at(t + h).position - motion.at(t - h).position) / (2.0 * h);
      EXPECT_NEAR(slope, motion.at(t).velocity, 1e-4) << t;
      const double bend = (motion.at(t + h).velocity - motion.at(t - h).velocity) / (2.0 * h);
      EXPECT_NEAR(bend, motion.at(t).acceleration, 1e-2) << t;
    }
  }
}

TEST(Scenarios, WhatIsWrongIsSaidWithItsLine) {
  EXPECT_NE(reason_for("motion = \"sine\"\nspeed = 3\n").find("x.toml:4: scenario: unknown key \"speed\""),
            std::string::npos);
  EXPECT_NE(reason_for("motion = \"waltz\"\n").find("x.toml:3"), std::string::npos);
  EXPECT_NE(reason_for("").find("needs motion"), std::string::npos);
  EXPECT_NE(reason_for("motion = \"sine\"\n[[event]]\nwhat = \"flood\"\nat_s = 1.0\n").find("x.toml:5"),
            std::string::npos);
  EXPECT_NE(
      reason_for("motion = \"sine\"\n[[event]]\nwhat = \"load-shock\"\nat_s = 1.0\n").find("\"value\" is missing"),
      std::string::npos);
  EXPECT_NE(reason_for("motion = \"sine\"\n[[event]]\nwhat = \"load-shock\"\nat_s = 1.0\nvalue = 1\nunit = \"mNm\"\n")
                .find("x.toml:8"),
            std::string::npos);
  EXPECT_NE(reason_for("[motion]\nkind = \"waypoints\"\nwaypoints = [[1.0, 0.0], [0.5, 1.0]]\n").find("rise"),
            std::string::npos);
  EXPECT_NE(reason_for("duration_s = nan\nmotion = \"sine\"\n").find("duration_s"), std::string::npos);
  EXPECT_THROW(find_scenario("no-such"), std::runtime_error);
}

TEST(Scenarios, ALoadShockTwistsTheOutputAndPasses) {
  const auto calm = run(with_event("what = \"load-shock\"\nat_s = 30.0\nvalue = 1.0\n"));
  const auto hit = run(with_event("what = \"load-shock\"\nat_s = 0.5\nduration_s = 0.1\nvalue = 10.0\n"));
  const auto at = [](const board::ScenarioResult& r, std::size_t ms) { return r.trace.at(ms).output_rad; };
  EXPECT_EQ(at(hit, 490), at(calm, 490));
  // 10 N m on 6300 N m/rad, and the loops give way a little.
  EXPECT_LT(at(hit, 590) - at(calm, 590), -0.8e-3);
  EXPECT_GT(at(hit, 590) - at(calm, 590), -6e-3);
  EXPECT_NEAR(at(hit, 1450), at(calm, 1450), 0.1e-3);
}

TEST(Scenarios, TemperatureAndCurrentDoWhatTheScriptSays) {
  const auto ramp = run(with_event("what = \"temperature-ramp\"\nat_s = 0.5\nduration_s = 0.5\nvalue = 50.0\n",
                                   "duration_s = 1.5\nhold_s = 0.0\nstart_temperature_c = 20.0\n"));
  EXPECT_EQ(ramp.trace.at(400).temperature_c, 20.0);
  EXPECT_NEAR(ramp.trace.at(749).temperature_c, 35.0, 0.1);
  EXPECT_EQ(ramp.trace.back().temperature_c, 50.0);
  const auto weak = run(with_event("what = \"amplifier-saturation\"\nat_s = 0.0\nvalue = 0.9\n"));
  EXPECT_LE(weak.peak_current_a, 0.9);
  EXPECT_GT(weak.peak_current_a, 0.89);
}

TEST(Scenarios, ADriveThatWarmsUpTakesWhatTheMotorLoses) {
  plant::Drive drive = plant::demo_plant().drive;
  drive.thermal = {.capacity_j_c = 2.0, .resistance_c_w = 1e9, .winding_ohm = 1.0, .ambient_c = 30.0, .start_c = {}};
  board::ScenarioPlan plan;
  plan.drive = drive;
  plan.scenario = "constant-slow";
  plan.duration_s = 3.0;
  const auto r = board::run_scenario(plan);
  // At a constant speed almost all is lost in the winding (1 ohm) and, at 0.5 rad/s, 0.03 W in friction.
  const double heat_j = r.rms_current_a * r.rms_current_a * 3.0;
  EXPECT_NEAR(r.final_temperature_c - 30.0, heat_j / 2.0, 0.15 * heat_j / 2.0);
}

TEST(Scenarios, AfterAPowerCutAndAPulledCableTheHostTakesTheDriveUp) {
  const auto cut = run(with_event("what = \"power-cut\"\nat_s = 0.4\nduration_s = 0.02\n"), true);
  EXPECT_EQ(cut.end.mode, firmware::Mode::position);
  EXPECT_EQ(cut.first_fault.fault, firmware::Fault::none);
  EXPECT_LT(std::abs(cut.trace.back().output_rad - cut.trace.back().reference.position), 1e-3);
  const auto pulled = run(with_event("what = \"usb-unplugged\"\nat_s = 0.3\nduration_s = 0.4\n"), true);
  EXPECT_EQ(pulled.first_fault.fault, firmware::Fault::host_lost);
  EXPECT_EQ(pulled.end.mode, firmware::Mode::position);
}

TEST(Scenarios, ALostEncoderLineSwitchesTheDriveOff) {
  const auto lost = run(with_event("what = \"encoder-line-lost\"\nat_s = 1.0\n"));
  EXPECT_NE(lost.end.fault.fault, firmware::Fault::none);
  EXPECT_EQ(lost.end.mode, firmware::Mode::fault);
}

// The sine passes its middle at 0.63 rad/s: 51 mrad, which a stuck output may turn by, take 81 ms.
TEST(Scenarios, AnOutputEncoderThatIsStuckOrLosesALineBringsTheDriveToRest) {
  for (const char* what : {"output-encoder-stuck", "output-line-lost"}) {
    const auto lost = run(with_event(std::string("what = \"") + what + "\"\nat_s = 1.0\n"), true);
    EXPECT_EQ(lost.first_fault.fault, firmware::Fault::output_encoder_stuck) << what;
    const std::uint64_t fault_at = lost.first_fault.tick - (lost.ticks - lost.trace.size() * 20);
    EXPECT_GE(fault_at, 20'000u) << what;
    EXPECT_LE(fault_at, 20'000u + 1700) << what;
    EXPECT_EQ(lost.end.mode, firmware::Mode::fault) << what;
    EXPECT_EQ(lost.trace.back().motor_velocity_rad_s, 0.0) << what;
  }
}

TEST(Scenarios, ALoadBeyondTheDrivesTorqueIsAFollowingErrorAndABlowIsNone) {
  const auto dragged = run(with_event("what = \"load-shock\"\nat_s = 0.5\nvalue = 40.0\n"));
  EXPECT_EQ(dragged.first_fault.fault, firmware::Fault::following_error);
  EXPECT_EQ(dragged.end.mode, firmware::Mode::fault);
  const auto hit = run(with_event("what = \"load-shock\"\nat_s = 0.5\nduration_s = 0.05\nvalue = 25.0\n"));
  EXPECT_EQ(hit.first_fault.fault, firmware::Fault::none);
}

}  // namespace
}  // namespace flexspline::tests::scenario_file_test
