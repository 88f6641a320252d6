// host/input/data: the measured EMPS axis through a dataset.toml that maps its columns.
#include <gtest/gtest.h>

#include <cstdlib>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_emps_test {
namespace {

std::filesystem::path emps_folder() {
  const char* stated = std::getenv("FLEXSPLINE_DATA");
  const std::filesystem::path data = stated != nullptr
                                         ? std::filesystem::path(stated)
                                         : std::filesystem::path(FLEXSPLINE_SOURCE_DIR) / ".." / "shared" / "data";
  return std::filesystem::weakly_canonical(data) / "emps";
}

TEST(Emps, LoadsAsALinearAxisInTwoHalvesWithoutAWarning) {
  const std::filesystem::path emps = emps_folder();
  if (!std::filesystem::exists(emps / "emps_train.csv"))
    GTEST_SKIP() << "no EMPS data in " << emps << "; set FLEXSPLINE_DATA to the folder that holds emps/";
  const TestFolder folder;
  folder.write("dataset.toml", fmt::format(R"(format = "flexspline-dataset/1"
[drive]
axis = "linear"
[columns.motor_torque_nm]
source = "motor_force_n"
scale = 1.0
unit = "N"
[columns.motor_position_rad]
source = "position_m"
unit = "m"
[columns.position_command_rad]
source = "position_ref_m"
[[experiment]]
file = "{0}/emps_train.csv"
name = "first-half"
from_s = 0.0
to_s = 12.48
role = "fit"
[[experiment]]
file = "{0}/emps_train.csv"
name = "second-half"
from_s = 12.48
role = "holdout"
[[experiment]]
file = "{0}/emps_test_pulses.csv"
name = "pulses"
role = "holdout"
)",
                                           emps.string()));
  const Dataset data = load({folder.path()});
  for (const Finding& finding : data.findings) EXPECT_EQ(finding.severity, Severity::note) << finding.text();
  ASSERT_EQ(data.experiments.size(), 3u);
  EXPECT_EQ(data.drive.axis, Axis::linear);
  EXPECT_EQ(data.experiments[0].size(), 12480u);
  EXPECT_EQ(data.experiments[1].size(), 24841u - 12480u);
  EXPECT_EQ(data.experiments[2].size(), 24841u);
  for (const Experiment& e : data.experiments) {
    EXPECT_NEAR(e.sample_s, 0.001, 1e-9) << e.name;
    EXPECT_EQ(e.segments.size(), 1u);
    EXPECT_EQ(std::count(e.masked.begin(), e.masked.end(), 1), 0);
    EXPECT_FALSE(e.has(Column::motor_velocity));
  }
  EXPECT_DOUBLE_EQ(data.experiments[0][Column::motor_torque][0], 89.2344322);
  EXPECT_DOUBLE_EQ(data.experiments[0][Column::motor_position][3], 3.025e-05);
}

TEST(Emps, UnmappedSaysWhatToMap) {
  const std::filesystem::path emps = emps_folder();
  if (!std::filesystem::exists(emps / "emps_train.csv"))
    GTEST_SKIP() << "no EMPS data in " << emps << "; set FLEXSPLINE_DATA to the folder that holds emps/";
  const TestFolder folder;
  std::filesystem::copy_file(emps / "emps_train.csv", folder.path() / "emps_train.csv");
  const std::vector<Finding> errors = errors_of({folder.path()});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_EQ(errors[0].kind, "missing_column");
  EXPECT_NE(errors[0].what.find("motor_force_n"), std::string::npos);
  EXPECT_NE(errors[0].remedy.find("dataset.toml"), std::string::npos);
}

}  // namespace
}  // namespace flexspline::data::data_emps_test
