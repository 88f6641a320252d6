// host/input/data: an effort of the wrong sign, and a velocity that is late.
#include <gtest/gtest.h>

#include "tests/unit/data_test_files.hpp"

namespace flexspline::data::data_consistency_test {
namespace {

double late_velocity(double t) {
  return velocity(t - 0.04);
}

std::vector<Finding> found(const TestFolder& folder, const std::string& kind, const std::vector<TestColumn>& columns,
                           const std::vector<double>& times = even_times(4000)) {
  return of_kind(load({folder.write("run.csv", csv_of(times, columns))}).findings, kind);
}

TEST(Consistency, ACurrentOfTheWrongSignIsNamed) {
  const TestFolder folder;
  EXPECT_TRUE(found(folder, "sign", good_columns()).empty());
  const TestColumn turned{"current_a", [](double t) { return -current(t); }};
  for (const TestColumn& moves :
       {TestColumn{"motor_position_rad", position}, TestColumn{"motor_velocity_rad_s", velocity}}) {
    const std::vector<Finding> signs = found(folder, "sign", {turned, moves});
    ASSERT_EQ(signs.size(), 1u);
    EXPECT_NE(signs[0].text().find("scale = -1 under [columns.current_a]"), std::string::npos) << signs[0].text();
  }
}

TEST(Consistency, AnInertiaOrALoadThatGoesDownIsNoWrongSign) {
  const TestFolder folder;
  // No friction: what the motor gives it gets back.
  EXPECT_TRUE(found(folder, "sign",
                    {{"current_a", [](double t) { return -0.1 * position(t) + 0.001 * velocity(t); }},
                     {"motor_position_rad", position}})
                  .empty());
  // Down only, held by the motor: energy comes out all the way.
  EXPECT_TRUE(found(folder, "sign",
                    {{"current_a", [](double t) { return 1.0 - 0.1 * std::sin(9.0 * t); }},
                     {"motor_position_rad", [](double t) { return -2.0 * t - 0.1 * std::sin(3.0 * t); }}})
                  .empty());
}

TEST(Consistency, AVelocityThatIsLateIsNamedWithItsDelay) {
  const TestFolder folder;
  EXPECT_TRUE(found(folder, "velocity_lag", good_columns()).empty());
  const std::vector<Finding> lags =
      found(folder, "velocity_lag", {{"motor_position_rad", position}, {"motor_velocity_rad_s", late_velocity}});
  ASSERT_EQ(lags.size(), 1u);
  EXPECT_NE(lags[0].what.find("behind the derivative of motor_position_rad by 0.0"), std::string::npos) << lags[0].what;
}

}  // namespace
}  // namespace flexspline::data::data_consistency_test
