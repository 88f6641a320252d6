// host/input/data: counts, per cent and thousandths of a degree are noticed, whatever the time base.
#include <gtest/gtest.h>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_whole_numbers_test {
namespace {

std::vector<double> uneven_times(std::size_t count) {
  std::vector<double> times = even_times(count);
  for (std::size_t k = 0; k < count; ++k) times[k] += 0.00005 * static_cast<double>((k * 7) % 3);
  return times;
}

TEST(WholeNumbers, AreNoticedOnAnUnevenTimeBaseToo) {
  for (const std::vector<double>& times : {even_times(1000), uneven_times(1000)}) {
    const TestFolder folder;
    const Dataset data = load({folder.write(
        "run.csv",
        csv_of(times, {{"current_a", [](double t) { return std::round(60.0 * current(t)); }},
                       {"motor_position_rad", [](double t) { return std::round(4000.0 * position(t)); }}}))});
    const std::vector<Finding> units = of_kind(data.findings, "unit");
    ASSERT_EQ(units.size(), 2u);
    EXPECT_NE(units[0].text().find("counts"), std::string::npos);
    EXPECT_NE(units[0].text().find("mdeg"), std::string::npos);
    EXPECT_NE(units[1].text().find("per cent"), std::string::npos);
  }
}

TEST(WholeNumbers, AVelocityGivesMillidegreesAway) {
  const TestFolder folder;
  const std::vector<Finding> errors = errors_of(
      {folder.write("run.csv", csv_of(uneven_times(2000),
                                      {{"motor_position_rad", [](double t) { return 180e3 / M_PI * position(t); }},
                                       {"motor_velocity_rad_s", velocity}}))});
  ASSERT_EQ(errors.size(), 1u);
  EXPECT_NE(errors[0].what.find("millidegrees"), std::string::npos) << errors[0].what;
}

TEST(WholeNumbers, TheLikelyUnitOfTheTimeFollowsItsSteps) {
  const TestFolder folder;
  for (const auto& [factor, unit] : {std::pair{1e3, "ms"}, {1e6, "us"}, {1e9, "ns"}}) {
    std::vector<double> times = even_times(200);
    for (double& t : times) t *= factor;
    const Dataset data = load({folder.write("run.csv", csv_of(times, {{"current_a", [](double) { return 1.0; }}}))});
    const std::vector<Finding> units = of_kind(data.findings, "unit");
    ASSERT_FALSE(units.empty());
    EXPECT_NE(units[0].remedy.find(fmt::format("\"{}\"", unit)), std::string::npos) << units[0].text();
  }
}

}  // namespace
}  // namespace flexspline::data::data_whole_numbers_test
