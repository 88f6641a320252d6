// plan, and the twin that records what is planned.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::plan_test {
namespace {

constexpr const char* kFit = "flexspline identify demo-out --model demo-out/base-model.toml --out fitted.toml";

TEST(PlanCommand, DesignsARecordingThatTheTwinMakes) {
  const Shell shell;
  shell.record("viscous_asymmetry");
  shell.must(kFit);
  const nlohmann::json found =
      shell.json("flexspline plan --separate current_offset,torque_bias --model fitted.toml --run-s 4 --out plan.toml");
  EXPECT_EQ(found["format"], "flexspline-plan-answer/1");
  EXPECT_TRUE(found["separable"].is_boolean());
  const nlohmann::json open = shell.json("flexspline plan --model fitted.toml --run-s 4 --out open.toml");
  ASSERT_FALSE(open["runs"].empty());
  ASSERT_FALSE(open["parameters"].empty());
  EXPECT_TRUE(open["parameters"][0]["percent_before"].is_null());
  shell.must("flexspline-hil record --plan open.toml --out more");
  for (const nlohmann::json& run : open["runs"])
    EXPECT_TRUE(fs::exists(shell.folder() / "more" / (run["name"].get<std::string>() + ".csv")));
  // What was planned can be identified together with what was there.
  shell.must("flexspline identify demo-out more --model demo-out/base-model.toml --out both.toml");
}

TEST(PlanCommand, SaysWhatItNeeds) {
  const Shell shell;
  shell.record("viscous_asymmetry");
  const Answer blank = shell.run("flexspline plan --model demo-out/base-model.toml --out plan.toml");
  EXPECT_EQ(blank.code, 2);
  EXPECT_TRUE(contains(blank.err, "without a value")) << blank.err;
  shell.must(kFit);
  const Answer unknown = shell.run("flexspline plan --separate gravity,gravy --model fitted.toml --out plan.toml");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "gravy")) << unknown.err;
  const Answer bad = shell.run("flexspline-hil record --plan fitted.toml --out more");
  EXPECT_EQ(bad.code, 2);
  EXPECT_TRUE(contains(bad.err, "flexspline-plan/1")) << bad.err;
}

}  // namespace
}  // namespace flexspline::cli_test::plan_test
