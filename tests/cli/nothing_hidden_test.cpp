// A twin that hides nothing, through the chain that a user runs: record, identify, diagnose. Nothing is named, with and
// without its noisy torque sensor. Seeds 301 to 305 and 311 to 314 were used while this was written.
#include <gtest/gtest.h>

#include <string>

#include "tests/cli/free_motions.hpp"
#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"
#include "tests/support/campaign_size.hpp"

namespace flexspline::cli_test::nothing_hidden_test {
namespace {

using nlohmann::json;

json named(const Shell& shell) {
  shell.must("flexspline-hil data-sheet --out sheet");
  shell.must("flexspline identify --model sheet/known-model.toml --out base.toml free");
  return shell.json("flexspline diagnose --model base.toml free")["named"];
}

TEST(NothingHidden, NothingIsNamedWithAndWithoutTheTorqueSensor) {
  for (int seed = 601; seed < 601 + tests::in_campaign(1, 12); ++seed) {
    const Shell shell;
    const TwinProcess twin({"--serve", "0", "--fast", "--seed", std::to_string(seed)});
    shell.write("plan.toml", free_motions());
    shell.must("flexspline record --plan plan.toml --out free --drive " + twin.name());
    EXPECT_EQ(named(shell), json::array()) << seed;
    leave_out_torque(shell, "free");
    EXPECT_EQ(named(shell), json::array()) << seed << ", without torque";
  }
}

}  // namespace
}  // namespace flexspline::cli_test::nothing_hidden_test
