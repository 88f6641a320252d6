// What new was told to tolerate, its dataset.toml keeps.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::tolerated_findings_test {
namespace {

using namespace small_logs;

TEST(ToleratedFindings, StandInTheDatasetSoThatTheNextCommandsRunAsPrintedWithoutTheOption) {
  const Shell shell;
  shell.write("log.csv", log_of("time,position,velocity,torque", {time_in(1.0), angle, speed, torque}, 0.0012));
  const Answer refused = shell.run("flexspline new --from log.csv --out project");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "new --tolerate jitter keeps it in dataset.toml")) << refused.err;
  std::istringstream said(shell.must("flexspline new --from log.csv --out project --tolerate jitter"));
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "\ntolerate = [\"jitter\"]\n"));
  int commands = 0;
  for (std::string line; std::getline(said, line);)
    if (line.starts_with("  flexspline ")) {
      EXPECT_FALSE(contains(line, "--tolerate")) << line;
      shell.must(line);
      ++commands;
    }
  EXPECT_EQ(commands, 4);
}

TEST(ToleratedFindings, OfADatasetAreKeptInTheOneThatIsMadeOfIt) {
  const Shell shell;
  shell.write("log.csv", log_of("time,position,velocity,torque", {time_in(1.0), angle, speed, torque}, 0.0012));
  shell.must("flexspline new --from log.csv --out project --tolerate jitter");
  shell.must("flexspline new --from project --out again");
  EXPECT_TRUE(contains(shell.file("again/dataset.toml"), "tolerate = [\"jitter\"]"));
}

TEST(ToleratedFindings, GivenAsAnOptionAreInWhatIsPrintedNext) {
  const Shell shell;
  shell.write("log.csv", log_of("time,position,velocity,torque", {time_in(1.0), angle, speed, torque}, 0.0012));
  shell.must("flexspline new --from log.csv --out project --tolerate jitter");
  shell.write("plain/log.csv", log_of("time_s,motor_position_rad,motor_velocity_rad_s,motor_torque_nm",
                                      {time_in(1.0), angle, speed, torque}, 0.0012));
  std::istringstream said(
      shell.must("flexspline diagnose --model project/base-model.toml plain/log.csv --tolerate jitter"));
  for (std::string line; std::getline(said, line);)
    if (line.starts_with("  flexspline add")) {
      EXPECT_TRUE(contains(line, "--tolerate jitter")) << line;
    }
}

}  // namespace
}  // namespace flexspline::cli_test::tolerated_findings_test
