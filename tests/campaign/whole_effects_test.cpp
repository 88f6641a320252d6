// Effects that a drive has or has not, and those that one torque balance hardly shows and another one does.
#include <gtest/gtest.h>

#include <string>

#include "tests/support/campaign_size.hpp"
#include "tests/support/hidden_twin.hpp"

namespace flexspline::whole_effects_test {
namespace {

std::string named(const std::string& hidden, double scale, std::uint64_t seed, double variation = 0.0) {
  return tests::names(tests::HiddenTwin(hidden, scale, seed, variation).diagnose());
}

class WholeEffects : public ::testing::TestWithParam<std::string> {};

TEST_P(WholeEffects, AreNamedThoughTheBaseModelIsWorthLittleWithoutThem) {
  EXPECT_EQ(named(GetParam(), 1.0, 8401, 0.03), GetParam());
}

// A limit of the current has no size of its own: it fits at its place only.
INSTANTIATE_TEST_SUITE_P(Hidden, WholeEffects,
                         ::testing::ValuesIn(tests::part_of({"linear_stiffness", "output_coulomb_friction",
                                                             "current_saturation", "bouc_wen_hysteresis"})));

TEST(SmallOffset, OfTheTorqueSensorIsNamedByTheLoadThatMovesFreely) {
  // A hundredth of a spring's noise, and two thirds of the load balance's.
  EXPECT_EQ(named("torque_offset", 0.01, 8402), "torque_offset");
}

TEST(TorqueScale, OfMotorAndSensorIsNotIdentifiableWithoutATorqueThatIsKnown) {
  for (const std::string& hidden : tests::part_of({"torque_constant_error", "torque_sensor_gain"})) {
    const std::string names = named(hidden, 1.0, 8403);
    EXPECT_NE(names.find("torque_constant_error"), std::string::npos) << names;
    EXPECT_NE(names.find("torque_sensor_gain"), std::string::npos) << names;
  }
}

}  // namespace
}  // namespace flexspline::whole_effects_test
