// compare --baseline: black boxes next to the model, as a user asks for them.
#include <gtest/gtest.h>

#include "tests/cli/fitted_demo.hpp"

namespace flexspline::cli_test::black_boxes_test {
namespace {

class BlackBoxes : public FittedDemo {};

TEST_F(BlackBoxes, EachBlackBoxHasARowForEachSignalAndStandsFarAboveTheModel) {
  const nlohmann::json found =
      shell_->json("flexspline compare --model fitted.toml demo-out --baseline fir:20 --baseline arx:4,4,1");
  std::size_t firs = 0, arxs = 0;
  for (const nlohmann::json& b : found["beside"]) {
    expect_fields(b, {"asked",      "black_box",          "signal",        "unit",     "load",
                      "inputs",     "parameters",         "sample_s",      "samples",  "rmse",
                      "nrmse",      "fit_percent",        "rmse_one_step", "rmse_fit", "rmse_holdout",
                      "model_rmse", "model_rmse_holdout", "largest_pole",  "stable",   "experiments"});
    firs += b["black_box"] == "fir:20" ? 1 : 0;
    arxs += b["black_box"] == "arx:4,4,1" ? 1 : 0;
    EXPECT_EQ(b["rmse"].is_null(), !b["stable"].get<bool>());
    if (b["stable"].get<bool>()) {
      EXPECT_GT(b["rmse_holdout"].get<double>(), 3.0 * b["model_rmse_holdout"].get<double>()) << b;
    }
  }
  EXPECT_EQ(firs, 7u);  // three balances; velocity and torque, free and locked
  EXPECT_EQ(arxs, 7u);
  EXPECT_EQ(found["beside"][0]["signal"], "motor_balance");
  EXPECT_EQ(found["beside"][0]["parameters"], 41);
}

TEST_F(BlackBoxes, TheTableNamesThemAfterTheModel) {
  const std::string line =
      "flexspline compare --model fitted.toml demo-out/free-sine-1hz.csv demo-out/free-trapezoid.csv";
  const std::string text = shell_->must(line + " --baseline arx:auto");
  const auto heading = text.find("Baseline comparison");
  ASSERT_NE(heading, std::string::npos) << text;
  EXPECT_LT(text.find("all together"), heading);
  EXPECT_NE(text.find("arx:", heading), std::string::npos);
  EXPECT_FALSE(contains(shell_->must(line), "Baseline comparison"));
}

TEST_F(BlackBoxes, ThoseHeldOutAreNotFitted) {
  const std::string line =
      "flexspline compare --model fitted.toml demo-out/free-sine-1hz.csv demo-out/free-trapezoid.csv --baseline fir:3";
  const nlohmann::json both = shell_->json(line)["beside"][0];
  const nlohmann::json one = shell_->json(line + " --holdout demo-out/free-trapezoid.csv")["beside"][0];
  EXPECT_TRUE(both["rmse_holdout"].is_null());
  EXPECT_EQ(one["experiments"][1]["name"], "free-trapezoid");
  EXPECT_EQ(one["experiments"][1]["role"], "holdout");
  EXPECT_EQ(one["experiments"][1]["rmse"], one["rmse_holdout"]);
  // What is not fitted is met worse, what is fitted alone is met better.
  EXPECT_GT(one["rmse_holdout"].get<double>(), both["experiments"][1]["rmse"].get<double>());
  EXPECT_LT(one["rmse_fit"].get<double>(), both["experiments"][0]["rmse"].get<double>());
}

TEST_F(BlackBoxes, AWrongSpecificationIsQuotedBeforeAnythingIsRead) {
  for (const char* text : {"arma:2,2", "fir:0", "fir:many", "arx:4", "arx:4,4,0", "fir"}) {
    const Answer answer =
        shell_->run(std::string("flexspline compare --model nowhere.toml nowhere.csv --baseline ") + text);
    EXPECT_EQ(answer.code, 2) << text;
    EXPECT_TRUE(answer.out.empty()) << answer.out;
    EXPECT_TRUE(contains(answer.err, std::string("flexspline compare: --baseline ") + text)) << answer.err;
    EXPECT_TRUE(contains(answer.err, "arx:4,4,1")) << answer.err;
  }
}

}  // namespace
}  // namespace flexspline::cli_test::black_boxes_test
