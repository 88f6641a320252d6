// What a reader is told of a plan that has no recordings.
#include "host/output/answers/plan.hpp"

#include <gtest/gtest.h>

#include <cstdio>

namespace flexspline::output::output_plan_test {
namespace {

std::string printed(double percent) {
  planning::Design design;
  design.parameters.push_back({"torque_bias", "torque", "N*m", 0.01, percent, percent});
  ::testing::internal::CaptureStdout();
  {
    Console console("plan", false);
    print_plan(console, design, "plan.toml");
    std::fflush(stdout);
  }
  return ::testing::internal::GetCapturedStdout();
}

TEST(PlanAnswer, CallsParametersKnownWellOnlyBelowOnePercent) {
  EXPECT_NE(printed(0.4).find("known well: relative standard deviations are below 1 %"), std::string::npos);
  EXPECT_EQ(printed(110.0).find("known well"), std::string::npos) << printed(110.0);
  EXPECT_NE(printed(1234.0).find("1234 %"), std::string::npos) << printed(1234.0);
}

}  // namespace
}  // namespace flexspline::output::output_plan_test
