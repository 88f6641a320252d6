// Few samples, fast samples and large models: an answer or a refusal, within bounds of time and memory.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::few_samples_test {
namespace {

constexpr const char* kModel =
    "format = \"flexspline-model/1\"\n[drive]\ntorque_constant_nm_a = 0.05\nrated_current_a = 2\n"
    "rated_velocity_rad_s = 200\n[[effect]]\ntype = \"inertia\"\n[effect.parameters]\ninertia = { value = 1e-4 }\n"
    "[[effect]]\ntype = \"viscous_friction\"\n[effect.parameters]\ncoefficient = { value = 1e-3 }\n";
// Of time and memory (KiB), for a machine on which much else runs.
constexpr const char* kBounds = "ulimit -v 4000000; timeout 60 ";

std::string log_of(int count, double sample_s) {
  std::string text = "time_s,current_a,motor_position_rad\n";
  for (int k = 0; k < count; ++k) {
    const double t = k * sample_s, turn = 30.0 / (count * sample_s);
    char line[120];
    std::snprintf(line, sizeof line, "%.9g,%.9g,%.9g\n", t, std::cos(turn * t) + 0.01 * ((k * 37) % 11),
                  std::sin(turn * t));
    text += line;
  }
  return text;
}

void expect_an_end(const Shell& shell, const std::string& line) {
  const Answer answer = shell.run(kBounds + line);
  EXPECT_TRUE(answer.code == 0 || answer.code == 2) << answer.code << ": " << line << "\n" << answer.err;
  EXPECT_FALSE(contains(answer.err, "bad_alloc")) << answer.err;
}

TEST(FewSamples, ABootstrapOfThemTakesLittleMemory) {
  const Shell shell;
  shell.write("model.toml", kModel);
  for (const int count : {33, 36, 40, 48, 64}) {
    shell.write("data.csv", log_of(count, 1e-3));
    expect_an_end(shell, "flexspline identify data.csv --model model.toml --intervals bootstrap");
  }
}

TEST(FewSamples, ARecordWithoutMotionIsDiagnosed) {
  const Shell shell;
  shell.write("model.toml", kModel);
  std::string text = "time_s,current_a,motor_position_rad\n";
  for (int k = 0; k < 500; ++k) text += std::to_string(0.001 * k) + ",0.0,0.0\n";
  shell.write("rest.csv", text);
  expect_an_end(shell, "flexspline diagnose rest.csv --model model.toml");
}

TEST(FastSamples, APlanIsForARateThatAMotionNeeds) {
  const Shell shell;
  shell.write("model.toml", kModel);
  shell.write("data.csv", log_of(200, 1e-6));
  const std::string plan = "flexspline plan --model model.toml data.csv --out plan.toml --motions 1 --run-s 2";
  const Answer answer = shell.run(kBounds + plan);
  EXPECT_EQ(answer.code, 0) << answer.err;
  EXPECT_TRUE(contains(answer.err, "20000")) << answer.err;
  EXPECT_TRUE(contains(shell.file("plan.toml"), "sample_s = 5e-5\n")) << shell.file("plan.toml");
  const Answer refused = shell.run(kBounds + plan + " --sample-hz 1e6");
  EXPECT_EQ(refused.code, 2);
  EXPECT_TRUE(contains(refused.err, "--sample-hz")) << refused.err;
}

TEST(LargeModels, CommandsThatSearchRefuseAModelOf300Ripples) {
  const Shell shell;
  std::string text = kModel;
  for (int k = 1; k <= 300; ++k)
    text += "[[effect]]\ntype = \"torque_ripple\"\nid = \"r" + std::to_string(k) +
            "\"\n[effect.parameters]\norder = { value = " + std::to_string(k) +
            " }\ncosine = { value = 1e-5 }\nsine = { value = 0.0 }\n";
  shell.write("model.toml", text);
  shell.write("data.csv", log_of(2000, 1e-3));
  for (const std::string command : {"diagnose", "add stribeck_gaussian --out added.toml", "remove r7 --out less.toml",
                                    "plan --out plan.toml", "sensitivity", "sensitivity --refit"}) {
    const Answer answer = shell.run(kBounds + ("flexspline " + command) + " --model model.toml data.csv");
    EXPECT_EQ(answer.code, 2) << command << "\n" << answer.err;
    EXPECT_TRUE(contains(answer.err, "602 parameters")) << answer.err;
  }
}

}  // namespace
}  // namespace flexspline::cli_test::few_samples_test
