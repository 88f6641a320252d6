// plan, and the twin that records what is planned.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::plan_test {
namespace {

using namespace small_logs;

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
  const Answer same = shell.run("flexspline plan --separate gravity,gravity --model fitted.toml --out plan.toml");
  EXPECT_EQ(same.code, 2);
  EXPECT_TRUE(contains(same.err, "name two")) << same.err;
  const Answer one = shell.run("flexspline plan --separate gravity --model fitted.toml --out plan.toml");
  EXPECT_EQ(one.code, 2);
  EXPECT_TRUE(contains(one.err, "--separate takes 2 values with a comma between them, and 1 was given")) << one.err;
  const Answer bad = shell.run("flexspline-hil record --plan fitted.toml --out more");
  EXPECT_EQ(bad.code, 2);
  EXPECT_TRUE(contains(bad.err, "flexspline-plan/1")) << bad.err;
}

// A model of a drive without temperature effects, in the data of which every record is free.
TEST(PlanCommand, SaysWhatItAssumesAndProposesNoTemperaturesForAModelWithoutThem) {
  const Shell shell;
  shell.record("viscous_asymmetry");
  shell.must(kFit);
  const std::string plan = "flexspline plan --model fitted.toml --run-s 4 --motions 8 --out plan.toml";
  const nlohmann::json found = shell.json(plan + " --temperatures 20,60");
  bool locked = false;
  for (const nlohmann::json& run : found["runs"]) {
    locked = locked || run["load"] == "locked";
    EXPECT_TRUE(run["temperature_c"].is_null()) << run;
  }
  const std::string notes = found["notes"].dump();
  EXPECT_TRUE(contains(notes, "No effect of the model depends on the temperature")) << notes;
  EXPECT_EQ(contains(notes, "the output can be locked (--without locked)"), locked) << notes;
  EXPECT_FALSE(contains(shell.json(plan + " --with locked,free")["notes"].dump(), "the output can")) << notes;
  for (const nlohmann::json& run : shell.json(plan + " --without locked")["runs"]) EXPECT_EQ(run["load"], "free");
}

// Forces on a linear axis of 95 kg with a peak of friction at slow speed.
std::string linear_log(double a, double b) {
  return log_of("time_s,motor_torque_nm,motor_position_rad,motor_velocity_rad_s",
                {time_in(1.0),
                 [=](double t) {
                   const double v = 0.1 * a * std::cos(a * t) + 0.03 * b * std::cos(b * t);
                   const double acceleration = -0.1 * a * a * std::sin(a * t) - 0.03 * b * b * std::sin(b * t);
                   const double friction = 20.0 + 15.0 * std::exp(-std::pow(v / 0.03, 2.0));
                   return 95.0 * acceleration + 200.0 * v + friction * std::tanh(v / 1e-3);
                 },
                 [=](double t) { return 0.1 * std::sin(a * t) + 0.03 * std::sin(b * t); },
                 [=](double t) { return 0.1 * a * std::cos(a * t) + 0.03 * b * std::cos(b * t); }});
}

TEST(LinearAxis, HasForcesInTheTextsOfIdentifyCompareDiagnoseAndPlan) {
  const Shell shell;
  shell.write("logs/z.csv", linear_log(2.0, 5.3));
  shell.write("logs/a.csv", linear_log(1.3, 7.1));
  shell.must("flexspline new --from logs --out project --axis linear");
  const std::string identified =
      shell.must("flexspline identify project --model project/base-model.toml --out fitted.toml");
  const std::string compared = shell.must("flexspline compare --model fitted.toml project");
  const std::string diagnosed = shell.must("flexspline diagnose --model fitted.toml project");
  const std::string planned = shell.must("flexspline plan project --model fitted.toml --run-s 4 --out plan.toml");
  for (const std::string* text : {&identified, &compared, &diagnosed, &planned}) {
    EXPECT_FALSE(contains(*text, "N*m")) << *text;
    EXPECT_FALSE(contains(*text, "N m")) << *text;
    EXPECT_FALSE(contains(*text, " rad")) << *text;
    for (const char* words : {"its torque", "the torque", "no torque", "rated torque", "torque balance"})
      EXPECT_FALSE(contains(*text, words)) << *text;
  }
  EXPECT_TRUE(contains(diagnosed, "The part of its force that the other effects")) << diagnosed;
  EXPECT_TRUE(contains(planned, "peak force")) << planned;
  EXPECT_TRUE(contains(planned, "no force constant is known")) << planned;
  // The experiments are in the order of the data: files of a folder by name.
  EXPECT_LT(compared.find("\na "), compared.find("\nz ")) << compared;
  const Answer far = shell.run("flexspline plan --model fitted.toml --current-a 9 --velocity-rad-s 1 --out plan.toml");
  EXPECT_EQ(far.code, 2);
  EXPECT_TRUE(contains(far.err, "--travel-rad, in m")) << far.err;
}

TEST(PlanCommand, ProposesTwoTemperaturesToDataWithoutThemOnlyWhereTheUserStatesThem) {
  const Shell shell;
  shell.write("logs/z.csv", linear_log(2.0, 5.3));
  shell.must("flexspline new --from logs --out project --axis linear");
  shell.must("flexspline identify project --model project/base-model.toml --out fitted.toml");
  const std::string separate =
      "flexspline plan project --model fitted.toml --run-s 4 --separate temperature_viscous,temperature_coulomb --out "
      "plan.toml";
  const nlohmann::json unheated = shell.json(separate);
  EXPECT_TRUE(contains(unheated["notes"].dump(), "The data have no temperature_c")) << unheated["notes"];
  EXPECT_TRUE(unheated["runs"].empty()) << unheated["runs"];
  const nlohmann::json heated = shell.json(separate + " --temperatures 20,50");
  EXPECT_FALSE(contains(heated["notes"].dump(), "no temperature_c")) << heated["notes"];
  EXPECT_EQ(heated["runs"][0]["temperature_c"], 20.0) << heated["runs"];
}

TEST(CompareCommand, HasExperimentsInTheOrderOfTheData) {
  const Shell shell;
  shell.write("z.csv", linear_log(2.0, 5.3));
  shell.write("a.csv", linear_log(1.3, 7.1));
  shell.must("flexspline new --from z.csv a.csv --out project --axis linear");
  shell.must("flexspline identify project --model project/base-model.toml --out fitted.toml");
  const std::string compared = shell.must("flexspline compare --model fitted.toml project");
  EXPECT_LT(compared.find("\nz "), compared.find("\na ")) << compared;
}

}  // namespace
}  // namespace flexspline::cli_test::plan_test
