// Tables in .txt files of a folder are recordings; notes are not.
#include <gtest/gtest.h>

#include "tests/cli/small_logs.hpp"
#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::text_tables_test {
namespace {

using namespace small_logs;

TEST(TextTables, AFolderOfTablesWithTabsIsRead) {
  const Shell shell;
  for (const std::string name : {"one", "two"})
    shell.write("logs/" + name + ".txt",
                log_of("time\tposition\tvelocity\ttorque", {time_in(1.0), angle, speed, torque}, 0.0, '\t'));
  shell.write("logs/README.txt", "Logs of the left arm, 2 runs.\nSee the report, page 3, 4 and 5.\n");
  shell.must("flexspline new --from logs --out project");
  const std::string toml = shell.file("project/dataset.toml");
  EXPECT_TRUE(contains(toml, "logs/one.txt") && contains(toml, "logs/two.txt")) << toml;
  EXPECT_FALSE(contains(toml, "README")) << toml;
}

TEST(TextTables, AFolderOfNotesHasNoMeasurements) {
  const Shell shell;
  shell.write("logs/README.txt", "Logs of the left arm.\n");
  const Answer answer = shell.run("flexspline check logs");
  EXPECT_EQ(answer.code, 2);
  EXPECT_TRUE(contains(answer.err, "tables in .txt files")) << answer.err;
}

}  // namespace
}  // namespace flexspline::cli_test::text_tables_test
