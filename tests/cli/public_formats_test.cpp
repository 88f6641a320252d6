// Logs of real robots and drives, made from the documents of their formats: from the file to an identified model in two
// commands.
#include <gtest/gtest.h>

#include <cmath>
#include <functional>
#include <vector>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::public_formats_test {
namespace {

// The drive of fixtures/make.py.
constexpr double kInertia = 2e-4, kViscous = 1e-3, kCoulomb = 0.05, kTorqueConstant = 0.1, kRatio = 100.0;

struct Sample {
  double t, angle, speed, torque, current;  // at the motor
};

std::vector<Sample> motion(std::size_t count, double sample_s) {
  std::vector<Sample> samples;
  for (std::size_t k = 0; k < count; ++k) {
    const double t = sample_s * static_cast<double>(k);
    Sample s{t, 60.0 * (std::sin(2.0 * t) / 2.0 + 0.5 * std::sin(5.3 * t) / 5.3),
             60.0 * (std::cos(2.0 * t) + 0.5 * std::cos(5.3 * t)), 0.0, 0.0};
    const double acceleration = -60.0 * (2.0 * std::sin(2.0 * t) + 0.5 * 5.3 * std::sin(5.3 * t));
    s.torque = kInertia * acceleration + kViscous * s.speed + kCoulomb * std::tanh(s.speed / 0.05);
    s.current = s.torque / kTorqueConstant;
    samples.push_back(s);
  }
  return samples;
}

std::string number(double value, int digits = 9) {
  char text[40];
  std::snprintf(text, sizeof text, "%.*g", digits, value);
  return text;
}

std::string log_of(const std::string& header, const std::vector<Sample>& samples,
                   const std::function<std::string(const Sample&)>& line) {
  std::string text = header + "\n";
  for (const Sample& s : samples) text += line(s) + "\n";
  return text;
}

std::string with_decimal_commas(std::string text) {
  for (char& c : text)
    if (c == '.') c = ',';
  return text;
}

// Two commands; friction and inertia of the motor times `scale`.
void expect_identified(const Shell& shell, const std::string& file, const std::string& options, double scale = 1.0,
                       double tolerance = 0.03) {
  shell.must("flexspline new --from " + file + " --out project " + options);
  const nlohmann::json found = shell.json("flexspline identify project --model project/base-model.toml");
  int seen = 0;
  for (const nlohmann::json& p : found["parameters"]) {
    const double value = p["value"].is_null() ? NAN : p["value"].get<double>();
    const auto expect = [&](double truth) {
      EXPECT_NEAR(value, scale * truth, tolerance * scale * truth) << p["effect"] << "\n"
                                                                   << shell.file("project/dataset.toml");
      ++seen;
    };
    if (p["effect"] == "inertia") expect(kInertia);
    if (p["effect"] == "viscous_friction") expect(kViscous);
    if (p["effect"] == "coulomb_friction") expect(kCoulomb);
  }
  EXPECT_EQ(seen, 3) << found.dump(1);
}

std::string fixture(const char* name) {
  return "'" + (fs::path(FLEXSPLINE_SOURCE_DIR) / "tests/cli/fixtures" / name).string() + "'";
}

// The recorder of UR's RTDE client: blanks, six joints.
TEST(PublicFormats, UniversalRobotsRtde) {
  const Shell shell;
  std::string header = "timestamp";
  for (const char* name : {"target_q", "actual_q", "actual_qd", "actual_current", "actual_TCP_force"})
    for (int k = 0; k < 6; ++k) header += std::string(" ") + name + "_" + std::to_string(k);
  shell.write("robot_data.csv", log_of(header + " runtime_state", motion(1500, 0.008), [](const Sample& s) {
                std::string line = number(93100.5 + s.t, 12);
                for (const double value : {s.angle / kRatio, s.angle / kRatio, s.speed / kRatio, s.current, 0.0})
                  for (int k = 0; k < 6; ++k) line += " " + (k == 2 ? number(value) : std::string("0.0"));
                return line + " 2";
              }));
  expect_identified(shell, "robot_data.csv", "--gear-ratio 100 --torque-constant 0.1 --joint 2");
}

// libfranka's logToCSV: milliseconds, torque and position of the joint.
TEST(PublicFormats, Libfranka) {
  const Shell shell;
  std::string header = "time,success_rate";
  for (const char* name : {"state.q", "state.q_d", "state.dq", "state.dq_d", "state.tau_J", "cmd.q_d"})
    for (int k = 0; k < 7; ++k) header += std::string(",") + name + "[" + std::to_string(k) + "]";
  const auto line = [](const Sample& s) {
    std::string text = number(std::round(1000.0 * s.t)) + ",1";
    for (const double value :
         {s.angle / kRatio, s.angle / kRatio, s.speed / kRatio, s.speed / kRatio, s.torque * kRatio, 0.0})
      for (int k = 0; k < 7; ++k) text += "," + (k == 3 ? number(value) : std::string("0"));
    return text;
  };
  shell.write("log.csv", log_of(header, motion(6000, 0.001), line));
  shell.must("flexspline new --from log.csv --out project --joint 3");
  const nlohmann::json found = shell.json("flexspline identify project --model project/base-model.toml");
  for (const nlohmann::json& p : found["parameters"]) {
    if (p["effect"] == "inertia") {
      EXPECT_NEAR(p["value"].get<double>(), kInertia * kRatio * kRatio, 0.03 * kInertia * kRatio * kRatio);
    }
    if (p["effect"] == "coulomb_friction") {
      EXPECT_NEAR(p["value"].get<double>(), kCoulomb * kRatio, 0.03 * kCoulomb * kRatio);
    }
  }
}

// joint_states of ROS: effort in N*m of the joint; referred to the motor by the gear ratio.
TEST(PublicFormats, RosBagsOfJointStates) {
  for (const char* name : {"joint_states.bag", "joint_states.db3", "joint_states.mcap"}) {
    const Shell shell;
    expect_identified(shell, fixture(name), "--joint 1 --gear-ratio 100");
  }
}

TEST(PublicFormats, MoteusTview) {
  const Shell shell;
  expect_identified(shell, fixture("tview.log"), "--torque-constant 0.1");
}

TEST(PublicFormats, OdriveLiveplotter) {
  const Shell shell;
  const std::string header =
      "time,axis0.encoder.pos_estimate,axis0.encoder.vel_estimate,axis0.motor.current_control.Iq_measured";
  shell.write("plot.csv", log_of(header, motion(1200, 0.01), [](const Sample& s) {
                return number(s.t) + "," + number(s.angle / (2.0 * M_PI)) + "," + number(s.speed / (2.0 * M_PI)) + "," +
                       number(s.current);
              }));
  expect_identified(shell, "plot.csv", "--torque-constant 0.1", 1.0, 0.05);  // a hundred samples a second
}

// The header of VESC Tool; electrical speed in whole rpm, no position that could be used.
TEST(PublicFormats, VescTool) {
  const Shell shell;
  const std::string header =
      "ms_today;input_voltage;temp_mos_max;temp_mos_1;temp_motor;current_motor;current_in;d_axis_current;q_axis_"
      "current;"
      "erpm;duty_cycle;tachometer;tachometer_abs;encoder_position;fault_code;vesc_id;roll;accX;gyroX;gnss_gVel;";
  shell.write("vesc.csv", log_of(header, motion(1000, 0.02), [](const Sample& s) {
                return number(80069026.0 + std::round(1000.0 * s.t), 10) + ";48;30;30;" + number(30.0 + 0.01 * s.t, 4) +
                       ";" + number(std::abs(s.current), 4) + ";0.1;0;" + number(s.current, 5) + ";" +
                       number(std::round(7.0 * s.speed * 30.0 / M_PI)) + ";0.2;0;0;" +
                       number(std::fmod(std::abs(s.angle) * 180.0 / M_PI, 360.0), 4) + ";0;1;0;0;0;0;";
              }));
  expect_identified(shell, "vesc.csv", "--torque-constant 0.1 --pole-pairs 7", 1.0, 0.1);
}

// writetimetable: row times with their unit.
TEST(PublicFormats, MatlabTimetable) {
  const Shell shell;
  shell.write("timetable.csv", log_of("Time,theta_m,omega_m,iq", motion(1500, 0.008), [](const Sample& s) {
                return number(s.t) + " sec," + number(s.angle) + "," + number(s.speed) + "," + number(s.current);
              }));
  expect_identified(shell, "timetable.csv", "--torque-constant 0.1");
}

// Two columns a channel under a block of settings, tabs, decimal commas.
TEST(PublicFormats, BeckhoffScope) {
  const Shell shell;
  const std::string header =
      "Name\tScope Project\nFile\tC:\\scope\\run.svdx\nStarttime of export\t128783093223690000\tDonnerstag, 5. Februar "
      "2009\t13:08:42\nEndtime of export\t128783093339880000\tDonnerstag, 5. Februar 2009\t13:08:53\n\n"
      "Name\tActPos\tName\tActVelo\tName\tActCurrent\nNetId\t5.1.2.3.1.1\tNetId\t5.1.2.3.1.1\tNetId\t5.1.2.3.1.1\n"
      "Port\t501\tPort\t501\tPort\t501\nSampleTime[ms]\t8\tSampleTime[ms]\t8\tSampleTime[ms]\t8\n"
      "SymbolName\tAxes.Axis 1.ActPos\tSymbolName\tAxes.Axis 1.ActVelo\tSymbolName\tMAIN.ActCurrent\n"
      "Data-Type\tREAL64\tData-Type\tREAL64\tData-Type\tREAL64\n";
  shell.write("scope.csv", log_of(header, motion(1500, 0.008), [](const Sample& s) {
                             const std::string ms = number(1000.0 * s.t);
                             return with_decimal_commas(ms + "\t" + number(s.angle * 180.0 / M_PI) + "\t" + ms + "\t" +
                                                        number(s.speed * 180.0 / M_PI) + "\t" + ms + "\t" +
                                                        number(s.current));
                           }) + "EOF\n");
  expect_identified(
      shell, "scope.csv",
      "--torque-constant 0.1 --map motor_position_rad=ActPos:deg --map motor_velocity_rad_s=ActVelo:deg/s");
}

TEST(PublicFormats, ElmoAndCopleyInCounts) {
  const Shell shell;
  const std::string header = "Time [sec],Position [cnt],Velocity [cnt/sec],Active Current [A],Position Error [cnt]";
  const double counts = 65536.0 / (2.0 * M_PI);
  shell.write("recorder.csv", log_of(header, motion(1500, 0.008), [&](const Sample& s) {
                return number(s.t) + "," + number(std::round(counts * s.angle)) + "," +
                       number(std::round(counts * s.speed)) + "," + number(s.current) + ",0";
              }));
  expect_identified(shell, "recorder.csv", "--torque-constant 0.1 --encoder-counts 65536");
}

TEST(PublicFormats, DspaceControlDesk) {
  const Shell shell;
  expect_identified(shell, fixture("controldesk.mat"), "--torque-constant 0.1");
}

}  // namespace
}  // namespace flexspline::cli_test::public_formats_test
