// What is typed nearly right is understood, or answered with what was meant.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::typing_test {
namespace {

std::size_t longest_line(const std::string& text) {
  std::istringstream lines(text);
  std::size_t longest = 0;
  for (std::string line; std::getline(lines, line);) {
    // Commands to copy stay on one line.
    if (line.starts_with("  flexspline")) continue;
    const auto width = std::count_if(line.begin(), line.end(), [](char c) { return (c & 0xC0) != 0x80; });
    longest = std::max(longest, static_cast<std::size_t>(width));
  }
  return longest;
}

TEST(Typing, HelpIsACommandToo) {
  const Shell shell;
  EXPECT_EQ(shell.must("flexspline help"), shell.must("flexspline --help"));
  EXPECT_EQ(shell.must("flexspline help identify"), shell.must("flexspline identify --help"));
}

TEST(Typing, AMisspeltOptionNamesTheOneThatWasMeant) {
  const Shell shell;
  shell.write("data.csv", "time_s,current_a\n0,1\n");
  for (const auto& [line, meant] :
       {std::pair{"flexspline identify data.csv --modle model.toml", "did you mean --model?"},
        {"flexspline compare data.csv --modell=model.toml", "did you mean --model?"},
        {"flexspline check data.csv --tolerat jitter", "did you mean --tolerate?"}}) {
    const Answer answer = shell.run(line);
    EXPECT_EQ(answer.code, 2);
    EXPECT_TRUE(contains(answer.err, meant)) << answer.err;
  }
}

TEST(Typing, ACommandByTheWordOfAnotherToolNamesOurs) {
  const Shell shell;
  for (const auto& [word, ours] : {std::pair{"explain dahl_friction", "effects"}, {"fit data.csv", "identify"}}) {
    const Answer answer = shell.run(std::string("flexspline ") + word);
    EXPECT_EQ(answer.code, 2);
    EXPECT_TRUE(contains(answer.err, std::string("did you mean ") + ours + "?")) << answer.err;
  }
}

TEST(Typing, AValueThatCannotBeReadIsAnsweredWithWhatTheOptionTakes) {
  const Shell shell;
  shell.write("data.csv", "time_s,current_a\n0,1\n");
  for (const auto& [line, answered] :
       {std::pair{"flexspline identify data.csv --model model.toml --cutoff-hz 5kHz",
                  "--cutoff-hz takes a number without a unit, and \"5kHz\" was given"},
        {"flexspline demo --seed 0.5", "--seed takes a whole number without a unit, and \"0.5\" was given"}}) {
    const Answer answer = shell.run(line);
    EXPECT_EQ(answer.code, 2);
    EXPECT_TRUE(contains(answer.err, answered)) << answer.err;
  }
}

TEST(Typing, AMisspeltEffectNamesTheOneThatWasMeant) {
  const Shell shell;
  shell.write("model.toml", "format = \"flexspline-model/1\"\n[[effect]]\ntype = \"inertia\"\n");
  shell.write("data.csv", "time_s,current_a\n0,1\n");
  for (const std::string line :
       {"flexspline effects stribek", "flexspline add stribek --model model.toml data.csv --out new.toml"}) {
    const Answer answer = shell.run(line);
    EXPECT_EQ(answer.code, 2);
    EXPECT_TRUE(contains(answer.err, "did you mean stribeck_")) << answer.err;
  }
}

TEST(Typing, SeveralKindsMayFollowOneTolerate) {
  const Shell shell;
  std::string text = "time_s,current_a\n";
  for (int k = 0; k < 200; ++k)
    text += std::to_string(0.001 * k) + (k == 50   ? ",nan\n"
                                         : k == 80 ? ",1,2,3\n"
                                                   : "," + std::to_string(k % 5) + "\n");
  shell.write("data.csv", text);
  EXPECT_EQ(shell.run("flexspline check data.csv").code, 2);
  shell.must("flexspline check data.csv --tolerate not_finite row_length");
  shell.must("flexspline check --tolerate not_finite row_length data.csv");
  shell.must("flexspline check --tolerate not_finite,row_length data.csv");
  shell.must("flexspline check --tolerate not_finite --tolerate row_length data.csv");
}

TEST(Typing, TheCatalogueAndTheHelpKeepToTheWidthOfTheTerminal) {
  const Shell shell;
  for (const std::string columns : {"80", "110"})
    for (const std::string line : {"effects", "--help", "identify --help", "flash --help", "new --help"}) {
      const std::string text = shell.must("COLUMNS=" + columns + " flexspline " + line);
      EXPECT_LE(longest_line(text), std::stoul(columns)) << line << "\n" << text;
    }
  EXPECT_LE(longest_line(shell.must("flexspline effects")), 110u);
}

}  // namespace
}  // namespace flexspline::cli_test::typing_test
