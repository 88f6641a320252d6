// new: names of columns as robots' own loggers write them.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::robot_names_test {
namespace {

using namespace small_logs;

std::string taken(const Shell& shell, const std::string& log, const std::string& options = "") {
  shell.write("log.csv", log);
  return shell.must("flexspline new --force --from log.csv --out project " + options);
}

TEST(RobotNames, PositionVelocityAndTorqueAsOneLetterEach) {
  const Shell shell;
  const std::string said =
      taken(shell, log_of("time,p,v,tau,p_des", {time_in(1.0), angle, speed, torque, times(1.1, angle)}));
  EXPECT_TRUE(contains(said, "motor_position_rad: \"p\"")) << said;
  EXPECT_TRUE(contains(said, "motor_velocity_rad_s: \"v\"")) << said;
  EXPECT_TRUE(contains(said, "position_command_rad: \"p_des\"")) << said;
  // Next to a current the letter is a voltage.
  const std::string voltage = taken(shell, log_of("time,theta,v,i", {time_in(1.0), angle, constant(24.0), torque}));
  EXPECT_TRUE(contains(voltage, "not used: v")) << voltage;
}

TEST(RobotNames, TheAxisOfAKukaIsNoUnit) {
  const Shell shell;
  const std::string said = taken(shell, log_of("time,MsrJntPos_A2,CmdJntPos_A2,MsrTrq_A2,ExtTrq_A2",
                                               {time_in(1.0), angle, times(1.1, angle), torque, constant(0.1)}));
  EXPECT_TRUE(contains(said, "motor_position_rad: \"MsrJntPos_A2\"")) << said;
  EXPECT_TRUE(contains(said, "motor_torque_nm: \"MsrTrq_A2\"")) << said;
  EXPECT_TRUE(contains(said, "position_command_rad: \"CmdJntPos_A2\"")) << said;
  EXPECT_TRUE(contains(said, "not used: ExtTrq_A2")) << said << "computed by a model of the robot";
}

TEST(RobotNames, TemperaturesOfTheJointAreThoseWithItsNumber) {
  const Shell shell;
  const std::string said = taken(
      shell,
      log_of("timestamp actual_q_0 actual_q_1 actual_qd_0 actual_qd_1 actual_current_0 actual_current_1 "
             "joint_temperatures_0 joint_temperatures_1",
             {time_in(1.0), angle, angle, speed, speed, torque, torque, constant(20.0), constant(30.0)}, 0.0, ' '),
      "--joint 1");
  EXPECT_TRUE(contains(said, "temperature_c: \"joint_temperatures_1\"")) << said;
}

TEST(RobotNames, ADotIsADerivativeAndTWithDegreesIsATemperature) {
  const Shell shell;
  const std::string said = taken(
      shell, log_of("time,theta_m,theta_dot,I_q,T_housing_degC", {time_in(1.0), angle, speed, torque, constant(30.0)}),
      "--gear-ratio 100 --torque-constant 1");
  EXPECT_TRUE(contains(said, "motor_velocity_rad_s: \"theta_dot\"")) << said;
  EXPECT_TRUE(contains(said, "temperature_c: \"T_housing_degC\"")) << said;
}

TEST(RobotNames, RostopicEchoNumbersTheElementsOfAField) {
  const Shell shell;
  const Signal stamp = [](double t) { return 1.4e18 + 1e9 * t; };
  std::string log = log_of(
      "%time,field.header.stamp,field.name0,field.name1,field.position0,field.position1,field.velocity0,"
      "field.velocity1,field.effort0,field.effort1",
      {stamp, stamp, constant(0.0), constant(1.0), constant(0.0), angle, constant(0.0), speed, constant(0.0), torque});
  const std::string said = taken(shell, log, "--joint 1");
  EXPECT_TRUE(contains(said, "time_s: \"%time\"")) << said;
  EXPECT_TRUE(contains(said, "in ns by the size of its steps")) << said;
  EXPECT_TRUE(contains(said, "motor_position_rad: \"field.position1\"")) << said;
  EXPECT_TRUE(contains(said, "motor_velocity_rad_s: \"field.velocity1\"")) << said;
  EXPECT_TRUE(contains(said, "motor_torque_nm: \"field.effort1\"")) << said;
}

TEST(RobotNames, BarrettsSymbolsOfAJoint) {
  const Shell shell;
  const std::string log = log_of("time,jp1,jp2,jv1,jv2,jt1,jt2",
                                 {time_in(1.0), constant(0.0), angle, constant(0.0), speed, constant(0.0), torque});
  const std::string said = taken(shell, log, "--joint 2");
  EXPECT_TRUE(contains(said, "motor_position_rad: \"jp2\"")) << said;
  EXPECT_TRUE(contains(said, "motor_velocity_rad_s: \"jv2\"")) << said;
  EXPECT_TRUE(contains(said, "motor_torque_nm: \"jt2\"")) << said;
}

TEST(RobotNames, AStatedColumnIsOfTheJointThatTheOthersAreTakenOf) {
  const Shell shell;
  const std::string log = log_of("time,jp1,jp2,jv1,jv2,jt1,jt2",
                                 {time_in(1.0), constant(0.0), angle, constant(0.0), speed, constant(0.0), torque});
  const std::string said = taken(shell, log, "--map motor_position_rad=jp2");
  EXPECT_TRUE(contains(said, "\"jv2\" reads as a velocity")) << said;
  EXPECT_TRUE(contains(said, "not used: jp1, jv1 and jt1")) << said;
}

TEST(RobotNames, ATextIsNotSuggestedForASignalThatIsMissing) {
  const Shell shell;
  std::string log = "time,position,currant,kappa\n";
  for (int k = 0; k < 2000; ++k) {
    char line[80];
    std::snprintf(line, sizeof line, "%.3f,%.9g,slow,%.9g\n", 0.002 * k, angle(0.002 * k), torque(0.002 * k));
    log += line;
  }
  shell.write("log.csv", log);
  const Answer answer = shell.run("flexspline new --from log.csv --out project");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "--map current_a=kappa")) << answer.err;
  // Nor taken for one by its name.
  const std::string said = taken(shell, "time,position,current_state,current\n" + log.substr(log.find('\n') + 1));
  EXPECT_TRUE(contains(said, "current_a: \"current\"")) << said;
}

}  // namespace
}  // namespace flexspline::cli_test::robot_names_test
