// Documents to the letter: each command that is marked in one is run, in a clean folder, in its order.
#include <gtest/gtest.h>

#include <algorithm>
#include <sstream>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::documents_test {
namespace {

// A fenced block of a document behind a line "<!-- MARK -->" or "<!-- MARK ARGUMENT -->".
struct Block {
  std::string argument;
  std::string text;
};
std::vector<Block> blocks_of(const std::string& document, const std::string& mark) {
  std::vector<Block> blocks;
  std::istringstream lines(document);
  bool marked = false, inside = false;
  for (std::string line; std::getline(lines, line);) {
    if (inside) {
      if (line == "```")
        inside = false;
      else
        blocks.back().text += line + "\n";
    } else if (line.starts_with("<!-- " + mark)) {
      const std::size_t from = 5 + mark.size();
      std::string argument = line.substr(from, line.find(" -->") - from);
      if (!argument.empty()) argument.erase(0, 1);
      blocks.push_back({argument, {}});
      marked = true;
    } else if (marked && line.starts_with("```")) {
      inside = true;
      marked = false;
    }
  }
  return blocks;
}

std::vector<fs::path> documents() {
  const fs::path root = FLEXSPLINE_SOURCE_DIR;
  std::vector<fs::path> found;
  for (const char* folder : {"shared", "firmware", "boards", "hil", "host", "tests"})
    for (const fs::directory_entry& entry : fs::recursive_directory_iterator(root / folder))
      if (entry.path().extension() == ".md") found.push_back(entry.path());
  for (const fs::directory_entry& entry : fs::directory_iterator(root))
    if (entry.path().extension() == ".md") found.push_back(entry.path());
  std::sort(found.begin(), found.end());
  return found;
}

TEST(Documents, EachMarkedCommandRunsAsItStandsThere) {
  int run = 0;
  for (const fs::path& document : documents()) {
    const std::vector<Block> blocks = blocks_of(content_of(document), "run");
    if (blocks.empty()) continue;
    const Shell shell;
    for (const Block& block : blocks) {
      std::istringstream lines(block.text);
      for (std::string line; std::getline(lines, line); ++run) {
        const Answer answer = shell.run(line);
        EXPECT_EQ(answer.code, 0) << document << ": " << line << "\n" << answer.err;
      }
    }
  }
  EXPECT_GE(run, 12);
}

TEST(Documents, LinksBetweenThemLeadSomewhere) {
  int links = 0;
  for (const fs::path& document : documents()) {
    const std::string text = content_of(document);
    for (std::size_t at = 0; (at = text.find("](", at)) != std::string::npos;) {
      at += 2;
      std::string target = text.substr(at, text.find(')', at) - at);
      target = target.substr(0, target.find('#'));
      if (target.empty() || target.find(':') != std::string::npos || target.find_first_of(" \n`") != std::string::npos)
        continue;
      EXPECT_TRUE(fs::exists(document.parent_path() / target)) << document << ": " << target;
      ++links;
    }
  }
  EXPECT_GT(links, 40);
}

// A new command's answer is described, or this test names its format.
TEST(Documents, EachFormatOfAnAnswerIsInTheListOfAnswers) {
  const fs::path root = FLEXSPLINE_SOURCE_DIR;
  const std::string list = content_of(root / "host/output/answers/JSON.md");
  const std::string mark = "{\"format\", \"";
  int formats = 0;
  for (const char* folder : {"host/app/cli", "host/output/answers"})
    for (const fs::directory_entry& entry : fs::directory_iterator(root / folder)) {
      // What the workbench's page asks for is its own.
      if (entry.path().extension() != ".cpp" || entry.path().filename().string().starts_with("workbench")) continue;
      const std::string source = content_of(entry.path());
      for (std::size_t at = 0; (at = source.find(mark, at)) != std::string::npos; ++formats) {
        at += mark.size();
        const std::string format = source.substr(at, source.find('"', at) - at);
        EXPECT_TRUE(contains(list, format)) << entry.path() << ": " << format << " is not in JSON.md";
      }
    }
  EXPECT_GT(formats, 25);
}

// The page on an effect of one's own, followed in a copy of shared/: the header as printed there, the line as printed
// there, and nothing else; then the effect is in the list and computes what its equation says. That tool and drive have
// what the list has, their own tests show.
TEST(Documents, AnEffectOfOnesOwnIsOneFileAndOneLine) {
  const fs::path root = FLEXSPLINE_SOURCE_DIR;
  const std::string page = content_of(root / "shared/effects/ADD-YOUR-OWN.md");
  const std::vector<Block> files = blocks_of(page, "file"), lines = blocks_of(page, "line");
  ASSERT_EQ(files.size(), 1u);
  ASSERT_EQ(lines.size(), 1u);
  // Longer than its title says by what describes it.
  EXPECT_LE(std::count(files[0].text.begin(), files[0].text.end(), '\n'), 45);
  const Shell shell;
  fs::copy(root / "shared", shell.folder() / "shared", fs::copy_options::recursive);
  shell.write(files[0].argument, files[0].text);
  std::string list = shell.file(lines[0].argument);
  list.insert(list.find("#include \"shared/effects/"), lines[0].text);
  shell.write(lines[0].argument, list);
  shell.write("try.cpp", R"(#include <cmath>
#include <cstdio>
#include <string_view>
#include "host/common/numbers/real.hpp"
#include "shared/effects/list.hpp"
using namespace flexspline;
using R = numbers::Real;
int main() {
  int result = 1;
  effects::for_each_effect([&]<class Effect>(std::size_t) {
    if constexpr (Effect::kInfo.name == std::string_view("cubic_drag")) {
      const double parameter = 2e-9;
      const effects::DriveConstants<double> drive{};
      const auto coefficients = Effect::template derive<R>(&parameter, drive);
      effects::Inputs<R> in{};
      in.velocity = -150.0;
      in.speed = 150.0;
      effects::Torques<R> out{};
      Effect::template evaluate<R>({}, coefficients, in, out);
      std::printf("%.6g\n", out.motor);
      result = std::abs(out.motor + 2e-9 * 150.0 * 150.0 * 150.0) < 1e-12 ? 0 : 1;
    }
  });
  return result;
}
)");
  shell.must("c++ -std=c++20 -Wall -Wextra -Werror -I. -I'" + root.string() + "' try.cpp -o try && ./try");
  // What `./dev effect --check` says of it, and of a law whose exponent can leave its range.
  const std::string check = "'" + (root / "tests/support/check_effect.sh").string() + "' checked cubic_drag .";
  const std::string checked = shell.must(check);
  EXPECT_TRUE(contains(checked, "compiled for a drive (Fixed, Checked, Intervals, ErrorNumbers)")) << checked;
  EXPECT_TRUE(contains(checked, "pack proves it at its usual size")) << checked;
  const auto with = [&](const std::string& factor) {
    std::string header = files[0].text;
    const std::string last = ", in.speed);\n";
    header.replace(header.find(last), last.size(), ", " + factor + ");\n");
    shell.write(files[0].argument, header);
    return shell.run(check);
  };
  const Answer left = with("N::exp_negative(N::times(in.velocity, in.speed))");
  EXPECT_EQ(left.code, 1);
  EXPECT_TRUE(contains(left.out, "pack refuses it at its usual size: an exponential may reach its limit")) << left.out;
  const Answer broken = with("N::exp_negative(in.angle)");
  EXPECT_EQ(broken.code, 1);
  EXPECT_TRUE(contains(broken.err, "error: ")) << broken.err;
}

}  // namespace
}  // namespace flexspline::cli_test::documents_test
