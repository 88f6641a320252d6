// An answer that does not reach standard output is no success.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::full_disk_test {
namespace {

TEST(FullDisk, EveryCommandThatAnswersOnStandardOutputExitsNonZeroAndSaysWhy) {
  if (!fs::exists("/dev/full")) GTEST_SKIP() << "this system has no /dev/full";
  const Shell shell;
  shell.record_and_identify();
  const std::string model = " --model demo-out/base-model.toml ", run = " demo-out/free-sine-1hz.csv";
  shell.must("flexspline pack --model fitted.toml --out drive.block");
  const std::string lines[] = {"flexspline export --model fitted.toml --as c",
                               "flexspline export --model fitted.toml --as urdf",
                               "flexspline export --protocol-header",
                               "flexspline identify" + run + model,
                               "flexspline identify" + run + " --json -" + model,
                               "flexspline unpack drive.block",
                               "flexspline effects",
                               "flexspline effects inertia",
                               "flexspline effects --json -",
                               "flexspline drives",
                               "flexspline pack --model fitted.toml --out again.block",
                               "flexspline check" + run,
                               "flexspline measure" + run,
                               "flexspline compare --model fitted.toml" + run,
                               "flexspline simulate --model fitted.toml" + run + " --out simulated",
                               "flexspline new --from" + run + " --out project",
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
