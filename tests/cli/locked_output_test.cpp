// Where an output does not move, the warning says how to state that it is locked.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::locked_output_test {
namespace {

using namespace small_logs;

std::string warnings(const Signal& output) {
  const Shell shell;
  shell.write("log.csv", log_of("time_s,motor_position_rad,output_position_rad,torque_nm,current_a",
                                {time_in(1.0), angle, output, torque, torque}));
  const Answer answer = shell.run("flexspline new --from log.csv --out project --gear-ratio 50 --torque-constant 0.1");
  EXPECT_EQ(answer.code, 0) << answer.err;
  return answer.err;
}

TEST(LockedOutput, IsStatedByLoadAsTheWarningOfItsRatioSays) {
  const std::string said = warnings(times(0.05 / 50.0, angle));
  EXPECT_TRUE(contains(said, "check gear_ratio")) << said;
  EXPECT_TRUE(contains(said, "load = \"locked\"")) << said;
  EXPECT_FALSE(contains(warnings(times(2.0 / 50.0, angle)), "locked"));
}

TEST(LockedOutput, IsStatedByLoadAsTheWarningOfItsConstantPositionSays) {
  const std::string said = warnings(constant(0.3));
  EXPECT_TRUE(contains(said, "sensor is connected")) << said;
  EXPECT_TRUE(contains(said, "load = \"locked\"")) << said;
}

}  // namespace
}  // namespace flexspline::cli_test::locked_output_test
