// What the twin's own program complains of is the message, wherever it is shown.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::twin_message_test {
namespace {

TEST(TwinMessage, TheReasonOfAChildThatFailsIsInTheMessageItself) {
  const Shell shell;
  shell.write("broken.toml", "format = \"no plant at all\"\n");
  const Answer answer = shell.run("flexspline hil --scenario sine --plant broken.toml --seconds 2");
  EXPECT_EQ(answer.code, 2);
  EXPECT_FALSE(contains(answer.err, "stands above")) << answer.err;
  // One line of ours, with the child's reason in it: that is what a page shows.
  const std::size_t at = answer.err.rfind("flexspline hil: ");
  ASSERT_NE(at, std::string::npos) << answer.err;
  EXPECT_TRUE(contains(answer.err.substr(at), "broken.toml")) << answer.err;
}

}  // namespace
}  // namespace flexspline::cli_test::twin_message_test
