// Which side of the gear a position is of: by its name, as stated, asked for, and doubted.
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>
#include <vector>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::position_side_test {
namespace {

constexpr double kJ = 2e-4, kB = 1e-3, kC = 0.05, kKm = 0.1, kRatio = 100.0;

// A joint behind a gear of 100: position and velocity of the link, current of the motor. The header names three columns
// beside the time.
std::string joint_log(const std::string& header, double motor_over_logged = kRatio, double speed = 60.0) {
  std::string text = header + "\n";
  for (int k = 0; k < 6000; ++k) {
    const double t = 0.002 * k, a = 2.0, b = 5.3;
    const double angle = speed * (std::sin(a * t) / a + 0.5 * std::sin(b * t) / b);
    const double velocity = speed * (std::cos(a * t) + 0.5 * std::cos(b * t));
    const double acceleration = -speed * (a * std::sin(a * t) + 0.5 * b * std::sin(b * t));
    const double torque = kJ * acceleration + kB * velocity + kC * std::tanh(velocity / 0.05);
    char line[200];
    std::snprintf(line, sizeof line, "%.3f,%.9g,%.9g,%.9g\n", t, angle / motor_over_logged,
                  velocity / motor_over_logged, torque / kKm);
    text += line;
  }
  return text;
}

double inertia_of(const Shell& shell, const std::string& options) {
  shell.must("flexspline new --force --from log.csv --out project --torque-constant 0.1 " + options);
  const nlohmann::json found = shell.json("flexspline identify project --model project/base-model.toml");
  for (const nlohmann::json& p : found["parameters"])
    if (p["effect"] == "inertia") return p["value"].get<double>();
  return 0.0;
}

TEST(PositionSide, OfTheLinkWithTheCurrentOfTheMotorGivesTheMotorsInertiaByOneOption) {
  const Shell shell;
  // The names say so ...
  shell.write("log.csv", joint_log("time,q_actual,qd_actual,current_actual"));
  EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100"), kJ, 0.02 * kJ);
  // ... as those of UR do ...
  shell.write("log.csv", joint_log("timestamp,actual_q_0,actual_qd_0,actual_current_0"));
  EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100"), kJ, 0.02 * kJ);
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "scale = 100")) << shell.file("project/dataset.toml");
  // ... or the user does.
  shell.write("log.csv", joint_log("time,pos,vel,iq"));
  EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100 --position-side link"), kJ, 0.02 * kJ);
  // In the tool's own names, too.
  shell.write("log.csv", joint_log("time_s,output_position_rad,output_velocity_rad_s,current_a"));
  EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100 --position-side link"), kJ, 0.02 * kJ);
  // A log of the motor stays as it is.
  shell.write("log.csv", joint_log("time,pos,vel,iq", 1.0));
  EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100 --position-side motor"), kJ, 0.02 * kJ);
}

// A joint with an elastic gear in the symbols of its textbooks, which libfranka uses as well: theta of the motor, q of
// the link, tau_J between both. tau_J is no torque of the motor.
TEST(PositionSide, IsSaidByTheSymbolsOfElasticJoints) {
  const Shell shell;
  std::string log = "time,theta,q,dq,tau_J,iq\n";
  for (int k = 0; k < 3000; ++k) {
    const double t = 0.002 * k, q = 0.8 * std::sin(2.0 * t), torque = 20.0 * std::sin(q);
    char line[200];
    std::snprintf(line, sizeof line, "%.3f,%.9g,%.9g,%.9g,%.6g,%.6g\n", t, kRatio * (q + torque / 2e4), q,
                  1.6 * std::cos(2.0 * t), torque, torque / kRatio / kKm);
    log += line;
  }
  shell.write("log.csv", log);
  const std::string said =
      shell.must("flexspline new --from log.csv --out project --gear-ratio 100 --torque-constant 0.1");
  EXPECT_TRUE(contains(said, "motor_position_rad: \"theta\"")) << said;
  EXPECT_TRUE(contains(said, "output_position_rad: \"q\"")) << said;
  EXPECT_TRUE(contains(said, "torque_nm: \"tau_J\"")) << said;
  EXPECT_FALSE(contains(said, "motor_torque_nm")) << said;
  EXPECT_TRUE(contains(said, "linear_stiffness")) << said;
}

// As robot controllers log it: the joint's angle with the motor's speed, and a torque in percent.
TEST(PositionSide, IsFoundByTheSpeedWhereThatIsOfTheOtherSide) {
  const Shell shell;
  std::string log = "time_s,AXIS_POS[deg],MOT_SPEED[rpm],MOT_TORQUE[%]\n";
  std::istringstream lines(joint_log("t,q,w,i", 1.0));
  std::string line;
  std::getline(lines, line);
  constexpr double kRated_nm = 0.5;
  while (std::getline(lines, line)) {
    double t = 0.0, q = 0.0, w = 0.0, current = 0.0;
    ASSERT_EQ(std::sscanf(line.c_str(), "%lf,%lf,%lf,%lf", &t, &q, &w, &current), 4);
    char text[200];
    std::snprintf(text, sizeof text, "%.3f,%.9g,%.9g,%.9g\n", t, q / kRatio * 180.0 / M_PI, w * 30.0 / M_PI,
                  100.0 * current * kKm / kRated_nm);
    log += text;
  }
  shell.write("log.csv", log);
  for (const std::string side : {"", " --position-side link", " --position-side motor"})
    EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100 --map 'motor_torque_nm=MOT_TORQUE[%]:0.005 N*m'" + side), kJ,
                0.02 * kJ)
        << side;
  const std::string said = shell.must("flexspline new --force --from log.csv --out project --gear-ratio 100");
  EXPECT_TRUE(contains(said, "state the size of 1 % as its unit")) << said;
}

TEST(PositionSide, ATorqueInPerMilleNeedsTheSizeOfOne) {
  const Shell shell;
  shell.write("log.csv", joint_log("time,motor_pos,motor_vel,Torque_actual_permille", 1.0));
  const std::string said = shell.must("flexspline new --from log.csv --out project --gear-ratio 100");
  EXPECT_TRUE(contains(said, "state the size of 1 per mille as its unit")) << said;
}

TEST(PositionSide, OfAJointWithATorqueSensorNextToTheMotorsIsTheOutput) {
  const Shell shell;
  const auto log_of = [](const std::string& header) {
    std::string log = header + "\n";
    for (int k = 0; k < 2000; ++k) {
      const double t = 0.001 * k;
      char text[200];
      std::snprintf(text, sizeof text, "%.3f,%.9g,%.9g,%.9g,%.9g\n", t, kRatio * std::sin(6.0 * t), std::sin(6.0 * t),
                    std::cos(6.0 * t), std::cos(6.0 * t));
      log += text;
    }
    return log;
  };
  shell.write("log.csv", log_of("time,motor_pos_rad,ankle_pos_rad,current_A,ankle_torque_Nm"));
  shell.run("flexspline new --from log.csv --out project --gear-ratio 100");
  const std::string toml = shell.file("project/dataset.toml");
  EXPECT_TRUE(contains(toml, "[columns.output_position_rad]")) << toml;
  EXPECT_TRUE(contains(toml, "source = \"ankle_pos_rad\"")) << toml;
  // Not without that sensor: then nothing says what the second position is.
  shell.write("log.csv", log_of("time,motor_pos_rad,ankle_pos_rad,current_A,value"));
  shell.run("flexspline new --from log.csv --out other --gear-ratio 100");
  EXPECT_FALSE(contains(shell.file("other/dataset.toml"), "[columns.output_position_rad]"));
}

TEST(PositionSide, IsAskedForWhereNamesDoNotSayAndTheRatioMakesADifference) {
  const Shell shell;
  shell.write("log.csv", joint_log("time,pos,vel,iq"));
  const Answer asked = shell.run("flexspline new --from log.csv --out project --gear-ratio 100");
  EXPECT_EQ(asked.code, 2);
  EXPECT_TRUE(contains(asked.err, "--position-side motor or --position-side link")) << asked.err;
  // Without a ratio there is no difference, and what is assumed is said.
  EXPECT_TRUE(contains(shell.must("flexspline new --from log.csv --out other"), "--position-side link"));
}

TEST(PositionSide, ASideWithSpeedsThatNoDriveHasIsDoubted) {
  const Shell shell;
  shell.write("log.csv", joint_log("time,pos,vel,iq", 1.0));
  EXPECT_TRUE(contains(shell.run("flexspline new --from log.csv --out a --gear-ratio 100 --position-side link").err,
                       "--position-side motor"));
  shell.write("log.csv", joint_log("time,motor_pos,motor_vel,iq", kRatio));
  EXPECT_TRUE(
      contains(shell.run("flexspline new --from log.csv --out b --gear-ratio 100").err, "--position-side link"));
}

TEST(PositionSide, LettersOfMotorAndLinkAreNoUnits) {
  const Shell shell;
  for (const std::string motor : {"theta_m", "q_m", "phi_m", "angle_m"}) {
    shell.write("log.csv", joint_log("time," + motor + ",omega_m,iq", 1.0));
    const nlohmann::json made = shell.json("flexspline new --force --from log.csv --out project");
    const std::string toml = shell.file("project/dataset.toml");
    EXPECT_FALSE(contains(toml, "linear")) << toml;
    EXPECT_TRUE(contains(toml, "[columns.motor_position_rad]  # guess")) << toml;
  }
  shell.write("log.csv", joint_log("time,pos_m,pos_l,iq", 1.0));
  shell.must("flexspline new --force --from log.csv --out project");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "[columns.output_position_rad]"))
      << shell.file("project/dataset.toml");
  // A position in metres stays one.
  shell.write("log.csv", joint_log("time,position_m,velocity_m_s,force_n", 1e3));
  shell.must("flexspline new --force --from log.csv --out project");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "axis = \"linear\""));
}

TEST(PositionSide, OneJointOfSeveralIsChosenByItsNumber) {
  const Shell shell;
  std::istringstream whole(joint_log("time,q_0,qd_0,i_0"));
  std::string text, line;
  std::getline(whole, line);
  text = "time,actual_q_0,actual_qd_0,actual_current_0,actual_q_1,actual_qd_1,actual_current_1\n";
  while (std::getline(whole, line)) {
    const std::size_t comma = line.find(',');
    text += line.substr(0, comma) + ",0,0,0" + line.substr(comma) + "\n";
  }
  shell.write("log.csv", text);
  EXPECT_NEAR(inertia_of(shell, "--gear-ratio 100 --joint 1"), kJ, 0.02 * kJ);
  const Answer none = shell.run("flexspline new --force --from log.csv --out project --joint 7");
  EXPECT_EQ(none.code, 2);
  EXPECT_TRUE(contains(none.err, "the joints are 0, 1")) << none.err;
}

}  // namespace
}  // namespace flexspline::cli_test::position_side_test
