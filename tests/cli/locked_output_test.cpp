// Where an output does not move, the warning says how to state that it is locked; new and plan take it so.
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

// A motor that turns against the spring of its gear.
std::string locked_log(const std::string& effort) {
  const Signal spring = [](double t) { return 20.0 * angle(t); };
  const Signal motor = [](double t) { return torque(t) + 0.4 * angle(t); };
  return log_of("time_s,motor_position_rad,torque_nm," + effort, {time_in(1.0), angle, spring, motor});
}

TEST(LockedOutput, IsStatedToNewByAnOptionAndSaidToBeTakenSo) {
  const Shell shell;
  shell.write("log.csv", locked_log("motor_torque_nm"));
  const std::string said = shell.must("flexspline new --from log.csv --out project --gear-ratio 50 --load locked");
  EXPECT_TRUE(contains(said, "the output is locked in all recordings, as stated")) << said;
  EXPECT_TRUE(contains(shell.file("project/dataset.toml"), "load = \"locked\""));
  for (const nlohmann::json& e : shell.json("flexspline check project")["experiments"]) EXPECT_EQ(e["load"], "locked");
  shell.must("flexspline new --force --from log.csv --out project --gear-ratio 50");
  for (const nlohmann::json& e : shell.json("flexspline check project")["experiments"]) EXPECT_EQ(e["load"], "free");
  const Answer wrong = shell.run("flexspline new --force --from log.csv --out project --load fixed");
  EXPECT_EQ(wrong.code, 2);
  EXPECT_TRUE(contains(wrong.err, "locked")) << wrong.err;
}

TEST(LockedOutput, OfAllRecordingsLeavesThePlanMotionsOfALockedOutputInTheUnitOfTheEffort) {
  const Shell shell;
  shell.write("log.csv", locked_log("motor_torque_nm"));
  shell.must("flexspline new --from log.csv --out project --gear-ratio 50 --load locked");
  const std::string plan =
      "flexspline plan project --model project/base-model.toml --velocity-rad-s 20 --run-s 2 --out ";
  const std::string said = shell.must(plan + "plan.toml --json found.json");
  const nlohmann::json found = nlohmann::json::parse(shell.file("found.json"));
  EXPECT_TRUE(contains(said, "All recordings have a locked output")) << said;
  EXPECT_TRUE(contains(said, "--with free")) << said;
  EXPECT_FALSE(contains(said, " A ")) << said;
  for (const nlohmann::json& run : found["runs"]) {
    EXPECT_TRUE(run["load"] == "locked" || run["mode"] == "off") << run;
    EXPECT_TRUE(run["temperature_c"].is_null()) << run;
    EXPECT_EQ(run["effort_unit"], "N*m");
    EXPECT_TRUE(run["peak_current_a"].is_null());
    if (run["mode"] == "current") {
      EXPECT_EQ(run["unit"], "N*m");
    }
  }
  const Answer both = shell.run(plan + "plan.toml --with free --without free");
  EXPECT_EQ(both.code, 2);
  EXPECT_TRUE(contains(both.err, "contradict")) << both.err;
}

}  // namespace
}  // namespace flexspline::cli_test::locked_output_test
