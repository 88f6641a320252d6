// A dataset.toml that states which findings are warnings.
#include <gtest/gtest.h>

#include "host/input/data/findings.hpp"
#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_tolerated_test {
namespace {

// Each third sample late by 0.6 of a step.
std::string uneven_log() {
  std::vector<double> times = even_times(1000);
  for (std::size_t k = 0; k < times.size(); k += 3) times[k] += 0.0006;
  return csv_of(times, good_columns());
}

std::string refusal_of(const TestFolder& folder) {
  try {
    load({folder.path()});
  } catch (const DataError& error) {
    return error.what();
  }
  return {};
}

TEST(ToleratedByDataset, AFindingIsAWarningOfItsFilesAloneWithoutTheOption) {
  const TestFolder stating, silent;
  for (const TestFolder* folder : {&stating, &silent}) folder->write("run.csv", uneven_log());
  silent.write("dataset.toml", "format = \"flexspline-dataset/1\"\n");
  EXPECT_NE(refusal_of(silent).find("new --tolerate jitter keeps it in dataset.toml"), std::string::npos)
      << refusal_of(silent);
  stating.write("dataset.toml", "format = \"flexspline-dataset/1\"\ntolerate = [\"jitter\"]\n");
  EXPECT_EQ(refusal_of(stating), "");
  EXPECT_EQ(load({stating.path() / "run.csv"}).experiments.size(), 1u);
  EXPECT_THROW(load({stating.path(), silent.path()}), DataError);
}

TEST(ToleratedByDataset, AVelocityThatDoesNotFitIsToleratedThoughItIsCheckedWhenAllIsRead) {
  const TestFolder folder;
  folder.write("run.csv",
               csv_of(even_times(2000), {{"motor_position_rad", position},
                                         {"motor_velocity_rad_s", [](double t) { return 3.0 * velocity(t); }},
                                         {"current_a", current}}));
  folder.write("dataset.toml", "format = \"flexspline-dataset/1\"\ntolerate = [\"velocity_position_mismatch\"]\n");
  EXPECT_EQ(refusal_of(folder), "");
}

TEST(ToleratedByDataset, AKindThatDoesNotExistIsAnErrorThatListsTheKindsAndItsLine) {
  const TestFolder folder;
  folder.write("run.csv", uneven_log());
  folder.write("dataset.toml", "format = \"flexspline-dataset/1\"\ntolerate = [\"jiter\"]\n");
  const std::string refusal = refusal_of(folder);
  EXPECT_NE(refusal.find("dataset.toml:2"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find("did you mean \"jitter\"?"), std::string::npos) << refusal;
  EXPECT_NE(refusal.find(tolerable_kinds()), std::string::npos) << refusal;
  folder.write("dataset.toml", "format = \"flexspline-dataset/1\"\ntolerate = \"jitter\"\n");
  EXPECT_NE(refusal_of(folder).find("tolerate must be a list of kinds"), std::string::npos) << refusal_of(folder);
}

}  // namespace
}  // namespace flexspline::data::data_tolerated_test
