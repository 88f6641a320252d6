// new: a set point is never taken, or suggested, for a measured column.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::set_points_test {
namespace {

using namespace small_logs;

constexpr double kDegree = 180.0 / M_PI, kRpm = 30.0 / M_PI;

TEST(SetPoints, TheGoalOfAServoIsNotItsPosition) {
  const Shell shell;
  shell.write("log.csv", log_of("time,goal_position_deg,present_position_deg,present_velocity_rpm,present_current_mA",
                                {time_in(1.0), times(1.1 * kDegree, angle), times(kDegree, angle), times(kRpm, speed),
                                 times(1e3, torque)}));
  const std::string said = shell.must("flexspline new --from log.csv --out project --torque-constant 1");
  EXPECT_TRUE(contains(said, "motor_position_rad: \"present_position_deg\"")) << said;
  EXPECT_TRUE(contains(said, "position_command_rad: \"goal_position_deg\"")) << said;
}

TEST(SetPoints, AMeasuredColumnIsPreferredToOneThatDoesNotSaySo) {
  const Shell shell;
  for (const std::string measured : {"pos_meas", "pos_act", "fbk_pos", "Istposition", "posFeedback"}) {
    shell.write("log.csv", log_of("time,pos," + measured + ",velocity,torque",
                                  {time_in(1.0), constant(0.0), angle, speed, torque}));
    const std::string said = shell.must("flexspline new --force --from log.csv --out project");
    EXPECT_TRUE(contains(said, "motor_position_rad: \"" + measured + "\"")) << said;
  }
}

TEST(SetPoints, AnyWordForOneIsKnown) {
  const Shell shell;
  for (const std::string set : {"goal", "des", "desired", "cmd", "command", "ref", "target", "setpoint", "soll"}) {
    shell.write("log.csv", log_of("time," + set + "_pos,pos,velocity,torque",
                                  {time_in(1.0), times(1.1, angle), angle, speed, torque}));
    const std::string said = shell.must("flexspline new --force --from log.csv --out project");
    EXPECT_TRUE(contains(said, "motor_position_rad: \"pos\"")) << said;
    EXPECT_TRUE(contains(said, "position_command_rad: \"" + set + "_pos\"")) << said;
  }
}

TEST(SetPoints, OneIsNotSuggestedForAPositionThatIsMissing) {
  const Shell shell;
  shell.write("log.csv", log_of("time,p_des,w_des,tau", {time_in(1.0), times(1.1, angle), times(1.1, speed), torque}));
  const Answer answer = shell.run("flexspline new --from log.csv --out project");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "--map motor_position_rad=NAME")) << answer.err;
}

}  // namespace
}  // namespace flexspline::cli_test::set_points_test
