// Bad input: exit code 2, and on standard error what is wrong, where, and what to do.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::errors_test {
namespace {

constexpr const char* kModel = "format = \"flexspline-model/1\"\n[[effect]]\ntype = \"inertia\"\n";

std::string records(int count) {
  std::string text = "time_s,current_a,motor_position_rad\n";
  for (int k = 0; k < count; ++k)
    text += std::to_string(k * 0.001) + "," + std::to_string(k % 7) + "," + std::to_string(k * 1e-3) + "\n";
  return text;
}

void expect_refusal(const Shell& shell, const std::string& line, std::initializer_list<const char*> parts) {
  const Answer answer = shell.run(line);
  EXPECT_EQ(answer.code, 2) << line;
  EXPECT_TRUE(answer.out.empty()) << answer.out;
  for (const char* part : parts) EXPECT_TRUE(contains(answer.err, part)) << line << "\n" << answer.err;
}

TEST(BadInput, AMissingFileIsNamed) {
  const Shell shell;
  expect_refusal(shell, "flexspline check nowhere.csv", {"flexspline check: ", "nowhere.csv", "no such file"});
  shell.write("data.csv", records(400));
  expect_refusal(shell, "flexspline identify data.csv --model nowhere.toml", {"flexspline identify: ", "nowhere.toml"});
  expect_refusal(shell, "flexspline new --from nowhere.csv --out project", {"flexspline new: ", "nowhere.csv"});
  EXPECT_FALSE(fs::exists(shell.folder() / "project"));
}

TEST(BadInput, AnEmptyFileIsNamed) {
  const Shell shell;
  shell.write("empty.csv", "");
  shell.write("header.csv", "time_s,current_a,motor_position_rad\n");
  expect_refusal(shell, "flexspline check empty.csv", {"empty.csv", "; "});
  expect_refusal(shell, "flexspline check header.csv", {"header.csv", "; "});
  expect_refusal(shell, "flexspline new --from empty.csv --out project", {"empty.csv", "; "});
  EXPECT_FALSE(fs::exists(shell.folder() / "project"));
}

TEST(BadInput, TextInANumberIsFoundByLineAndColumn) {
  const Shell shell;
  std::string text = records(400);
  text.insert(text.rfind(",", text.size() - 20) + 1, "oops");
  shell.write("data.csv", text);
  expect_refusal(shell, "flexspline check data.csv", {"data.csv:", "column "});
}

TEST(BadInput, AWrongUnitIsFoundByLineAndListsThoseThatFit) {
  const Shell shell;
  shell.write("data/data.csv", records(400));
  shell.write("data/dataset.toml",
              "format = \"flexspline-dataset/1\"\n[columns.current_a]\nsource = \"current_a\"\nunit = \"furlong\"\n");
  expect_refusal(shell, "flexspline check data", {"dataset.toml:2", "current_a", "furlong", "mA"});
  shell.write("plain.csv", records(400));
  expect_refusal(shell, "flexspline new --from plain.csv --out project --map current_a=current_a:furlong",
                 {"--map", "furlong"});
}

TEST(BadInput, AnUnknownEffectNamesTheNearestOne) {
  const Shell shell;
  expect_refusal(shell, "flexspline effects stribek_gaussian", {"stribek_gaussian", "did you mean stribeck_gaussian?"});
  shell.write("data.csv", records(400));
  shell.write("model.toml", "format = \"flexspline-model/1\"\n[[effect]]\ntype = \"inertja\"\n");
  expect_refusal(shell, "flexspline identify data.csv --model model.toml", {"model.toml:3", "inertja", "inertia"});
  shell.write("good.toml", kModel);
  expect_refusal(shell, "flexspline add stribek_gaussian --model good.toml data.csv --out new.toml",
                 {"stribek_gaussian"});
  EXPECT_FALSE(fs::exists(shell.folder() / "new.toml"));
}

TEST(BadInput, AModelWithoutValuesCannotBeCompared) {
  const Shell shell;
  shell.record();
  expect_refusal(shell, "flexspline compare --model demo-out/base-model.toml demo-out", {"inertia", "identify"});
  expect_refusal(shell, "flexspline simulate --model demo-out/base-model.toml demo-out --out sim", {"inertia"});
  EXPECT_FALSE(fs::exists(shell.folder() / "sim"));
}

TEST(BadInput, ArgumentsThatAreMissingOrWrongAreNamed) {
  const Shell shell;
  shell.write("model.toml", kModel);
  shell.write("data.csv", records(400));
  expect_refusal(shell, "flexspline identify --model model.toml", {"flexspline identify: ", "DATA"});
  expect_refusal(shell, "flexspline identify data.csv", {"--model"});
  expect_refusal(shell, "flexspline check data.csv --mask some", {"--mask"});
  expect_refusal(shell, "flexspline check data.csv --tolerate everything", {"everything"});
  expect_refusal(shell, "flexspline compare --model model.toml data.csv --limit friction=1",
                 {"friction", "motor_balance"});
  expect_refusal(shell, "flexspline identify data.csv --model model.toml --method best", {"best", "partitioned"});
  expect_refusal(shell, "flexspline new --from data.csv --out project --map speed=current_a",
                 {"speed", "motor_velocity_rad_s"});
}

TEST(BadInput, ANumberWithACommaIsRefusedAndItIsSaidHowToWriteIt) {
  const Shell shell;
  const Answer answer = shell.run("flexspline new --from log.csv --out project --gear-ratio 1,000");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "\"1,000\" is not a number above zero; write it without a comma, as 1000 or 0.05"))
      << answer.err;
}

TEST(BadInput, AFolderThatIsInTheWayIsNotWrittenOver) {
  const Shell shell;
  shell.record();
  shell.must("flexspline new --from demo-out --out project");
  const std::string before = shell.file("project/base-model.toml");
  expect_refusal(shell, "flexspline new --from demo-out --out project", {"--force"});
  EXPECT_EQ(shell.file("project/base-model.toml"), before);
  shell.must("flexspline new --from demo-out --out project --force");
}

TEST(BadInput, OptionsOfAUserDefinedEffectAreRefusedForOneOfTheCatalogue) {
  const Shell shell;
  shell.write("model.toml", kModel);
  shell.write("data.csv", records(400));
  for (const char* const option : {"--formula", "--parameter", "--points", "--balance"}) {
    const std::string value = option == std::string_view("--points") ? " 7 " : " a:b ";
    expect_refusal(
        shell, "flexspline add viscous_asymmetry " + (option + value) + "--model model.toml data.csv --out new.toml",
        {option, "viscous_asymmetry", "table_effect"});
  }
  EXPECT_FALSE(fs::exists(shell.folder() / "new.toml"));
}

TEST(BadInput, HeldOutDataOfAnotherAxisAreRefused) {
  const Shell shell;
  shell.write("model.toml", kModel);
  shell.write("data.csv", "# axis: rotary\n" + records(400));
  shell.write("held.csv", "# axis: linear\n" + records(400));
  expect_refusal(shell, "flexspline identify data.csv --model model.toml --holdout held.csv",
                 {"axis is rotary in the data and linear in those held out"});
}

}  // namespace
}  // namespace flexspline::cli_test::errors_test
