// --help, its examples, commands that do not exist.
#include <gtest/gtest.h>

#include <map>
#include <sstream>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::help_test {
namespace {

constexpr const char* kBuilt[] = {
#define COMMAND(name) #name,
#include "host/app/cli/command_list.inc"
#undef COMMAND
};

std::vector<std::string> example_lines(const std::string& help) {
  std::vector<std::string> lines;
  std::istringstream text(help);
  bool in_example = false;
  for (std::string line; std::getline(text, line);) {
    if (line == "Example:")
      in_example = true;
    else if (in_example && line.starts_with("  "))
      lines.push_back(line.substr(2));
  }
  return lines;
}

// Most examples begin with the same recording and its fit, which leave nothing but files: made once, and copied.
bool is_preparation(const std::string& line) {
  return line.starts_with("flexspline-hil record ") || line.starts_with("flexspline identify ");
}
// Runs the first `count` lines in an empty folder.
void run_lines(const Shell& shell, const std::vector<std::string>& lines, std::size_t count) {
  static std::map<std::string, Shell> prepared;
  std::size_t alike = 0;
  std::string key;
  for (; alike + 1 < count && is_preparation(lines[alike]); ++alike) key += lines[alike] + "\n";
  if (alike > 0) {
    const auto [before, is_new] = prepared.try_emplace(key);
    if (is_new) run_lines(before->second, lines, alike);
    fs::copy(before->second.folder(), shell.folder(), fs::copy_options::recursive);
  }
  for (; alike < count; ++alike) EXPECT_FALSE(shell.must(lines[alike]).empty()) << lines[alike];
}

class EachCommand : public testing::TestWithParam<const char*> {};

TEST_P(EachCommand, ExplainsItself) {
  const Shell shell;
  const Answer answer = shell.run(std::string("flexspline ") + GetParam() + " --help");
  EXPECT_EQ(answer.code, 0);
  EXPECT_TRUE(answer.err.empty()) << answer.err;
  EXPECT_TRUE(contains(answer.out, "--json"));
  EXPECT_GT(answer.out.size(), 300u);
}

TEST_P(EachCommand, HasAnExampleThatWorks) {
  const Shell shell;
  const std::vector<std::string> lines = example_lines(shell.must(std::string("flexspline ") + GetParam() + " --help"));
  ASSERT_FALSE(lines.empty());
  EXPECT_TRUE(lines.back().starts_with(std::string("flexspline ") + GetParam())) << lines.back();
  // All that demo does takes longest: its example is run by report_test.cpp.
  if (std::string(GetParam()) != "demo") run_lines(shell, lines, lines.size());
}

TEST_P(EachCommand, RefusesAnOptionThatItDoesNotHave) {
  const Shell shell;
  const Answer answer = shell.run(std::string("flexspline ") + GetParam() + " --no-such-option");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, std::string("flexspline ") + GetParam() + ": ")) << answer.err;
  EXPECT_TRUE(answer.out.empty());
}

INSTANTIATE_TEST_SUITE_P(Commands, EachCommand, testing::ValuesIn(kBuilt),
                         [](const auto& test) { return std::string(test.param); });

TEST(Help, ListsTheCommands) {
  const Shell shell;
  const std::string help = shell.must("flexspline --help");
  for (const char* name : kBuilt) EXPECT_TRUE(contains(help, std::string("\n  ") + name)) << name;
}

TEST(Help, AWrongCommandNamesTheNearestOne) {
  const Shell shell;
  const Answer answer = shell.run("flexspline identfy");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "did you mean identify?")) << answer.err;
  const Answer transposed = shell.run("flexspline plna");
  EXPECT_TRUE(contains(transposed.err, "did you mean plan?")) << transposed.err;
  EXPECT_EQ(shell.run("flexspline").code, 2);
}

}  // namespace
}  // namespace flexspline::cli_test::help_test
