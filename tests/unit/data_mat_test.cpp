// host/input/data: MAT files give what CSV files of the same numbers give.
#include <gtest/gtest.h>

#include <cmath>

#include "tests/support/mat5.hpp"
#include "tests/unit/data_mat_writer.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_mat_test {
namespace {

namespace fs = std::filesystem;

const fs::path kFixtures = fs::path(FLEXSPLINE_SOURCE_DIR) / "tests/unit/fixtures";
constexpr MatFormat kFormats[] = {MatFormat::v5, MatFormat::v5_packed, MatFormat::v7_3, MatFormat::v7_3_packed};

std::vector<double> sampled(const std::vector<double>& times, double (*signal)(double)) {
  std::vector<double> values;
  for (const double t : times) values.push_back(signal(t));
  return values;
}

// The same numbers as good_csv(), which has nine digits.
std::vector<MatVariable> good_variables(std::size_t count = 500) {
  const std::vector<double> t = even_times(count);
  return {mat_vector("time_s", t), mat_vector("current_a", sampled(t, current)),
          mat_vector("motor_position_rad", sampled(t, position)),
          mat_vector("motor_velocity_rad_s", sampled(t, velocity))};
}

void expect_near(const std::vector<double>& a, const std::vector<double>& b, double tolerance) {
  ASSERT_EQ(a.size(), b.size());
  for (std::size_t k = 0; k < a.size(); ++k) ASSERT_NEAR(a[k], b[k], tolerance) << k;
}

void expect_same(const Dataset& a, const Dataset& b) {
  ASSERT_EQ(a.experiments.size(), 1u);
  ASSERT_EQ(b.experiments.size(), 1u);
  expect_near(a.experiments[0].time_s, b.experiments[0].time_s, 1e-9);
  for (std::size_t c = 0; c < kColumns; ++c)
    expect_near(a.experiments[0][static_cast<Column>(c)], b.experiments[0][static_cast<Column>(c)], 1e-7);
}

// What dataset.toml maps, as lines "[columns.X]" ..., of one file.
fs::path mapped(const TestFolder& folder, const fs::path& file, const std::string& columns) {
  return folder.write("dataset.toml", "format = \"flexspline-dataset/1\"\n" + columns +
                                          fmt::format("\n[[experiment]]\nfile = \"{}\"\n", file.string()));
}
std::string mapping(const std::string& ours, const std::string& theirs, const std::string& unit = "") {
  return fmt::format("[columns.{}]\nsource = \"{}\"\n{}", ours, theirs,
                     unit.empty() ? "" : fmt::format("unit = \"{}\"\n", unit));
}

// All texts of the errors, for what they must contain.
std::string error_text(const std::vector<Finding>& errors) {
  std::string text;
  for (const Finding& error : errors) text += error.text() + "\n";
  return text;
}
void expect_error(const fs::path& path, const std::string& kind, std::initializer_list<const char*> parts) {
  const std::vector<Finding> errors = errors_of({path});
  ASSERT_FALSE(errors.empty());
  EXPECT_EQ(errors[0].kind, kind) << error_text(errors);
  EXPECT_FALSE(errors[0].remedy.empty());
  for (const char* part : parts)
    EXPECT_NE(error_text(errors).find(part), std::string::npos) << part << " in " << error_text(errors);
}

TEST(Mat, AllVersionsReadAsTheCsvOfTheSameNumbersDoes) {
  const TestFolder folder;
  const Dataset csv = load({folder.write("run.csv", good_csv(500))});
  for (const MatFormat format : kFormats) {
    write_mat(folder.path() / "run.mat", format, good_variables());
    const Dataset mat = load({folder.path() / "run.mat"});
    expect_same(mat, csv);
    EXPECT_EQ(mat.experiments[0].name, "run");
  }
}

TEST(Mat, FieldsOfAStructAndColumnsAndRowsOfAMatrixAreNamedAsInMatlab) {
  const TestFolder folder;
  const Dataset csv = load({folder.write("run.csv", good_csv(500))});
  const std::vector<MatVariable> good = good_variables();
  MatVariable tall{"data", {500, 2}, good[1].values}, wide{"rows", {2, 500}, {}};
  tall.values.insert(tall.values.end(), good[2].values.begin(), good[2].values.end());
  for (std::size_t k = 0; k < 500; ++k) {
    wide.values.push_back(good[0].values[k]);
    wide.values.push_back(good[3].values[k]);
  }
  MatVariable field = good[1];
  field.name = "log.iq";
  MatVariable deep = good[2];
  deep.name = "log.q";
  deep.dims = {1, 1, 500};  // as Simulink writes signals
  for (const MatFormat format : kFormats) {
    write_mat(folder.path() / "all.mat", format, {tall, field, deep, wide});
    expect_same(load({mapped(folder, folder.path() / "all.mat",
                             mapping("time_s", "rows(1,:)") + mapping("motor_velocity_rad_s", "rows(2,:)") +
                                 mapping("current_a", "data(:,1)") + mapping("motor_position_rad", "data(:,2)"))}),
                csv);
    expect_same(load({mapped(folder, folder.path() / "all.mat",
                             mapping("time_s", "rows(1,:)") + mapping("motor_velocity_rad_s", "rows(2,:)") +
                                 mapping("current_a", "log.iq") + mapping("motor_position_rad", "log.q"))}),
                csv);
  }
}

TEST(Mat, FilesOfSciPyGiveTheNumbersThatTheirReadmeSays) {
  const Dataset plain = load({kFixtures / "scipy_plain.mat"});
  ASSERT_EQ(plain.experiments.size(), 1u);
  const Experiment& run = plain.experiments[0];
  ASSERT_EQ(run.size(), 100u);
  EXPECT_EQ(plain.drive.gear_ratio, 100.0);
  EXPECT_EQ(run.load, Load::locked);
  const TestFolder folder;
  const Dataset packed = load({mapped(
      folder, kFixtures / "scipy_packed.mat",
      mapping("time_s", "log.t") + mapping("current_a", "log.motor.iq", "mA") + mapping("torque_nm", "data(:,2)") +
          mapping("motor_position_rad", "wide(2,:)") + mapping("load_torque_nm", "on"))});
  const Experiment& log = packed.experiments.at(0);
  ASSERT_EQ(log.size(), 100u);
  for (std::size_t k = 0; k < 100; ++k) {
    const double i = std::round(1e4 * std::sin(static_cast<double>(k) / 9.0)) / 1e4;
    EXPECT_NEAR(run.time_s[k], 0.001 * static_cast<double>(k), 1e-12);
    EXPECT_NEAR(run[Column::current][k], i, 1e-12);
    EXPECT_EQ(run[Column::motor_position][k], 0.25 * static_cast<double>(k));
    EXPECT_NEAR(log[Column::current][k], i, 0.51e-3);
    EXPECT_NEAR(log[Column::torque][k], i, 1e-12);
    EXPECT_EQ(log[Column::motor_position][k], 0.25 * static_cast<double>(k));
    EXPECT_EQ(log[Column::load_torque][k], k % 2 == 0 ? 1.0 : 0.0);
  }
}

TEST(Mat, FilesOfMachinesOfEitherByteOrderAreRead) {
  const std::vector<double> times = even_times(40, 0.5);
  for (const bool big_endian : {false, true}) {
    const TestFolder folder;
    const fs::path file = folder.write(
        "run.mat",
        flexspline::tests::Mat5Text(big_endian).add("duration", times).add("amperage", sampled(times, current)).text());
    const Dataset data =
        load({mapped(folder, file, mapping("time_s", "duration", "ms") + mapping("current_a", "amperage"))});
    ASSERT_EQ(data.experiments.at(0).size(), 40u);
    EXPECT_NEAR(data.experiments[0].time_s[39], 0.0195, 1e-12);
    EXPECT_EQ(data.experiments[0][Column::current], sampled(times, current));
  }
}

TEST(Mat, AFolderIsReadWithItsMatAndCsvFilesInTheOrderOfNames) {
  const TestFolder folder;
  folder.write("b.csv", good_csv(100));
  write_mat(folder.path() / "a.mat", MatFormat::v5, good_variables(100));
  write_mat(folder.path() / "c.MAT", MatFormat::v7_3, good_variables(100));
  const Dataset data = load({folder.path()});
  ASSERT_EQ(data.experiments.size(), 3u);
  EXPECT_EQ(data.experiments[0].name, "a");
  EXPECT_EQ(data.experiments[2].name, "c");
}

TEST(Mat, AVariableThatIsNotThereIsAnErrorWithThoseThatAreTheNearestFirst) {
  const TestFolder folder;
  const fs::path file = kFixtures / "scipy_packed.mat";
  expect_error(mapped(folder, file, mapping("time_s", "log.t") + mapping("current_a", "log.motor.id")),
               "missing_column", {"current_a", "log.motor.id", "no file"});
  expect_error(file, "missing_column", {"there is no column \"time_s\" among \"", "map it in dataset.toml"});
  expect_error(mapped(folder, file, mapping("time_s", "wide(3,:)") + mapping("current_a", "log.motor.iq")),
               "missing_column", {"among \"wide(1,:)\", \"wide(2,:)\", "});
}

TEST(Mat, WhatCannotBeAColumnIsNamedAsWhatItIs) {
  const TestFolder folder;
  constexpr std::pair<const char*, const char*> kCases[] = {
      {"z", "is complex"},
      {"names", "is a cell array"},
      {"rare", "is sparse"},
      {"note", "is text"},
      {"log.motor.bus", "is text"},
      {"nothing", "is empty"},
      {"cube", "has 3 dimensions"},
      {"data", "is a matrix of 100 by 3, whose signals are \"data(:,1)\""},
      {"other", "has 7 values, but the time \"log.t\" has 100"}};
  for (const auto& [name, why] : kCases)
    expect_error(
        mapped(folder, kFixtures / "scipy_packed.mat", mapping("time_s", "log.t") + mapping("current_a", name)),
        "mapping", {name, why, "column current_a", "scipy_packed.mat"});
}

TEST(Mat, AnErrorInOneVariableIsNotFollowedByAnotherThatItIsNowhere) {
  const TestFolder folder;
  const std::vector<Finding> errors = errors_of(
      {mapped(folder, kFixtures / "scipy_packed.mat",
              mapping("time_s", "log.t") + mapping("current_a", "log.motor.iq") + mapping("torque_nm", "other"))});
  EXPECT_EQ(errors.size(), 1u) << error_text(errors);
}

TEST(Mat, NanAndInfinityAreErrorsWithTheSampleAndToleratedTheyAreCutOut) {
  const TestFolder folder;
  std::vector<MatVariable> variables = good_variables(400);
  for (std::size_t k = 200; k < 205; ++k) variables[1].values[k] = k % 2 == 0 ? NAN : INFINITY;
  const fs::path file = folder.path() / "run.mat";
  for (const MatFormat format : kFormats) {
    write_mat(file, format, variables);
    expect_error(file, "not_finite",
                 {"column current_a", "sample 201: \"NaN\" is not a finite number, and 4 more in this column"});
    EXPECT_EQ(load({file}, tolerating("not_finite")).experiments.at(0).segments.size(), 2u);
  }
}

TEST(Mat, TimeThatGoesBackIsAnErrorWithTheSample) {
  const TestFolder folder;
  std::vector<MatVariable> variables = good_variables(400);
  variables[0].values[7] = 0.0;
  write_mat(folder.path() / "run.mat", MatFormat::v5, variables);
  expect_error(folder.path() / "run.mat", "time_not_increasing", {"sample 8: the time 0 s comes after 0.006 s"});
}

TEST(Mat, FilesThatAreNoMatFileOfTheseVersionsAreRefusedByWhatTheyAre) {
  const TestFolder folder;
  expect_error(folder.write("empty.mat", ""), "header", {"empty.mat", "the file is empty"});
  expect_error(folder.write("text.mat", good_csv(100)), "format", {"text.mat", "not a MAT file", ".mat"});
  expect_error(folder.write("short.mat", "MATLAB 5.0 MAT-file, Platform: GLNXA64"), "format", {"cut off"});
  expect_error(kFixtures / "scipy_v4.mat", "format", {"version 4", "-v7"});
  write_mat(folder.path() / "scalars.mat", MatFormat::v5, {{"gear_ratio", {1, 1}, {100.0}}});
  expect_error(folder.path() / "scalars.mat", "header", {"no vector", "\"gear_ratio\" is a single number", "save("});
}

TEST(Mat, AMatFileOfAnyNameIsRecognizedByItsFirstBytes) {
  const TestFolder folder;
  fs::copy_file(kFixtures / "scipy_plain.mat", folder.path() / "recording.dat");
  EXPECT_EQ(load({folder.path() / "recording.dat"}).experiments.at(0).size(), 100u);
}

}  // namespace
}  // namespace flexspline::data::data_mat_test
