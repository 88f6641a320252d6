// Times in messages of records whose time column is a date in seconds.
#include <gtest/gtest.h>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_record_time_test {
namespace {

constexpr double kDate_s = 1694512345.0;

// Moves, rests from 2 s to 4 s, and moves again.
double resting_position(double t) {
  const double s = t < kDate_s ? t : t - kDate_s;
  return s < 2.0 ? position(s) : s < 4.0 ? position(2.0) : position(s - 2.0);
}

std::string found(double first_s, const std::string& kind, double gap_s) {
  std::vector<double> times = even_times(6000);
  for (std::size_t k = 0; k < times.size(); ++k) times[k] += first_s + (k < 5000 ? 0.0 : gap_s);
  const TestFolder folder;
  std::string text = "time_s,current_a,motor_position_rad\n";
  for (const double t : times)
    text += fmt::format("{:.6f},{:.9f},{:.9f}\n", t, current(t - first_s), resting_position(t));
  const auto list = of_kind(load({folder.write("run.csv", text)}).findings, kind);
  return list.empty() ? "" : list.front().what;
}

TEST(RecordTime, OfADateIsAfterTheFirstSampleAndElseThatOfTheColumn) {
  EXPECT_NE(found(kDate_s, "standstill", 0.0).find("first from 2.0"), std::string::npos)
      << found(kDate_s, "standstill", 0.0);
  EXPECT_NE(found(kDate_s, "standstill", 0.0).find(" s after the first sample"), std::string::npos);
  EXPECT_EQ(found(0.0, "standstill", 0.0).find("after the first sample"), std::string::npos);
  EXPECT_NE(found(kDate_s, "gap", 0.5).find("at 4.999 s after the first sample: 2 segments"), std::string::npos)
      << found(kDate_s, "gap", 0.5);
  EXPECT_NE(found(0.0, "gap", 0.5).find("at 4.999 s: 2 segments"), std::string::npos) << found(0.0, "gap", 0.5);
}

TEST(RecordTime, OfAPartThatIsNotThereIsTheFilesWithAllItsDigits) {
  const TestFolder folder;
  std::vector<double> times = even_times(100);
  for (double& t : times) t += kDate_s;
  std::string text = "time_s,current_a,motor_position_rad\n";
  for (const double t : times) text += fmt::format("{:.3f},{:.9f},{:.9f}\n", t, current(t), position(t));
  folder.write("run.csv", text);
  folder.write("dataset.toml",
               "format = \"flexspline-dataset/1\"\n[[experiment]]\nfile = \"run.csv\"\nfrom_s = 1.0\nto_s = 2.0\n");
  try {
    load({folder.path()});
    ADD_FAILURE() << "was read";
  } catch (const DataError& error) {
    EXPECT_NE(std::string(error.what()).find("goes from 1694512345 to 1694512345.099 s"), std::string::npos)
        << error.what();
  }
}

}  // namespace
}  // namespace flexspline::data::data_record_time_test
