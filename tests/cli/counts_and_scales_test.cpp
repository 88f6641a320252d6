// new: numbers without a unit: counts of an encoder that are taken for radians, and a scale alone behind --map.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::counts_and_scales_test {
namespace {

using namespace small_logs;

// A servo with 4096 counts per turn and 0.229 rpm per count of velocity.
constexpr double kCount_rad = 2.0 * M_PI / 4096.0, kCount_rad_s = 0.229 * M_PI / 30.0;

TEST(CountsAndScales, CountsTakenForRadiansAreNamedAndTheirSizesAskedFor) {
  const Shell shell;
  shell.write("log.csv",
              log_of("time_ms,present_position,present_velocity,present_current",
                     {time_in(1e-3), whole(1.0 / kCount_rad, angle), whole(1.0 / kCount_rad_s, speed), torque}));
  const Answer answer = shell.run("flexspline new --from log.csv --out project --torque-constant 1");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "counts per turn")) << answer.err;
  EXPECT_TRUE(contains(answer.err, "it holds whole numbers only: that is likely counts")) << answer.err;
  EXPECT_TRUE(contains(answer.err, "--map motor_position_rad=present_position:UNIT")) << answer.err;
  EXPECT_TRUE(contains(answer.err, "--map motor_velocity_rad_s=present_velocity:UNIT")) << answer.err;
  EXPECT_FALSE(contains(answer.err, "--tolerate")) << answer.err;
  shell.must(
      "flexspline new --from log.csv --out project --torque-constant 1 "
      "--map 'motor_position_rad=present_position:0.00153398 rad' "
      "--map 'motor_velocity_rad_s=present_velocity:0.229 rpm'");
}

TEST(CountsAndScales, WholeNumbersAreCountsWhereTheCountsOfATurnAreStated) {
  const Shell shell;
  shell.write("log.csv", log_of("time_ms,motor_encoder,motor_speed_rad_s,motor_current_a",
                                {time_in(1e-3), whole(1.0 / kCount_rad, angle), speed, torque}));
  shell.must("flexspline new --from log.csv --out project --torque-constant 1 --encoder-counts 4096");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "unit = \"counts\"")) << shell.file("project/dataset.toml");
}

TEST(CountsAndScales, ANumberAloneIsAScaleInTheColumnsOwnUnit) {
  const Shell shell;
  shell.write("log.csv", log_of("time,pos_deg,torque [%]", {time_in(1.0), times(180.0 / M_PI / 2.0, angle), torque}));
  shell.must(
      "flexspline new --from log.csv --out project --map 'motor_torque_nm=torque [%]:0.078' "
      "--map motor_position_rad=pos_deg:2");
  const std::string toml = shell.file("project/dataset.toml");
  EXPECT_TRUE(contains(toml, "unit = \"0.078 N*m\"")) << toml;
  EXPECT_TRUE(contains(toml, "unit = \"2 deg\"")) << toml;
}

TEST(CountsAndScales, AScaleOfALinearAxisIsInItsUnits) {
  const Shell shell;
  shell.write("log.csv", log_of("time,pos_mm,force", {time_in(1.0), times(1e3, angle), torque}));
  shell.must("flexspline new --from log.csv --out project --map motor_torque_nm=force:0.078");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "unit = \"0.078 N\"")) << shell.file("project/dataset.toml");
}

TEST(CountsAndScales, AScaleThatIsNoneIsAnsweredWithAnExample) {
  const Shell shell;
  shell.write("log.csv", log_of("time,pos,torque", {time_in(1.0), angle, torque}));
  const Answer answer = shell.run("flexspline new --from log.csv --out project --map motor_torque_nm=torque:-0.078");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "--map 'motor_torque_nm=torque:0.5 N*m'")) << answer.err;
}

}  // namespace
}  // namespace flexspline::cli_test::counts_and_scales_test
