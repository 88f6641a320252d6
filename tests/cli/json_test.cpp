// --json: valid, with the fields of the contract, and alone on standard output.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::json_test {
namespace {

void expect_parameter(const nlohmann::json& p) {
  expect_fields(p, {"id", "effect", "parameter", "value", "unit", "std", "interval"});
  ASSERT_TRUE(p["interval"].is_array());
  EXPECT_EQ(p["interval"].size(), 2u);
}

TEST(Json, EffectsGivesTheCatalogue) {
  const Shell shell;
  const nlohmann::json all = shell.json("flexspline effects");
  EXPECT_EQ(all["format"], "flexspline-effects/1");
  ASSERT_GE(all["effects"].size(), 20u);
  for (const nlohmann::json& e : all["effects"]) {
    expect_fields(
        e, {"name", "balance", "phase", "equation", "parameters", "shows_over", "source", "explanation", "rivals"});
    EXPECT_GT(e["explanation"].get<std::string>().size(), 20u);
    for (const nlohmann::json& p : e["parameters"]) expect_fields(p, {"parameter", "unit", "kind", "usual"});
  }
  const nlohmann::json one = shell.json("flexspline effects backlash");
  ASSERT_EQ(one["effects"].size(), 1u);
  EXPECT_EQ(one["effects"][0]["name"], "backlash");
}

TEST(Json, IdentifyGivesEstimatesNearTheTruth) {
  const Shell shell;
  shell.record();
  const nlohmann::json found = shell.json("flexspline identify demo-out --model demo-out/base-model.toml");
  EXPECT_EQ(found["format"], "flexspline-identify/1");
  expect_fields(found, {"method", "cutoff_hz", "parameters", "derived", "condition_number", "warnings"});
  bool has_stiffness = false;
  for (const nlohmann::json& p : found["parameters"]) {
    expect_parameter(p);
    expect_fields(p, {"average", "spread_percent", "reliable", "identifiable", "per_experiment"});
    if (p["id"] != "linear_stiffness") continue;
    has_stiffness = true;
    EXPECT_EQ(p["unit"], "N*m/rad");
    EXPECT_NEAR(p["value"].get<double>(), 6300.0, 63.0);  // the plant's, see hil/plant/demo-drive.toml
  }
  EXPECT_TRUE(has_stiffness);
}

TEST(Json, CompareGivesEverySignalOfEveryExperiment) {
  const Shell shell;
  shell.record_and_identify();
  const nlohmann::json found = shell.json("flexspline compare --model fitted.toml demo-out");
  EXPECT_EQ(found["format"], "flexspline-compare/1");
  expect_fields(found, {"experiments", "overall", "regions", "parameter_trends"});
  EXPECT_EQ(found["experiments"].size(), 16u);
  for (const nlohmann::json& e : found["experiments"]) {
    expect_fields(e, {"name", "role", "signals"});
    for (const nlohmann::json& s : e["signals"])
      expect_fields(s, {"signal", "unit", "samples", "masked", "rmse", "nrmse", "fit_percent", "vaf_percent", "max_abs",
                        "worst_case_gain", "noise_floor", "noise_floor_from", "collapsed"});
  }
  for (const nlohmann::json& r : found["regions"])
    expect_fields(r, {"signal", "variable", "low", "high", "samples", "bias", "rmse", "excess"});
}

TEST(Json, DiagnoseNamesWhatIsHidden) {
  const Shell shell;
  shell.record("viscous_asymmetry");
  const Answer answer = shell.run("flexspline diagnose --model demo-out/base-model.toml demo-out --json found.json");
  ASSERT_EQ(answer.code, 0) << answer.err;
  EXPECT_FALSE(contains(answer.out, "\x1b")) << "escape codes away from a terminal";
  EXPECT_FALSE(contains(answer.err, "\x1b"));
  const nlohmann::json found = nlohmann::json::parse(shell.file("found.json"));
  EXPECT_EQ(found["format"], "flexspline-diagnose/1");
  expect_fields(found, {"verdict", "named", "balance", "base", "localised", "candidates", "parameter_trends",
                        "friction_drift", "recovered_percent", "remaining_structure", "disturbances", "rounds"});
  expect_fields(found["base"], {"rmse", "rmse_cv", "noise_floor", "noise_floor_from"});
  EXPECT_EQ(found["verdict"], "missing_effect");
  ASSERT_EQ(found["named"].size(), 1u);
  EXPECT_EQ(found["named"][0]["effect"], "viscous_asymmetry");
  EXPECT_TRUE(found["named"][0]["order"].is_null());
  ASSERT_FALSE(found["candidates"].empty());
  for (const nlohmann::json& c : found["candidates"]) {
    expect_fields(c, {"effect", "order", "balance", "rank", "score", "chi2_fall_percent", "rmse_cv_before",
                      "rmse_cv_after", "p_value", "parameters", "minimum_detectable", "admissible", "rivals",
                      "separating_experiment", "explanation"});
    for (const nlohmann::json& p : c["parameters"]) expect_parameter(p);
  }
  EXPECT_EQ(found["candidates"][0]["rank"], 1);
}

TEST(Json, AutoDiagnosisGivesARoundForEachEffectAdded) {
  const Shell shell;
  shell.record("viscous_asymmetry");
  const nlohmann::json found = shell.json(
      "flexspline diagnose --auto --model demo-out/base-model.toml demo-out/free-sine-1hz.csv "
      "demo-out/locked-sine-0.5hz.csv demo-out/rest.csv");
  ASSERT_GE(found["rounds"].size(), 2u);
  ASSERT_GE(found["named"].size(), 1u);
  EXPECT_EQ(found["named"][0]["effect"], "viscous_asymmetry");
  EXPECT_NE(found["rounds"].back()["verdict"], "missing_effect");
}

TEST(Json, AddAndRemoveGiveErrorsBeforeAndAfter) {
  const Shell shell;
  shell.record("viscous_asymmetry");
  const nlohmann::json more =
      shell.json("flexspline add viscous_asymmetry --model demo-out/base-model.toml demo-out --out more.toml");
  EXPECT_EQ(more["format"], "flexspline-add/1");
  expect_fields(more, {"effect", "signal", "before", "after", "noise_floor", "parameters"});
  EXPECT_LT(more["after"]["rmse_holdout"].get<double>(), 0.8 * more["before"]["rmse_holdout"].get<double>());
  for (const nlohmann::json& p : more["parameters"]) expect_parameter(p);
  EXPECT_TRUE(contains(shell.file("more.toml"), "viscous_asymmetry"));

  const nlohmann::json less =
      shell.json("flexspline remove viscous_asymmetry --model more.toml demo-out --out less.toml");
  EXPECT_EQ(less["format"], "flexspline-add/1");
  EXPECT_GT(less["after"]["rmse_fit"].get<double>(), less["before"]["rmse_fit"].get<double>());
}

TEST(Json, CheckNewAndSimulateGiveTheirs) {
  const Shell shell;
  shell.record();
  EXPECT_EQ(shell.json("flexspline check demo-out")["experiments"].size(), 16u);
  EXPECT_EQ(shell.json("flexspline new --from demo-out --out project")["format"], "flexspline-new/1");
  shell.must("flexspline identify project --model project/base-model.toml --out fitted.toml");
  EXPECT_EQ(shell.json("flexspline simulate --model fitted.toml project --out sim")["experiments"].size(), 16u);
}

TEST(Json, AFileGetsTheSameAsStandardOutput) {
  const Shell shell;
  const std::string direct = shell.must("flexspline effects --json -");
  const std::string said = shell.must("flexspline effects --json answer.json");
  EXPECT_EQ(shell.file("answer.json"), direct);
  EXPECT_TRUE(contains(said, "stribeck_gaussian"));  // people are answered, too
  const Answer refused = shell.run("flexspline effects --json no/such/folder/answer.json");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "no/such/folder/answer.json")) << refused.err;
}

}  // namespace
}  // namespace flexspline::cli_test::json_test
