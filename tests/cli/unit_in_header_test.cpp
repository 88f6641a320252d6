// Headers that say by themselves that their numbers are no SI values: counters, per cent, units in other languages.
#include <gtest/gtest.h>

#include <cmath>
#include <string>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::unit_in_header_test {
namespace {

constexpr double kTurn_rad = 6.283185307179586;

// A free axis of 2e-4 kg m^2 with friction. Time, position, velocity and effort are logged over these sizes; a counter
// starts at 0.
std::string log_of(const std::string& header, double time, double position, double velocity, double effort) {
  std::string text = header + "\n";
  for (int k = 0; k < 6000; ++k) {
    const double t = 0.002 * k, a = 2.0, b = 5.3;
    const double angle = 60.0 * (std::sin(a * t) / a + 0.5 * std::sin(b * t) / b);
    const double rate = 60.0 * (std::cos(a * t) + 0.5 * std::cos(b * t));
    const double torque =
        -2e-4 * 60.0 * (a * std::sin(a * t) + 0.5 * b * std::sin(b * t)) + 1e-3 * rate + 0.05 * std::tanh(rate / 0.05);
    char line[200];
    std::snprintf(line, sizeof line, "%.9g;%.9g;%.9g;%.9g\n", t / time, angle / position, rate / velocity,
                  torque / effort);
    text += line;
  }
  return text;
}

double inertia_of(const Shell& shell) {
  const nlohmann::json found = shell.json("flexspline identify project --model project/base-model.toml");
  for (const nlohmann::json& p : found["parameters"])
    if (p["effect"] == "inertia") return p["value"].get<double>();
  return 0.0;
}

TEST(UnitInHeader, ACounterOfSamplesIsNoTimeUntilItsPeriodIsStated) {
  const Shell shell;
  shell.write("log.csv",
              log_of("Sample;motor_position_rad;motor_velocity_rad_s;motor_torque_nm", 0.002, 1.0, 1.0, 1.0));
  const Answer refused = shell.run("flexspline new --from log.csv --out project --map time_s=Sample");
  EXPECT_NE(refused.code, 0);
  EXPECT_TRUE(contains(refused.err, "counts samples; state their period as its unit")) << refused.err;
  const Answer open = shell.run("flexspline new --from log.csv --out project");
  EXPECT_TRUE(contains(open.err, "time_s=Sample:PERIOD ms")) << open.err;
  shell.must("flexspline new --force --from log.csv --out project --map 'time_s=Sample:2 ms'");
  EXPECT_NEAR(inertia_of(shell), 2e-4, 4e-6);
}

TEST(UnitInHeader, PerCentNeedsTheRatedValue) {
  const Shell shell;
  shell.write("log.csv",
              log_of("time_s;motor_position_rad;motor_velocity_rad_s;Torque actual [%]", 1.0, 1.0, 1.0, 0.002));
  const Answer refused =
      shell.run("flexspline new --from log.csv --out project --map 'motor_torque_nm=Torque actual [%]'");
  EXPECT_NE(refused.code, 0);
  EXPECT_TRUE(contains(refused.err, "state the size of 1 % as its unit")) << refused.err;
  shell.must("flexspline new --force --from log.csv --out project --map 'motor_torque_nm=Torque actual [%]:0.002 N*m'");
  EXPECT_NEAR(inertia_of(shell), 2e-4, 4e-6);
}

TEST(UnitInHeader, GermanNamesAndUnitsAreRead) {
  const Shell shell;
  shell.write("log.csv", log_of("Zeit [s];Motorposition [Umdr];Motordrehzahl [1/min];Motormoment [Nm]", 1.0, kTurn_rad,
                                kTurn_rad / 60.0, 1.0));
  shell.must("flexspline new --from log.csv --out project");
  EXPECT_NEAR(inertia_of(shell), 2e-4, 4e-6);
  shell.write("log.csv", log_of("Zeit [s];Lage Motor [Inkr];Motordrehzahl [1/min];Motormoment [Nm]", 1.0,
                                kTurn_rad / 65536.0, kTurn_rad / 60.0, 1.0));
  shell.must("flexspline new --force --from log.csv --out project --encoder-counts 65536");
  EXPECT_NEAR(inertia_of(shell), 2e-4, 4e-6);
}

TEST(UnitInHeader, OneThatIsNotKnownIsAskedFor) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s;Weg [furlong];motor_velocity_rad_s;motor_torque_nm", 1.0, 1.0, 1.0, 1.0));
  const Answer refused =
      shell.run("flexspline new --from log.csv --out project --map 'motor_position_rad=Weg [furlong]'");
  EXPECT_NE(refused.code, 0);
  EXPECT_TRUE(contains(refused.err, "the unit \"furlong\" in its name is not known")) << refused.err;
}

TEST(UnitInHeader, APositionInTurnsTakenAsRadIsNotToBeTolerated) {
  const Shell shell;
  shell.write("log.csv",
              log_of("time_s;motor_position_rad;motor_velocity_rad_s;motor_torque_nm", 1.0, kTurn_rad, 1.0, 1.0));
  const Answer refused = shell.run("flexspline new --from log.csv --out project");
  EXPECT_NE(refused.code, 0);
  EXPECT_TRUE(contains(refused.err, "the position is in turns")) << refused.err;
  EXPECT_FALSE(contains(refused.err, "--tolerate")) << refused.err;
}

}  // namespace
}  // namespace flexspline::cli_test::unit_in_header_test
