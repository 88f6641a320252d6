// `flexspline-hil drive`: the firmware on the twin, as a user runs it.
#include <gtest/gtest.h>

#include "tests/cli/tool.hpp"

namespace flexspline::cli_test::drive_test {
namespace {

TEST(HilDrive, RunsEachScenarioWithAndWithoutCompensation) {
  const Shell shell;
  for (const char* scenario : {"slow-reversals", "sine", "trapezoid", "joint-trajectory", "constant-slow"}) {
    const auto json = shell.json("flexspline-hil drive --seconds 2 --scenario " + std::string(scenario));
    EXPECT_EQ(json["format"], "flexspline-hil/1");
    EXPECT_EQ(json["scenario"], scenario);
    expect_fields(json, {"runs", "ticks", "realtime_factor"});
    ASSERT_EQ(json["runs"].size(), 2u);
    EXPECT_FALSE(json["runs"][0]["compensation"].get<bool>());
    EXPECT_TRUE(json["runs"][1]["compensation"].get<bool>());
    for (const auto& run : json["runs"]) {
      expect_fields(run, {"rms_error_rad", "peak_error_rad", "rms_current_a", "fault", "telemetry_hash"});
      EXPECT_TRUE(run["fault"].is_null());
      EXPECT_GT(run["rms_error_rad"].get<double>(), 1e-8);
      EXPECT_LT(run["rms_error_rad"].get<double>(), 1e-3);
    }
    EXPECT_LT(json["runs"][1]["peak_error_rad"].get<double>(), json["runs"][0]["peak_error_rad"].get<double>());
  }
}

TEST(HilDrive, TheSameSeedGivesTheSameTelemetryAndAnotherOneAnother) {
  const Shell shell;
  const std::string line = "flexspline-hil drive --seconds 1 --compensation on --seed ";
  const auto hash = [&](const std::string& seed) { return shell.json(line + seed)["runs"][0]["telemetry_hash"]; };
  EXPECT_EQ(hash("7"), hash("7"));
  EXPECT_NE(hash("7"), hash("8"));
}

TEST(HilDrive, SaysWhatWentWrongAndWhatTheDriveDid) {
  const Shell shell;
  const std::string line = "flexspline-hil drive --seconds 2 --inject motor-encoder-stuck --inject-at 1.1";
  const auto json = shell.json(line);
  EXPECT_EQ(json["runs"][0]["fault"], "implausible_motion");
  EXPECT_NEAR(json["runs"][0]["fault_tick"].get<double>(), 100 + 1.1 * 20'000, 100.0);
  const std::string text = shell.must(line);
  EXPECT_TRUE(contains(text, "implausible_motion")) << text;
  EXPECT_TRUE(contains(text, "is switched off")) << text;
}

TEST(HilDrive, NamesWhatThereIsWhereAnArgumentIsWrong) {
  const Shell shell;
  for (const auto& [arguments, named] :
       {std::pair{"--scenario waltz", "joint-trajectory"}, std::pair{"--inject rain", "motor-encoder-stuck"},
        std::pair{"--processor none.elf", "build.sh"}, std::pair{"--seconds -1", "--seconds"},
        std::pair{"--plant none.toml", "none.toml"}, std::pair{"--with flying", "flying"}}) {
    const Answer answer = shell.run(std::string("flexspline-hil drive ") + arguments);
    EXPECT_EQ(answer.code, 2) << arguments;
    EXPECT_TRUE(contains(answer.err, named)) << answer.err;
  }
}

TEST(HilDrive, HelpHasAnExampleThatWorks) {
  const Shell shell;
  const std::string help = shell.must("flexspline-hil drive --help");
  const std::string mark = "Example: ";
  const std::size_t at = help.find(mark);
  ASSERT_NE(at, std::string::npos);
  shell.must(help.substr(at + mark.size(), help.find('\n', at) - at - mark.size()));
}

}  // namespace
}  // namespace flexspline::cli_test::drive_test
