// new: the pitch of a linear axis, without which no ripple per motor turn is tried.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::pitch_test {
namespace {

using namespace small_logs;

TEST(Pitch, IsAskedForWhereTheAxisIsLinearAndReachesTheModel) {
  const Shell shell;
  shell.write("log.csv", log_of("t,x_mm,v_mm_s,force", {time_in(1.0), times(1e3, angle), times(1e3, speed), torque}));
  const std::string open = shell.must("flexspline new --from log.csv --out project");
  EXPECT_TRUE(contains(open, "--pitch-m")) << open;
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "# pitch_m = "));
  const std::string stated = shell.must("flexspline new --force --from log.csv --out project --pitch-m 0.005");
  EXPECT_FALSE(contains(stated, "--pitch-m")) << stated;
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "pitch_m = 0.005"));
  EXPECT_TRUE(contains(shell.file("project/base-model.toml"), "pitch_m = { value = 0.005"))
      << shell.file("project/base-model.toml");
}

TEST(Pitch, DoesNotGoWithARotaryAxis) {
  const Shell shell;
  shell.write("log.csv", log_of("t,pos,torque", {time_in(1.0), angle, torque}));
  EXPECT_FALSE(contains(shell.must("flexspline new --from log.csv --out project"), "pitch"));
  const Answer answer = shell.run("flexspline new --force --from log.csv --out project --pitch-m 0.005");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "--axis linear")) << answer.err;
}

}  // namespace
}  // namespace flexspline::cli_test::pitch_test
