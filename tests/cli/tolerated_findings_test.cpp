// What new was told to tolerate, the commands that it prints tolerate too.
#include <gtest/gtest.h>

#include <sstream>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::tolerated_findings_test {
namespace {

using namespace small_logs;

TEST(ToleratedFindings, TheNextCommandsRunAsPrinted) {
  const Shell shell;
  shell.write("log.csv", log_of("time,position,velocity,torque", {time_in(1.0), angle, speed, torque}, 0.0012));
  EXPECT_EQ(shell.run("flexspline new --from log.csv --out project").code, 2);
  std::istringstream said(shell.must("flexspline new --from log.csv --out project --tolerate jitter"));
  int commands = 0;
  for (std::string line; std::getline(said, line);)
    if (line.starts_with("  flexspline ")) {
      std::istringstream answer(shell.must(line));
      ++commands;
      // What that one prints next carries it, too.
      for (std::string next; std::getline(answer, next);)
        if (next.starts_with("  flexspline ")) {
          EXPECT_TRUE(contains(next, "--tolerate jitter")) << line << "\n" << next;
        }
    }
  EXPECT_EQ(commands, 4);
}

}  // namespace
}  // namespace flexspline::cli_test::tolerated_findings_test
