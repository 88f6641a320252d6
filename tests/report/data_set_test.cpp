// The data set rhs-100 as files: read back by the tool they are what the twin recorded, and the same every time.
#include <gtest/gtest.h>
#include <unistd.h>

#include <filesystem>
#include <fstream>
#include <iterator>

#include "hil/rhs100/data_set.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::tests::data_set_test {
namespace {

std::string text_of(const std::filesystem::path& file) {
  std::ifstream in(file, std::ios::binary);
  return {std::istreambuf_iterator<char>(in), {}};
}

class Rhs100DataSet : public ::testing::Test {
 protected:
  void SetUp() override {
    folder = std::filesystem::temp_directory_path() / ("rhs-100-" + std::to_string(::getpid()));
    std::filesystem::remove_all(folder);
  }
  void TearDown() override { std::filesystem::remove_all(folder); }
  std::filesystem::path folder;
};

TEST_F(Rhs100DataSet, FilesHoldWhatTheTwinRecorded) {
  ASSERT_EQ(rhs100::write_data_set(folder, {"table-6"}, kJudgingSeed), 4u);
  const rhs100::Set set = rhs100::table_6();
  const data::Dataset in_memory = dataset_of(set), read = data::load({folder / "table-6"});
  ASSERT_EQ(read.experiments.size(), 4u);
  EXPECT_EQ(*read.drive.gear_ratio, 100.0);
  for (std::size_t k = 0; k < 4; ++k) {
    const data::Experiment &ours = in_memory.experiments[k], &theirs = read.experiments[k];
    EXPECT_EQ(theirs.name, ours.name);
    EXPECT_EQ(theirs.load, data::Load::locked);
    EXPECT_EQ(theirs.encoder_counts, ours.encoder_counts);
    for (const data::Column column : {data::Column::current, data::Column::motor_velocity, data::Column::motor_position,
                                      data::Column::output_position, data::Column::torque}) {
      ASSERT_EQ(theirs[column].size(), ours[column].size());
      for (std::size_t i = 0; i < ours.size(); i += 97)
        ASSERT_NEAR(theirs[column][i], ours[column][i], 1e-6 * (1.0 + std::abs(ours[column][i])));
    }
  }
}

TEST_F(Rhs100DataSet, TheSameSeedGivesTheSameFilesAndAnotherSeedOthers) {
  for (const auto& [name, seed] : {std::pair{"a", 7001}, std::pair{"b", 7001}, std::pair{"c", 7002}})
    rhs100::write_data_set(folder / name, {"table-3-slow"}, static_cast<std::uint64_t>(seed));
  const std::filesystem::path file = "table-3-slow/slow-1.csv";
  EXPECT_EQ(text_of(folder / "a" / file), text_of(folder / "b" / file));
  EXPECT_NE(text_of(folder / "a" / file), text_of(folder / "c" / file));
}

TEST_F(Rhs100DataSet, AllPartsHaveTheReportsExperimentsAndSayWhatIsChosen) {
  EXPECT_EQ(rhs100::write_data_set(folder, {}, kJudgingSeed), 11u + 4u + 26u + 15u + 8u + 2u);
  // The drive as a whole: tables 4, 7 and 8, without what the tool would complain of.
  const data::Dataset drive = data::load({folder});
  EXPECT_EQ(drive.experiments.size(), 11u + 26u + 15u);
  EXPECT_NE(model_of(text_of(folder / "base-model.toml")).find("linear_stiffness"), nullptr);
  for (const rhs100::Set& set : rhs100::all_sets()) {
    EXPECT_EQ(data::load({folder / set.name}).experiments.size(), set.experiments.size()) << set.name;
    EXPECT_NO_THROW(model_of(text_of(folder / set.name / "base-model.toml"))) << set.name;
  }
  const std::string readme = text_of(folder / "README.md");
  for (const char* chosen :
       {"Chosen, because the report does not state it", "output inertia", "wave-form codes", "encoders"})
    EXPECT_NE(readme.find(chosen), std::string::npos) << chosen;
}

TEST_F(Rhs100DataSet, APartThatThereIsNotIsRefusedWithTheNamesOfThoseThatAre) {
  try {
    rhs100::write_data_set(folder, {"table-9"}, 1);
    FAIL();
  } catch (const std::invalid_argument& error) {
    EXPECT_NE(std::string(error.what()).find("table-7"), std::string::npos) << error.what();
  }
}

}  // namespace
}  // namespace flexspline::tests::data_set_test
