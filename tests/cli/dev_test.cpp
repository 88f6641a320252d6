// The script `dev`: what it takes, and how it counts tests.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::dev_test {
namespace {

const fs::path kRoot = FLEXSPLINE_SOURCE_DIR;
const std::string kDev = "'" + (kRoot / "dev").string() + "' ";

TEST(Dev, HelpListsEachVerb) {
  const std::string script = content_of(kRoot / "dev");
  const std::string help = Shell().must(kDev + "help");
  int verbs = 0;
  for (std::size_t at = 0; (at = script.find("\nverb_", at)) != std::string::npos; ++verbs) {
    at += 6;
    const std::string verb = script.substr(at, script.find("()", at) - at);
    EXPECT_TRUE(contains(help, "\n  " + verb + " ")) << verb;
  }
  EXPECT_GE(verbs, 10);
}

TEST(Dev, RefusesANumberOfJobsThatIsNone) {
  const Shell shell;
  EXPECT_EQ(shell.run("JOBS=1 " + kDev + "help").code, 0);
  for (const std::string jobs : {"0", "-1", "two", "1.5"}) {
    const Answer answer = shell.run("JOBS=" + jobs + " " + kDev + "help");
    EXPECT_EQ(answer.code, 2) << jobs;
    EXPECT_TRUE(contains(answer.err, "JOBS is a number of jobs from 1 on, not '" + jobs + "'")) << answer.err;
  }
}

// A program of GoogleTest that ended in its second test, a script that failed, and one that was skipped.
TEST(Dev, CountsATestDuringWhichItsProcessEndedAsFailed) {
  const Shell shell;
  shell.write("report.xml",
              "\t<testcase name=\"A,B\" classname=\"A,B\" status=\"fail\">\n"
              "[==========] Running 2 tests from 2 test suites.\n[ RUN      ] A.One\n[       OK ] A.One (1 ms)\n"
              "[ RUN      ] B.Two\n\t</testcase>\n"
              "\t<testcase name=\"Script\" classname=\"Script\" status=\"fail\">\n\t</testcase>\n"
              "\t<testcase name=\"Other\" classname=\"Other\" status=\"run\">\n\t</testcase>\n");
  const std::string count = "awk -f '" + (kRoot / "tests/support/ctest_summary.awk").string() + "' report.xml";
  const Answer answer = shell.run(count);
  EXPECT_EQ(answer.code, 1);
  EXPECT_TRUE(contains(answer.out, "\n2 passed, 2 failed, 0 skipped\n")) << answer.out;
  EXPECT_TRUE(contains(answer.out, "  B.Two\n")) << answer.out;
  EXPECT_TRUE(contains(answer.out, "  Script\n")) << answer.out;
}

TEST(Dev, ListsTheTestsThatTookLongestAndHowLongAllTook) {
  const Shell shell;
  shell.write("report.xml",
              "<testsuite name=\"(empty)\"\n\ttests=\"3\"\n\ttime=\"7\"\n\t>\n"
              "\t<testcase name=\"A,B\" classname=\"A,B\" time=\"3.6\" status=\"run\">\n"
              "[==========] Running 2 tests from 2 test suites.\n[ RUN      ] A.One\n[       OK ] A.One (3500 ms)\n"
              "[ RUN      ] B.Two\n[       OK ] B.Two (10 ms)\n\t</testcase>\n"
              "\t<testcase name=\"Script\" classname=\"Script\" time=\"2.04\" status=\"run\">\n\t</testcase>\n"
              "\t<testcase name=\"Other\" classname=\"Other\" time=\"11.5\" status=\"run\">\n\t</testcase>\n");
  const std::string said =
      shell.must("awk -v dearest=2 -f '" + (kRoot / "tests/support/ctest_summary.awk").string() + "' report.xml");
  EXPECT_TRUE(contains(said, "report.xml: 7 s of tests\n")) << said;
  EXPECT_TRUE(contains(said, "Dearest:\n   11.5 s  Other\n    3.5 s  A.One\n\n4 passed")) << said;
}

}  // namespace
}  // namespace flexspline::cli_test::dev_test
