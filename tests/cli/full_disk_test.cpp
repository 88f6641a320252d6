// An answer that does not reach standard output is no success.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::full_disk_test {
namespace {

TEST(FullDisk, EveryCommandThatAnswersOnStandardOutputExitsNonZeroAndSaysWhy) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const Shell shell;
  shell.record();
  const std::string model = " --model demo-out/base-model.toml ";
  shell.must("flexspline identify demo-out" + model + "--out fitted.toml");
  shell.must("flexspline pack --model fitted.toml --out drive.block");
  const std::string lines[] = {"flexspline export --model fitted.toml --as c",
                               "flexspline export --model fitted.toml --as urdf",
                               "flexspline export --protocol-header",
                               "flexspline identify demo-out" + model,
                               "flexspline identify demo-out --json -" + model,
                               "flexspline unpack drive.block",
                               "flexspline effects",
                               "flexspline effects inertia",
                               "flexspline effects --json -",
                               "flexspline drives",
                               "flexspline pack --model fitted.toml --out again.block",
                               "flexspline check demo-out",
                               "flexspline measure demo-out",
                               "flexspline compare --model fitted.toml demo-out",
                               "flexspline simulate --model fitted.toml demo-out --out simulated",
                               "flexspline new --from demo-out --out project",
                               "flexspline completion bash",
                               "flexspline man",
                               "flexspline --help",
                               "flexspline check --help",
                               "flexspline --version",
                               "flexspline fleet run demo-out"};
  for (const std::string& line : lines) {
    const Answer full = shell.run(line + " >/dev/full");
    EXPECT_NE(full.code, 0) << line;
    EXPECT_FALSE(full.err.empty()) << line;
    EXPECT_NE(shell.run(line + " >&-").code, 0) << line << " where standard output is closed";
  }
}

}  // namespace
}  // namespace flexspline::cli_test::full_disk_test
