// `new` leaves what it could find where it cannot finish, and the line to go on with.
#include <fmt/format.h>
#include <gtest/gtest.h>

#include <cmath>
#include <sstream>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::unfinished_project_test {
namespace {

std::string log_of(const std::string& header, int count = 2000) {
  std::string text = header + "\n";
  for (int k = 0; k < count; ++k) {
    char line[120];
    std::snprintf(line, sizeof line, "%.3f,%.6f,%.6f\n", 0.001 * k, std::cos(0.006 * k), 3.0 * std::sin(0.006 * k));
    text += line;
  }
  return text;
}

// The command that a message ends with.
std::string line_to_go_on_with(const std::string& message) {
  const std::size_t at = message.rfind("\n  flexspline new");
  return at == std::string::npos ? "" : message.substr(at + 3, message.find('\n', at + 3) - at - 3);
}

TEST(UnfinishedProject, HoldsWhatWasFoundAndTheLineOnStandardErrorGoesOn) {
  const Shell shell;
  shell.write("log.csv", log_of("clock,Iq,kappa"));
  const Answer answer = shell.run("flexspline new --from log.csv --out project --torque-constant 0.1");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "[columns.current_a]"));
  EXPECT_FALSE(fs::exists(shell.folder() / "project/base-model.toml"));
  std::string line = line_to_go_on_with(answer.err);
  EXPECT_TRUE(contains(line, "--torque-constant 0.1 --map time_s=")) << answer.err;
  EXPECT_TRUE(contains(line, "--map motor_position_rad=")) << answer.err;
  line = "flexspline new --from log.csv --out project --map time_s=clock --map motor_position_rad=kappa";
  shell.must(line);  // without --force: the draft is written over
  EXPECT_TRUE(fs::exists(shell.folder() / "project/base-model.toml"));
}

TEST(UnfinishedProject, OfADatasetTomlProposesNoMapAsThatMapsTheColumns) {
  const Shell shell;
  std::string log = "t,i,q\n";
  for (int k = 0; k < 400; ++k)
    log += fmt::format("{},{},{}\n", 4e-3 * k + (k % 2 ? 1.5e-3 : 0.0), 0.1 * std::sin(0.02 * k), std::sin(0.01 * k));
  shell.write("log.csv", log);
  shell.write(
      "dataset.toml",
      "format = \"flexspline-dataset/1\"\n[columns.time_s]\nsource = \"t\"\n[columns.current_a]\nsource = \"i\"\n"
      "[columns.motor_position_rad]\nsource = \"q\"\n[[experiment]]\nfile = \"log.csv\"\n");
  const Answer answer = shell.run("flexspline new --from dataset.toml --out project --torque-constant 0.1");
  EXPECT_EQ(answer.code, 2);
  const std::string line = line_to_go_on_with(answer.err);
  EXPECT_TRUE(contains(line, "--tolerate jitter")) << answer.err;
  EXPECT_FALSE(contains(line, "--map")) << answer.err;
  shell.must(line);
}

TEST(UnfinishedProject, ADraftThatWasChangedByHandIsNotWrittenOver) {
  const Shell shell;
  shell.write("log.csv", log_of("clock,Iq,kappa"));
  EXPECT_EQ(shell.run("flexspline new --from log.csv --out project").code, 2);
  const std::string changed = shell.file("project/dataset.toml") + "# checked by hand\n";
  shell.write("project/dataset.toml", changed);
  const std::string line =
      "flexspline new --from log.csv --out project --map time_s=clock --map motor_position_rad=kappa";
  const Answer answer = shell.run(line);
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "project/dataset.toml")) << answer.err;
  EXPECT_TRUE(contains(answer.err, "--force")) << answer.err;
  EXPECT_EQ(shell.file("project/dataset.toml"), changed);
  shell.must(line + " --force");
}

TEST(UnfinishedProject, MessagesNameLinesOfTheFileThatIsThere) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s,current_a,motor_counts"));
  const Answer answer =
      shell.run("flexspline new --from log.csv --out project --map motor_position_rad=motor_counts:counts");
  EXPECT_EQ(answer.code, 2);
  const std::size_t at = answer.err.find("project/dataset.toml:");
  ASSERT_NE(at, std::string::npos) << answer.err;
  const int number = std::stoi(answer.err.substr(at + 21));
  std::istringstream lines(shell.file("project/dataset.toml"));
  std::string line;
  for (int k = 0; k < number; ++k) std::getline(lines, line);
  EXPECT_TRUE(contains(line, "columns.motor_position_rad")) << number << " " << shell.file("project/dataset.toml");
}

TEST(UnfinishedProject, CountsATurnAreAskedForByTheirOption) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s,i_q,theta_counts"));
  const Answer answer = shell.run("flexspline new --from log.csv --out project");
  EXPECT_EQ(answer.code, 2);
  // The q of a current is an axis of the field, and no angle of the link.
  EXPECT_FALSE(contains(shell.file("project/dataset.toml"), "of the output")) << shell.file("project/dataset.toml");
  const std::string line = line_to_go_on_with(answer.err), wanted = " --encoder-counts NUMBER";
  ASSERT_TRUE(contains(line, wanted)) << answer.err;
  shell.must(line.substr(0, line.find(wanted)) + " --encoder-counts 4");
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "encoder_counts = 4")) << shell.file("project/dataset.toml");
}

TEST(UnfinishedProject, ATorqueThatHasTheNameOfTheSensorsMayBeTheMotors) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s,torque_nm,motor_position_rad"));
  const Answer answer = shell.run("flexspline new --from log.csv --out project");
  EXPECT_EQ(answer.code, 2);
  const std::string line = line_to_go_on_with(answer.err);
  EXPECT_TRUE(contains(line, " --map motor_torque_nm=torque_nm")) << answer.err;
  shell.must(line);
  EXPECT_TRUE(contains(shell.file("project/base-model.toml"), "inertia"));
}

TEST(UnfinishedProject, WhatCanBeToleratedStandsInTheLine) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s,current_a,motor_position_rad") + "2.000,nan,1.0\n2.001,0,1\n");
  const Answer answer = shell.run("flexspline new --from log.csv --out project");
  EXPECT_EQ(answer.code, 2);
  const std::string line = line_to_go_on_with(answer.err);
  EXPECT_TRUE(contains(line, "--tolerate not_finite")) << answer.err;
  shell.must(line);
}

TEST(UnfinishedProject, AVelocityOfTheOtherSideAsksForTheGearRatio) {
  const Shell shell;
  std::string text = "time_s,iq_a,position_rad,motor_speed_rad_s\n";
  for (int k = 0; k < 4000; ++k) {
    char line[120];
    std::snprintf(line, sizeof line, "%.3f,%.6f,%.8f,%.6f\n", 0.001 * k, std::cos(0.006 * k), 0.5 * std::sin(0.006 * k),
                  120.0 * 3.0 * std::cos(0.006 * k));
    text += line;
  }
  shell.write("log.csv", text);
  const Answer answer = shell.run("flexspline new --from log.csv --out project --torque-constant 0.1");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "with a gear ratio of about 120")) << answer.err;
  EXPECT_TRUE(contains(line_to_go_on_with(answer.err), "--gear-ratio NUMBER")) << answer.err;
}

// How late the current follows it is not known, so it is not taken by itself.
TEST(UnfinishedProject, ASetPointOfTheCurrentIsProposedWhereNoneIsMeasured) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s,iq_cmd_A,motor_pos_rad"));
  const Answer answer = shell.run("flexspline new --from log.csv --out project --torque-constant 0.1");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(line_to_go_on_with(answer.err), "--map current_a=iq_cmd_A")) << answer.err;
}

}  // namespace
}  // namespace flexspline::cli_test::unfinished_project_test
