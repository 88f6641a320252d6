// `new` finds out whether the effort of a log is held from sample to sample, as logs seldom say it.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::effort_hold_test {
namespace {

using namespace small_logs;

// Every 2 ms, the torque of `late_s` before.
std::string dataset_of(double late_s, const std::string& header = "") {
  const Shell shell;
  const Signal effort = [=](double t) { return torque(t - late_s); };
  shell.write("log.csv", header + log_of("time_s,motor_position_rad,motor_torque_nm", {time_in(1.0), angle, effort}));
  shell.must("flexspline new --from log.csv --out project");
  return shell.file("project/dataset.toml");
}

TEST(EffortHold, IsNoneWhereTheTorqueIsThatOfTheSample) {
  EXPECT_TRUE(contains(dataset_of(0.0), "current_hold = \"none\""));
}

// A command that is held acts half a sample later on average.
TEST(EffortHold, IsThatOfACommandWhereTheTorqueIsHeld) {
  EXPECT_FALSE(contains(dataset_of(-0.001), "current_hold"));
}

TEST(EffortHold, ThatTheLogStatesStays) {
  EXPECT_FALSE(contains(dataset_of(0.0, "# current_hold: zoh\n"), "current_hold = \"none\""));
}

}  // namespace
}  // namespace flexspline::cli_test::effort_hold_test
