// What `record` can be told to do: positions, the report's excitations; and what comes of a drive's residual map.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <numbers>
#include <sstream>
#include <string>
#include <vector>

#include "tests/cli/tool.hpp"
#include "tests/cli/twin_process.hpp"

namespace flexspline::cli_test::drive_plan_test {
namespace {

using nlohmann::json;

std::string plan_of(const std::string& run, const std::string& limits = "") {
  return "format = \"flexspline-plan/1\"\nsample_s = 0.001\n[limits]\n" + limits + "\n[[run]]\nname = \"run\"\n" + run +
         "\n";
}
// Columns of a CSV file by name.
std::vector<double> column(const std::string& csv, const std::string& name) {
  std::istringstream lines(csv);
  std::vector<double> values;
  std::string line;
  std::ptrdiff_t place = -1;
  while (std::getline(lines, line)) {
    if (line.starts_with("#")) continue;
    std::istringstream cells(line);
    std::vector<std::string> row;
    for (std::string cell; std::getline(cells, cell, ',');) row.push_back(cell);
    if (place < 0) {
      place = std::ranges::find(row, name) - row.begin();
      if (place == static_cast<std::ptrdiff_t>(row.size())) return {};
    } else {
      values.push_back(std::stod(row[static_cast<std::size_t>(place)]));
    }
  }
  return values;
}

TEST(RecordPositions, TheShaftGoesWhereThePlanSaysAndKeepsToItsLimit) {
  const Shell shell;
  shell.write("sine.toml", plan_of("mode = \"position\"\nwaveform = \"sine\"\namplitude = 20\nfrequency_hz = 0.5\n"
                                   "duration_s = 4",
                                   "velocity_rad_s = 110\ntravel_rad = 0.5"));
  const TwinProcess twin({"--serve", "0", "--fast"});
  for (const char* how : {"", " --compensate"}) {
    const json answer =
        shell.json("flexspline record --force --plan sine.toml --out sine --drive " + twin.name() + how);
    ASSERT_TRUE(answer["runs"][0]["complete"].get<bool>());
    EXPECT_EQ(answer["runs"][0]["frames_lost"], 0);
    const std::string csv = shell.file("sine/run.csv");
    const std::vector<double> set = column(csv, "position_command_rad"), shaft = column(csv, "motor_position_rad");
    ASSERT_GE(set.size(), 4000U);
    ASSERT_EQ(set.size(), shaft.size());
    const auto [low, high] = std::ranges::minmax(shaft);
    // The host's messages are 5 ms apart, or 50 ms on a machine that has much to do.
    EXPECT_NEAR(high - low, 40.0, 4.0) << how;
    double most = 0.0, fastest = 0.0;
    for (std::size_t k = 20; k < set.size(); ++k) {
      most = std::max(most, std::abs(set[k] - shaft[k]));
      fastest = std::max(fastest, std::abs(set[k] - set[k - 20]) / 0.02);
    }
    EXPECT_LT(most, 3.0) << "following error, rad of the motor";
    EXPECT_LT(fastest, 111.0);
  }
}

TEST(RecordPositions, APlanBeyondItsLimitsOrWithAnotherUnitMovesNothing) {
  const Shell shell;
  const std::string sine = "mode = \"position\"\nwaveform = \"sine\"\namplitude = 20\nfrequency_hz = 0.5\n";
  shell.write("travel.toml", plan_of(sine, "travel_rad = 0.1"));
  shell.write("velocity.toml", plan_of(sine, "velocity_rad_s = 40"));
  shell.write("unit.toml", plan_of("mode = \"velocity\"\namplitude = \"900 rpm\"\nfrequency_hz = 1"));
  shell.write("key.toml", plan_of("mode = \"velocity\"\namplitude = 50\nfrequency_rpm = 60"));
  shell.write("empty.toml", "");
  const TwinProcess twin({"--serve", "0", "--fast"});
  for (const auto& [line, expected] : std::vector<std::pair<std::string, std::string>>{
           {"travel.toml", "it turns the output by 0.4 rad"},
           {"velocity.toml", "its set point moves at up to"},
           {"unit.toml", "unit.toml:8: [[run]]: amplitude must be a number alone, in A (mode current), rad/s"},
           {"key.toml", "key.toml:9: [[run]]: unknown key \"frequency_rpm\"; did you mean frequency_hz, in Hz?"},
           {"empty.toml", "format must be"},
           {"travel.toml --runs rum", "did you mean run?"},
           {"travel.toml --full-current-a 2", "are for the report's plans"},
           {"report-fricton", "there is no file report-fricton and no such plan of the report; there are "}}) {
    const Answer answer = shell.run("flexspline record --out out --drive " + twin.name() + " --plan " + line);
    EXPECT_EQ(answer.code, 2) << line;
    EXPECT_TRUE(contains(answer.err, expected)) << line << ": " << answer.err;
    EXPECT_TRUE(shell.file("out/run.csv").empty()) << line;
  }
}

TEST(RecordTheReportsExcitations, ByNameInPercentOfTheDrivesLimits) {
  const Shell shell;
  const TwinProcess twin({"--serve", "0", "--fast"});
  const json answer = shell.json(
      "flexspline record --plan report-friction --runs 50-1-10,50-3-08 "
      "--full-velocity-rad-s 130 --out fast --drive " +
      twin.name());
  ASSERT_EQ(answer["runs"].size(), 2U);
  for (const json& run : answer["runs"]) {
    EXPECT_TRUE(run["complete"].get<bool>());
    EXPECT_NEAR(run["duration_s"].get<double>(), 10.0, 0.1);
  }
  const std::vector<double> command = column(shell.file("fast/50-1-10.csv"), "velocity_command_rad_s");
  ASSERT_FALSE(command.empty());
  EXPECT_NEAR(*std::ranges::max_element(command), 65.0, 0.5) << "half of 130 rad/s";
  const Answer locked = shell.run("flexspline record --plan report-compliance --out c --drive " + twin.name());
  EXPECT_EQ(locked.code, 2);
  EXPECT_TRUE(contains(locked.err, "lock the output")) << locked.err;
}

TEST(MonitorResidualMap, NamesWhatTheDrivesModelLacksAndIsEmptyAfterAReset) {
  const Shell shell;
  shell.write("plan.toml",
              plan_of("mode = \"position\"\nwaveform = \"triangle\"\namplitude = 60\nfrequency_hz = 0.125\n"
                      "duration_s = 16"));
  for (const bool lacks : {true, false}) {
    const TwinProcess twin(lacks ? std::vector<std::string>{"--serve", "0", "--fast", "--hide", "torque_ripple:2"}
                                 : std::vector<std::string>{"--serve", "0", "--fast"});
    const std::string monitor = "flexspline monitor --residual-map --drive " + twin.name();
    const json before = shell.json(monitor);
    EXPECT_EQ(before["format"], "flexspline-residual-map/1");
    EXPECT_EQ(before["verdict"], "too_little_data");
    EXPECT_TRUE(before["started"].get<bool>());
    shell.must("flexspline record --force --compensate --plan plan.toml --out recorded --drive " + twin.name());
    const std::string text = shell.must(monitor);
    const json after = shell.json(monitor + " --reset");
    EXPECT_FALSE(after["started"].get<bool>());
    EXPECT_EQ(after["rows"].size(), 15U);
    EXPECT_EQ(after["verdict"], lacks ? "model_fails" : "model_fits") << text;
    EXPECT_TRUE(contains(text, lacks ? "order 2 of the motor's turn" : "The model fits")) << text;
    std::printf("%s", text.c_str());
    EXPECT_EQ(shell.json(monitor)["seconds"], 0.0) << "after a reset";
  }
}

}  // namespace
}  // namespace flexspline::cli_test::drive_plan_test
