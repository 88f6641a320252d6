// sensitivity as a user runs it: what it says, its JSON, and arguments that cannot be meant.
#include <gtest/gtest.h>

#include "tests/cli/fitted_demo.hpp"

namespace flexspline::cli_test::sensitivity_test {
namespace {

// A short free and a short locked motion are enough.
constexpr const char* kLine =
    "flexspline sensitivity --model fitted.toml demo-out/free-sine-2hz-warm.csv demo-out/locked-sine-1hz-warm.csv";

class SensitivityCommand : public FittedDemo {
 protected:
  static const nlohmann::json& variant(const nlohmann::json& answer, const std::string& label) {
    for (const nlohmann::json& v : answer["variants"])
      if (v["label"] == label) return v;
    throw std::runtime_error("no variant " + label);
  }
  static const nlohmann::json& overall(const nlohmann::json& v, const std::string& signal, const nlohmann::json& load) {
    for (const nlohmann::json& s : v["overall"])
      if (s["signal"] == signal && s["load"] == load) return s;
    throw std::runtime_error("no signal " + signal);
  }
};

TEST_F(SensitivityCommand, JudgesEachEffectLeftOutAndEachScalingWorstFirst) {
  const nlohmann::json answer = shell_->json(std::string(kLine) + " --scale viscous_friction.coefficient=1.5");
  expect_fields(answer, {"format", "refit", "cutoff_hz", "full", "variants", "warnings"});
  EXPECT_EQ(answer["format"], "flexspline-sensitivity/1");
  // Ten effects, a stiffness in two ways, and what was asked for.
  ASSERT_EQ(answer["variants"].size(), 13u);
  double before = 1e9;
  for (const nlohmann::json& v : answer["variants"]) {
    expect_fields(v, {"label", "change", "effect", "parameter", "factor", "also_left_out", "growth", "overall",
                      "experiments", "note"});
    EXPECT_LE(v["growth"].get<double>(), before) << v["label"];
    before = v["growth"];
    ASSERT_EQ(v["experiments"].size(), 2u);
    for (const nlohmann::json& s : v["overall"])
      expect_fields(s, {"signal", "load", "unit", "samples", "rmse", "nrmse", "growth", "amplitude_ratio", "phase_deg",
                        "most_in"});
    for (const nlohmann::json& s : v["experiments"][0]["signals"]) expect_fields(s, {"frequency_hz", "lines"});
  }
  const nlohmann::json& scaled = variant(answer, "viscous_friction.coefficient x 1.5");
  EXPECT_EQ(scaled["change"], "scale");
  EXPECT_EQ(scaled["factor"], 1.5);
  EXPECT_EQ(scaled["parameter"], "coefficient");
  // More viscous friction, less motion; none, more.
  EXPECT_LT(overall(scaled, "motor_velocity", "free")["amplitude_ratio"].get<double>(), 0.99);
  const nlohmann::json& without = variant(answer, "without viscous_friction");
  EXPECT_EQ(without["change"], "leave_out");
  EXPECT_GT(overall(without, "motor_velocity", "free")["amplitude_ratio"].get<double>(), 1.01);
  EXPECT_NEAR(without["experiments"][0]["signals"][2]["frequency_hz"].get<double>(), 2.0, 0.01);
  EXPECT_TRUE(contains(variant(answer, "without inertia")["note"].get<std::string>(), "no free run"));
}

TEST_F(SensitivityCommand, TheFullModelHasTheErrorsOfCompare) {
  const nlohmann::json answer = shell_->json(kLine);
  const nlohmann::json compared = shell_->json(
      "flexspline compare --model fitted.toml demo-out/free-sine-2hz-warm.csv demo-out/locked-sine-1hz-warm.csv");
  for (std::size_t e = 0; e < 2; ++e) {
    const nlohmann::json& ours = answer["full"]["experiments"][e]["signals"];
    const nlohmann::json& theirs = compared["experiments"][e]["signals"];
    ASSERT_EQ(ours.size(), theirs.size());
    for (std::size_t s = 0; s < ours.size(); ++s)
      for (const char* field : {"signal", "unit", "samples", "rmse", "nrmse"})
        EXPECT_EQ(ours[s][field], theirs[s][field]) << field;
  }
}

TEST_F(SensitivityCommand, SaysWhatMattersMostInASentenceAndATable) {
  const std::string text = shell_->must(kLine);
  EXPECT_TRUE(contains(text, "leaving out ")) << text;
  EXPECT_TRUE(contains(text, "the full model")) << text;
  EXPECT_TRUE(contains(text, "without coulomb_friction")) << text;
  EXPECT_TRUE(contains(text, "motor velocity, locked")) << text;
  EXPECT_TRUE(contains(text, " deg")) << text;
}

TEST_F(SensitivityCommand, RefittingLeavesWhatTheOthersCannotMakeGood) {
  // Base model and data, no identification before.
  const std::string line = std::string(kLine) + " --refit";
  const nlohmann::json refitted = shell_->json(line), as_it_is = shell_->json(kLine);
  EXPECT_EQ(refitted["refit"], true);
  const auto rmse = [](const nlohmann::json& answer, const char* label) {
    return overall(variant(answer, label), "motor_balance", nullptr)["rmse"].get<double>();
  };
  EXPECT_LT(rmse(refitted, "without coulomb_friction"), 0.9 * rmse(as_it_is, "without coulomb_friction"));
  EXPECT_GT(rmse(refitted, "without coulomb_friction"),
            2.0 * overall(refitted["full"], "motor_balance", nullptr)["rmse"].get<double>());
  // A model without values is fitted first.
  const std::string base =
      "flexspline sensitivity --model demo-out/base-model.toml demo-out/free-sine-2hz-warm.csv "
      "demo-out/locked-sine-1hz-warm.csv";
  EXPECT_EQ(shell_->json(base + " --refit")["variants"].size(), 12u);
  const Answer none = shell_->run(base);
  EXPECT_EQ(none.code, 2);
  EXPECT_TRUE(contains(none.err, "no value for inertia.inertia")) << none.err;
}

TEST_F(SensitivityCommand, AScalingThatCannotBeMeantIsQuoted) {
  for (const char* text : {"viscous_friction", "viscous_friction=2", "viscous_friction.coefficient=much"}) {
    const Answer answer =
        shell_->run(std::string("flexspline sensitivity --model nowhere.toml nowhere.csv --scale ") + text);
    EXPECT_EQ(answer.code, 2) << text;
    EXPECT_TRUE(answer.out.empty()) << answer.out;
    EXPECT_TRUE(contains(answer.err, std::string("--scale ") + text)) << answer.err;
    EXPECT_TRUE(contains(answer.err, "linear_stiffness.stiffness=10")) << answer.err;
  }
  const Answer unknown = shell_->run(std::string(kLine) + " --scale viscous.coefficient=2");
  EXPECT_EQ(unknown.code, 2);
  EXPECT_TRUE(contains(unknown.err, "no effect \"viscous\"; it has inertia")) << unknown.err;
  const Answer outside = shell_->run(std::string(kLine) + " --scale structural_damping.exponent=20");
  EXPECT_EQ(outside.code, 2);
  EXPECT_TRUE(contains(outside.err, "from 0.1 to 1; choose another factor")) << outside.err;
}

}  // namespace
}  // namespace flexspline::cli_test::sensitivity_test
