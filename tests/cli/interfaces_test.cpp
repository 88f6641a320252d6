// What a shell, a packager and a reader of `man` meet: completion, man page, version, installation.
#if defined(__GNUC__) && !defined(__clang__)
// g++ 12 warns of its own <regex> when it is inlined (bug 105562).
#pragma GCC diagnostic ignored "-Wmaybe-uninitialized"
#endif
#include <gtest/gtest.h>

#include <regex>
#include <set>
#include <sstream>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::interfaces_test {
namespace {

// Whether a program of the machine is there; `./dev test` installs those that are used here.
bool is_there(const Shell& shell, const std::string& program) {
  return shell.run("command -v " + program).code == 0;
}

// What bash would offer for a line of words, the last of which is being typed.
std::set<std::string> offered(const Shell& shell, const std::string& words) {
  shell.write("ask.sh",
              "source ./flexspline.bash\nCOMP_WORDS=(" + words +
                  ")\nCOMP_CWORD=$((${#COMP_WORDS[@]} - 1))\n_flexspline\nprintf '%s\\n' \"${COMPREPLY[@]}\"\n");
  std::istringstream lines(shell.must("bash --norc ask.sh"));
  std::set<std::string> all;
  for (std::string line; std::getline(lines, line);)
    if (!line.empty()) all.insert(line);
  return all;
}

// The options that --help of a command lists, as "--out".
std::set<std::string> options_in_help(const std::string& help) {
  std::set<std::string> options;
  std::istringstream lines(help);
  const std::regex option("^  (?:-h,)?(--[a-z0-9-]+)");
  for (std::string line; std::getline(lines, line);) {
    std::smatch found;
    if (std::regex_search(line, found, option)) options.insert(found[1]);
  }
  return options;
}

TEST(Completion, BashCompletesCommandsOptionsChoicesAndEffects) {
  const Shell shell;
  shell.must("flexspline completion bash >flexspline.bash");
  EXPECT_EQ(offered(shell, "flexspline ident"), std::set<std::string>{"identify"});
  EXPECT_EQ(offered(shell, "flexspline identify --meth"), std::set<std::string>{"--method"});
  EXPECT_EQ(offered(shell, "flexspline identify --method p"), std::set<std::string>{"partitioned"});
  EXPECT_EQ(offered(shell, "flexspline add stribeck_g"), std::set<std::string>{"stribeck_gaussian"});
  EXPECT_EQ(offered(shell, "flexspline completion z"), std::set<std::string>{"zsh"});
  EXPECT_TRUE(offered(shell, "flexspline identify --seed ''").empty());
  shell.write("my model.toml", "");
  EXPECT_EQ(offered(shell, "flexspline identify --model my"), std::set<std::string>{"my model.toml"});
}

TEST(Completion, OffersTheOptionsThatHelpListsAndNoOther) {
  const Shell shell;
  shell.must("flexspline completion bash >flexspline.bash");
  for (const char* command : {"demo", "identify", "diagnose", "plan", "pack", "record", "twin", "export", "fleet"}) {
    std::set<std::string> listed = options_in_help(shell.must(std::string("flexspline ") + command + " --help"));
    EXPECT_GT(listed.size(), 2u) << command;
    EXPECT_EQ(offered(shell, std::string("flexspline ") + command + " --"), listed) << command;
  }
}

TEST(Completion, ZshReadsItsScript) {
  const Shell shell;
  if (!is_there(shell, "zsh")) GTEST_SKIP() << "zsh is not installed";
  shell.must("flexspline completion zsh >_flexspline");
  shell.must("zsh -n _flexspline");
  // Loaded as compinit does; the completion itself needs a terminal.
  EXPECT_TRUE(contains(shell.must("zsh -f -c 'compdef() { print registered $1 for $2 }; source ./_flexspline; "
                                  "whence -w _flexspline'"),
                       "registered _flexspline for flexspline\n_flexspline: function"));
}

TEST(Completion, FishCompletesFromItsScript) {
  const Shell shell;
  if (!is_there(shell, "fish")) GTEST_SKIP() << "fish is not installed";
  shell.must("flexspline completion fish >flexspline.fish");
  const auto offers = [&](const std::string& line) {
    return shell.must(
        "HOME=$PWD XDG_CONFIG_HOME=$PWD/config XDG_DATA_HOME=$PWD/data fish --no-config -c "
        "'source flexspline.fish; complete -C \"" +
        line + "\"'");
  };
  EXPECT_TRUE(contains(offers("flexspline ident"), "identify\t"));
  EXPECT_TRUE(contains(offers("flexspline identify --metho"), "--method\t"));
  EXPECT_TRUE(contains(offers("flexspline identify --method part"), "partitioned"));
}

TEST(Completion, AnUnknownShellIsRefused) {
  const Shell shell;
  const Answer answer = shell.run("flexspline completion tcsh");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "bash, zsh and fish")) << answer.err;
}

TEST(ManPage, IsCleanRoffAndHasEveryCommand) {
  const Shell shell;
  shell.must("flexspline man >flexspline.1");
  if (!is_there(shell, "groff")) GTEST_SKIP() << "groff is not installed";
  const Answer page = shell.run("groff -man -ww -Tascii -P-cbou flexspline.1");
  EXPECT_EQ(page.code, 0);
  EXPECT_TRUE(page.err.empty()) << page.err;
  std::istringstream help(shell.must("flexspline --help"));
  bool in_commands = false;
  int commands = 0;
  for (std::string line; std::getline(help, line);) {
    if (line == "Subcommands:") in_commands = true;
    if (!in_commands || !line.starts_with("  ") || line.size() < 3 || line[2] == ' ') continue;
    const std::string name = line.substr(2, line.find(' ', 2) - 2);
    EXPECT_TRUE(contains(page.out, "\n   " + name + "\n")) << name;
    ++commands;
  }
  EXPECT_GT(commands, 20);
  EXPECT_TRUE(contains(page.out, "--method ls|nls|partitioned|iv|oe"));
}

TEST(Version, NamesVersionRevisionAndCompiler) {
  const Shell shell;
  const std::string version = shell.must("flexspline --version");
  EXPECT_TRUE(
      std::regex_match(version, std::regex("flexspline \\d+\\.\\d+\\.\\d+ \\([^,]+, (g|clang)\\+\\+ [^)]+\\)\n")))
      << version;
}

TEST(Version, StandsInWhatTheToolMakesAndOneBuildMakesTheSameAgain) {
  const Shell shell;
  std::string version = shell.must("flexspline --version");
  version.pop_back();
  shell.must("flexspline-hil record --out demo-out --seed 1");
  EXPECT_EQ(shell.json("flexspline identify demo-out --model demo-out/base-model.toml --out fitted.toml")["tool"],
            version);
  EXPECT_TRUE(shell.file("fitted.toml").ends_with("\n# Last written by " + version + ".\n"));
  shell.must("flexspline identify demo-out --model fitted.toml --out again.toml --json answer.json");
  const std::string again = shell.file("again.toml");
  EXPECT_EQ(again.find("# Last written"), again.rfind("# Last written"));
  shell.must("flexspline pack --model fitted.toml --out one.block");
  shell.must("flexspline pack --model fitted.toml --out two.block");
  EXPECT_EQ(shell.file("one.block"), shell.file("two.block"));
  EXPECT_EQ(shell.json("flexspline unpack one.block")["made_by"], version);
}

// Where the programs were built; install rules are next to them.
std::string build_folder() {
  return fs::path(FLEXSPLINE_TOOL).parent_path().string();
}

TEST(Install, BringsToolTwinAndAllThatGoesWithThem) {
  const Shell shell;
  shell.must("cmake --install '" + build_folder() + "' --prefix \"$PWD/prefix\"");
  for (const char* file :
       {"bin/flexspline", "bin/flexspline-hil", "share/man/man1/flexspline.1",
        "share/bash-completion/completions/flexspline", "share/zsh/vendor-completions/_flexspline",
        "share/fish/vendor_completions.d/flexspline.fish", "include/flexspline/flexspline_protocol.h",
        "lib/udev/rules.d/70-flexspline.rules", "share/doc/flexspline/README.md", "share/doc/flexspline/copyright",
        "share/doc/flexspline/host/input/data/RECORDINGS.md"})
    EXPECT_TRUE(fs::exists(shell.folder() / "prefix" / file)) << file;
  EXPECT_EQ(shell.must("prefix/bin/flexspline --version"), shell.must("flexspline --version"));
  EXPECT_EQ(shell.file("prefix/include/flexspline/flexspline_protocol.h"),
            shell.must("flexspline export --protocol-header"));
}

TEST(Install, TheDebianPackageListsProgramsAndDependencies) {
  const Shell shell;
  if (!is_there(shell, "dpkg-shlibdeps") || !is_there(shell, "dpkg-deb")) GTEST_SKIP() << "dpkg-dev is not installed";
  shell.must("cp '" + build_folder() + "'/CPackConfig.cmake . && cpack --config CPackConfig.cmake -B \"$PWD/package\"");
  const std::string content = shell.must("dpkg-deb -c package/flexspline_*.deb");
  for (const char* file : {"./usr/bin/flexspline\n", "./usr/bin/flexspline-hil\n", "./usr/share/man/man1/flexspline.1",
                           "./usr/lib/udev/rules.d/70-flexspline.rules\n"})
    EXPECT_TRUE(contains(content, file)) << file << "\n" << content;
  const std::string control = shell.must("dpkg-deb -f package/flexspline_*.deb Depends Package Version");
  EXPECT_TRUE(contains(control, "libmatio")) << control;
  EXPECT_TRUE(contains(control, "Package: flexspline")) << control;
}

}  // namespace
}  // namespace flexspline::cli_test::interfaces_test
