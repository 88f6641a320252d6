// host/input/data: dataset.toml, header keys, and how columns are mapped.
#include <gtest/gtest.h>

#include <numbers>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_toml_test {
namespace {

constexpr const char* kFormatLine = "format = \"flexspline-dataset/1\"\n";

TEST(DatasetToml, MapsColumnsByUnitThenScaleThenOffset) {
  const TestFolder folder;
  folder.write("run.csv",
               csv_of({even_times(200)}, {{"I [mA]", [](double t) { return 1000.0 * current(t); }},
                                          {"speed", [](double t) { return velocity(t) * 30.0 / std::numbers::pi; }},
                                          {"temp", [](double) { return 300.0; }}}));
  folder.write("dataset.toml", std::string(kFormatLine) + R"(
[columns.current_a]
source = "I [mA]"
unit = "mA"
scale = -2.0
offset = 0.125
[columns.motor_velocity_rad_s]
source = "speed"
unit = "rpm"
[columns.temperature_c]
source = "temp"
unit = "K"
)");
  const Dataset data = load({folder.path()});
  const Experiment& e = data.experiments.at(0);
  for (std::size_t k = 0; k < e.size(); k += 7) {
    EXPECT_NEAR(e[Column::current][k], -2.0 * current(e.time_s[k]) + 0.125, 1e-7);
    EXPECT_NEAR(e[Column::motor_velocity][k], velocity(e.time_s[k]), 1e-6);
    EXPECT_NEAR(e[Column::temperature][k], 26.85, 1e-9);
  }
}

TEST(DatasetToml, CountsNeedTheEncoderAndTimeMayBeInMilliseconds) {
  const TestFolder folder;
  std::string text = "t_ms;enc\n";
  for (int k = 0; k < 100; ++k) text += fmt::format("{};{}\n", 2 * k, 64 * (k % 10));
  folder.write("run.csv", text);
  const std::string mapping = std::string(kFormatLine) +
                              "[columns.time_s]\nsource = \"t_ms\"\nunit = \"ms\"\n"
                              "[columns.output_position_rad]\nsource = \"enc\"\nunit = \"counts\"\n";
  folder.write("dataset.toml", mapping);
  const std::vector<Finding> errors = errors_of({folder.path()});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "mapping");
  EXPECT_NE(errors[0].text().find("output_encoder_counts"), std::string::npos);

  folder.write("dataset.toml", mapping + "[drive]\noutput_encoder_counts = 4096\n");
  const Dataset data = load({folder.path()});
  const Experiment& e = data.experiments.at(0);
  EXPECT_NEAR(e.sample_s, 0.002, 1e-12);
  EXPECT_NEAR(e[Column::output_position][1], 2.0 * std::numbers::pi * 64.0 / 4096.0, 1e-12);
}

TEST(DatasetToml, JointSideLogsMayMapOneColumnTwice) {
  const TestFolder folder;
  folder.write("run.csv", csv_of(even_times(100), {{"q", position}, {"tau", current}}));
  folder.write("dataset.toml", std::string(kFormatLine) +
                                   "[drive]\ngear_ratio = 1\n[columns]\nmotor_position_rad = {source = \"q\"}\n"
                                   "output_position_rad = {source = \"q\"}\nmotor_torque_nm = {source = \"tau\"}\n");
  const Dataset data = load({folder.path()});
  EXPECT_EQ(data.experiments[0][Column::motor_position], data.experiments[0][Column::output_position]);
  EXPECT_EQ(data.drive.gear_ratio, 1.0);
}

TEST(DatasetToml, AWrongUnitIsAnErrorThatListsTheKnownOnes) {
  const TestFolder folder;
  folder.write("run.csv", good_csv(100));
  for (const std::string unit : {"furlong/s", "A"}) {
    folder.write("dataset.toml",
                 std::string(kFormatLine) + "[columns.motor_velocity_rad_s]\nunit = \"" + unit + "\"\n");
    const std::vector<Finding> errors = errors_of({folder.path()});
    ASSERT_EQ(errors.size(), 1u);
    EXPECT_EQ(errors[0].kind, "mapping");
    EXPECT_EQ(errors[0].line, 2u);
    EXPECT_NE(errors[0].remedy.find("rpm"), std::string::npos) << errors[0].text();
  }
}

TEST(DatasetToml, ForceOnARotaryAxisIsAWarningUnlessALeverArmConvertsIt) {
  const TestFolder folder;
  folder.write("run.csv", csv_of(even_times(100), {{"force", current}, {"motor_position_rad", position}}));
  const std::string mapping =
      std::string(kFormatLine) + "[columns.motor_torque_nm]\nsource = \"force\"\nunit = \"N\"\n";
  folder.write("dataset.toml", mapping);
  EXPECT_EQ(of_kind(load({folder.path()}).findings, "unit").size(), 1u);
  folder.write("dataset.toml", mapping + "scale = 0.05\n");
  const Dataset data = load({folder.path()});
  EXPECT_TRUE(of_kind(data.findings, "unit").empty());
  EXPECT_NEAR(data.experiments[0][Column::motor_torque][5], 0.05 * current(0.005), 1e-6);
  folder.write("dataset.toml", mapping + "[drive]\naxis = \"linear\"\n");
  EXPECT_TRUE(of_kind(load({folder.path()}).findings, "unit").empty());
}

TEST(DatasetToml, PolePairsAndSlotsOfTheDriveAreWholeNumbers) {
  const TestFolder folder;
  folder.write("run.csv", good_csv(1000));
  folder.write("dataset.toml", std::string(kFormatLine) + "[drive]\npole_pairs = 7\nmotor_slots = 12\n");
  const DriveFacts drive = load({folder.path()}).drive;
  EXPECT_EQ(drive.pole_pairs, 7.0);
  EXPECT_EQ(drive.motor_slots, 12.0);
  for (const std::string key : {"pole_pairs", "motor_slots"})
    for (const std::string value : {"0", "-7", "3.5", "2000", "\"seven\""}) {
      folder.write("dataset.toml", std::string(kFormatLine) + "[drive]\n" + key + " = " + value + "\n");
      try {
        load({folder.path()});
        ADD_FAILURE() << key << " = " << value;
      } catch (const DataError& error) {
        const std::string what = error.what();
        EXPECT_NE(what.find(key), std::string::npos) << what;
        EXPECT_NE(what.find("a whole number from 1 to 1000"), std::string::npos) << what;
        EXPECT_NE(what.find("dataset.toml:3"), std::string::npos) << what;
      }
    }
}

TEST(DatasetToml, PartsOfAFileAreHalfOpenAndCarryTheirOwnKeys) {
  const TestFolder folder;
  folder.write("run.csv", "# temperature: warm\n" + good_csv(1000));
  folder.write("dataset.toml", std::string(kFormatLine) + R"(
[drive]
gear_ratio = 100
torque_constant_nm_a = 0.0543
encoder_counts = 8192
noise_std_current_a = 0.01
[[experiment]]
file = "run.csv"
name = "first"
from_s = 0.1
to_s = 0.3
[[experiment]]
file = "run.csv"
name = "second"
from_s = 0.3
role = "holdout"
load = "locked"
current_hold = "zoh"
replicate_of = "first"
motor_position_zero = "index"
output_position_zero = "absolute"
encoder_counts = 4096
noise_std_motor_position_rad = 1e-4
)");
  const Dataset data = load({folder.path()});
  ASSERT_EQ(data.experiments.size(), 2u);
  const Experiment& first = data.experiments[0];
  const Experiment& second = data.experiments[1];
  EXPECT_EQ(first.size(), 200u);
  EXPECT_NEAR(first.time_s.front(), 0.1, 1e-12);
  EXPECT_NEAR(first.time_s.back(), 0.299, 1e-12);
  EXPECT_NEAR(second.time_s.front(), 0.3, 1e-12);
  EXPECT_EQ(second.size(), 700u);
  EXPECT_EQ(first.role, Role::fit);
  EXPECT_EQ(second.role, Role::holdout);
  EXPECT_EQ(second.load, Load::locked);
  EXPECT_EQ(second.current_hold, CurrentHold::zoh);
  EXPECT_EQ(second.replicate_of, "first");
  EXPECT_EQ(second.motor_position_zero, PositionZero::index);
  EXPECT_EQ(second.output_position_zero, PositionZero::absolute);
  EXPECT_EQ(first.encoder_counts, 8192.0);
  EXPECT_EQ(second.encoder_counts, 4096.0);
  EXPECT_EQ(second.noise_std[static_cast<std::size_t>(Column::motor_position)], 1e-4);
  EXPECT_EQ(second.noise_std[static_cast<std::size_t>(Column::current)], 0.01);
  EXPECT_EQ(data.drive.gear_ratio, 100.0);
  EXPECT_EQ(data.drive.torque_constant_nm_a, 0.0543);
}

TEST(DatasetToml, APartOutsideTheFileSaysWhichTimesThereAre) {
  const TestFolder folder;
  folder.write("run.csv", good_csv(1000));
  folder.write("dataset.toml", std::string(kFormatLine) + "[[experiment]]\nfile = \"run.csv\"\nfrom_s = 5\n");
  const std::vector<Finding> errors = errors_of({folder.path()});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "too_few_samples");
  EXPECT_NE(errors[0].what.find("0.999"), std::string::npos) << errors[0].what;
}

TEST(DatasetToml, WhatIsWrongOutsideAPartDoesNotMatterToIt) {
  const TestFolder folder;
  folder.write("run.csv", good_csv(1000) + "1.000,nan,0,0\n");
  folder.write("dataset.toml", std::string(kFormatLine) + "[[experiment]]\nfile = \"run.csv\"\nto_s = 0.5\n");
  EXPECT_EQ(load({folder.path()}).experiments[0].size(), 500u);
}

TEST(DatasetToml, WinsOverTheHeaderWithAWarning) {
  const TestFolder folder;
  folder.write("run.csv", "# gear_ratio: 50\n# load: locked\n# encoder_counts: 4096\n" + good_csv(100));
  folder.write("dataset.toml", std::string(kFormatLine) +
                                   "[drive]\ngear_ratio = 100\nencoder_counts = 4096\n[[experiment]]\n"
                                   "file = \"run.csv\"\nload = \"free\"\n");
  const Dataset data = load({folder.path()});
  EXPECT_EQ(data.drive.gear_ratio, 100.0);
  EXPECT_EQ(data.experiments[0].load, Load::free);
  const std::vector<Finding> warnings = of_kind(data.findings, "key_differs");
  ASSERT_EQ(warnings.size(), 2u);
  EXPECT_EQ(warnings[0].line, 1u);
  EXPECT_EQ(warnings[0].severity, Severity::warning);
}

TEST(DatasetToml, HeaderKeysAreTakenWhereItIsSilent) {
  const TestFolder folder;
  const std::filesystem::path file = folder.write(
      "run.csv", "# experiment: slow\n# role: holdout\n# noise_std_current_a: 0.02\n# torque_constant_nm_a: 0.05\n" +
                     good_csv(100));
  const Dataset data = load({file});
  EXPECT_EQ(data.experiments[0].name, "slow");
  EXPECT_EQ(data.experiments[0].role, Role::holdout);
  EXPECT_EQ(data.experiments[0].noise_std[0], 0.02);
  EXPECT_EQ(data.drive.torque_constant_nm_a, 0.05);
}

TEST(DatasetToml, UnknownKeysAreWarningsWithTheNearestOne) {
  const TestFolder folder;
  folder.write("run.csv", "# encoder_count: 3\n# date: today\n" + good_csv(100));
  folder.write("dataset.toml", std::string(kFormatLine) +
                                   "[drive]\ngear_ration = 3\n[columns.curent_a]\nunit = \"A\"\n[columns.current_a]\n"
                                   "sorce = \"x\"\n[[experiment]]\nfile = \"run.csv\"\nfromm_s = 1\n");
  const Dataset data = load({folder.path()});
  std::string all;
  for (const Finding& finding : of_kind(data.findings, "unknown_key")) all += finding.text() + "\n";
  EXPECT_EQ(of_kind(data.findings, "unknown_key").size(), 5u) << all;
  for (const std::string_view near : {"gear_ratio?", "current_a?", "source?", "from_s?", "encoder_counts?"})
    EXPECT_NE(all.find(near), std::string::npos) << near << " not in\n" << all;
}

TEST(DatasetToml, IsRefusedWhereItIsBroken) {
  struct Broken {
    std::string text;
    std::string kind;
    std::size_t line;
    std::string word;
  };
  const std::vector<Broken> files = {
      {"format = \n", "format", 1, "TOML"},
      {std::string(kFormatLine) + "[.drive]\n", "format", 2, "TOML"},
      {std::string(kFormatLine) + "[[[drive]\n", "format", 2, "TOML"},
      {"format = \"flexspline-model/1\"\n", "format", 1, "--model"},
      {"format = \"flexspline-dataset/9\"\n", "format", 1, "flexspline-dataset/1"},
      {std::string(kFormatLine) + "[drive]\ngear_ratio = \"many\"\n", "key", 3, "above zero"},
      {std::string(kFormatLine) + "[drive]\naxis = \"round\"\n", "key", 3, "rotary or linear"},
      {std::string(kFormatLine) + "[columns.current_a]\nscale = \"2\"\n", "key", 3, "a number"},
      {std::string(kFormatLine) + "[columns.current_a]\nscale = 0\n", "key", 2, "zero"},
      {std::string(kFormatLine) + "[[experiment]]\nname = \"a\"\n", "key", 2, "file"},
      {std::string(kFormatLine) + "[[experiment]]\nfile = \"run.csv\"\nrole = \"train\"\n", "key", 4, "fit or holdout"},
      {std::string(kFormatLine) + "[[experiment]]\nfile = \"run.csv\"\nfrom_s = 2\nto_s = 1\n", "key", 2, "before"},
      {std::string(kFormatLine) + "[[experiment]]\nfile = \"absent.csv\"\n", "file", 0, "dataset.toml"},
      {std::string(kFormatLine) + "[columns.torque_nm]\nsource = \"Tq\"\n", "missing_column", 2, "Tq"},
      {std::string(kFormatLine) + "[experiment]\nfile = \"run.csv\"\n", "key", 2, "two brackets"},
  };
  for (const Broken& broken : files) {
    const TestFolder folder;
    folder.write("run.csv", good_csv(100));
    folder.write("dataset.toml", broken.text);
    const std::vector<Finding> errors = errors_of({folder.path() / "dataset.toml"});
    ASSERT_EQ(errors.size(), 1u) << broken.text;
    EXPECT_EQ(errors[0].kind, broken.kind) << errors[0].text();
    EXPECT_EQ(errors[0].line, broken.line) << errors[0].text();
    EXPECT_NE(errors[0].text().find(broken.word), std::string::npos) << errors[0].text();
  }
}

TEST(DatasetToml, BesideASingleFileItIsUsedAndSaid) {
  const TestFolder folder;
  const std::filesystem::path file = folder.write("run.csv", csv_of(even_times(100), {{"amps", current}}));
  folder.write("other.csv", csv_of(even_times(100), {{"amps", current}}));
  folder.write("dataset.toml", std::string(kFormatLine) + "[columns.current_a]\nsource = \"amps\"\n");
  const Dataset data = load({file});
  ASSERT_EQ(data.experiments.size(), 1u);
  EXPECT_TRUE(data.has(Column::current));
  EXPECT_EQ(of_kind(data.findings, "mapping").size(), 1u);
}

TEST(Load, AMeasurementGivenTwiceIsUsedOnceAndNamesAreMadeDifferent) {
  const TestFolder folder;
  const TestFolder other;
  const std::filesystem::path file = folder.write("run.csv", good_csv(100));
  const std::filesystem::path namesake = other.write("run.csv", good_csv(200));
  const Dataset data = load({file, folder.path(), namesake});
  ASSERT_EQ(data.experiments.size(), 2u);
  EXPECT_EQ(data.experiments[0].name, "run");
  EXPECT_EQ(data.experiments[1].name, "run-2");
  EXPECT_EQ(of_kind(data.findings, "duplicate").size(), 2u);
}

TEST(Load, FilesOfDifferentDrivesAreAConflict) {
  const TestFolder folder;
  folder.write("a.csv", "# gear_ratio: 100\n" + good_csv(100));
  folder.write("b.csv", "# gear_ratio: 50\n" + good_csv(100));
  const std::vector<Finding> errors = errors_of({folder.path()});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "conflict");
  EXPECT_EQ(load({folder.path()}, tolerating("conflict")).drive.gear_ratio, 100.0);
}

TEST(Load, HoldoutOverridesEveryRole) {
  const TestFolder folder;
  LoadOptions options;
  options.holdout = true;
  const Dataset data = load({folder.write("a.csv", "# role: fit\n" + good_csv(100))}, options);
  EXPECT_EQ(data.experiments[0].role, Role::holdout);
}

TEST(Load, TheAxisThatOneFileStatesIsThatOfAllInAnyOrder) {
  const TestFolder folder;
  const auto a = folder.write("a.csv", csv_of(even_times(100), {{"motor_position_rad", position}}));
  const auto b = folder.write("b.csv", "# axis: linear\n" + csv_of(even_times(100), {{"current_a", current}}));
  const auto toml = folder.write("c.toml",
                                 "format = \"flexspline-dataset/1\"\n[columns.motor_position_rad]\nunit = \"mm\"\n"
                                 "[[experiment]]\nfile = \"a.csv\"\n");
  const double millimetre = load({b, toml}).experiments[1][Column::motor_position][50];
  EXPECT_NEAR(millimetre, 1e-3 * position(0.05), 1e-9);
  const Dataset data = load({toml, b});
  EXPECT_EQ(data.experiments[0][Column::motor_position][50], millimetre);
  EXPECT_TRUE(of_kind(data.findings, "unit").empty());
  LoadOptions known;
  known.axis = Axis::linear;
  const Dataset alone = load({toml}, known);
  EXPECT_EQ(alone.experiments[0][Column::motor_position][50], millimetre);
  EXPECT_FALSE(alone.drive.axis);  // they do not state it
}

TEST(MergedFacts, AreThoseOfBothAndAContradictionIsAConflict) {
  const FactSources sources{"the first", "the second", "take one"};
  DriveFacts ours, theirs;
  ours.gear_ratio = 100.0;
  theirs.gear_ratio = 100.01;
  theirs.pitch_m = 0.01;
  theirs.axis = Axis::linear;
  merge_facts(ours, theirs, sources, Axis::linear);
  EXPECT_EQ(ours.gear_ratio, 100.0);
  EXPECT_EQ(ours.pitch_m, 0.01);
  EXPECT_EQ(ours.axis, Axis::linear);
  const auto conflict = [&](const DriveFacts& other) -> std::string {
    DriveFacts copy = ours;
    try {
      merge_facts(copy, other, sources);
    } catch (const DataError& error) {
      return error.what();
    }
    return "";
  };
  theirs = {};
  theirs.axis = Axis::rotary;
  EXPECT_NE(conflict(theirs).find("axis is linear in the first and rotary in the second"), std::string::npos);
  theirs = {};
  theirs.pitch_m = 0.02;
  EXPECT_NE(conflict(theirs).find("pitch_m is 0.01 in the first and 0.02 in the second"), std::string::npos);
  // Measurements that state no axis were read as rotary.
  theirs = {};
  theirs.axis = Axis::linear;
  ours = {};
  EXPECT_NE(conflict(theirs).find("axis is rotary in the first and linear in the second"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::data::data_toml_test
