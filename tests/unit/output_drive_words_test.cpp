// Forces instead of torques on a linear axis, and the constants that a law refers to.
#include "host/output/answers/drive_words.hpp"

#include <gtest/gtest.h>

namespace flexspline::output::output_drive_words_test {
namespace {

TEST(DriveWords, ALinearAxisHasForces) {
  const char* const text = "Torques of 2 N m at 3 rad/s; N*m*s/rad over the output angle";
  EXPECT_EQ(words_on(data::Axis::linear, text), "Forces of 2 N at 3 m/s; N*s/m over the output position");
  EXPECT_EQ(words_on(data::Axis::rotary, text), text);
}

TEST(DriveWords, NamesOfColumnsKeysEffectsAndOptionsStay) {
  const char* const names = "torque_nm, motor_position_rad, torque_constant_nm_a, torque_ripple, --travel-rad, read";
  EXPECT_EQ(words_on(data::Axis::linear, names), names);
}

TEST(DriveWords, TheReferenceVelocityOfAPowerLawHasAValueAUnitAndASource) {
  model::Drive drive;
  EXPECT_EQ(reference_text("power_law_friction", drive),
            "wref = 1 rad/s, as the model's [drive] has no rated_velocity_rad_s");
  drive.rated_velocity_rad_s.value = 150.0;
  EXPECT_EQ(reference_text("power_law_friction", drive),
            "wref = 150 rad/s, rated_velocity_rad_s of the model's [drive]");
  drive.axis = data::Axis::linear;
  EXPECT_TRUE(reference_text("power_law_friction", drive).starts_with("wref = 150 m/s, "));
  EXPECT_TRUE(reference_text("temperature_viscous", drive).starts_with("temp0 = 30 degC, "));
  EXPECT_EQ(reference_text("viscous_friction", drive), "");
}

}  // namespace
}  // namespace flexspline::output::output_drive_words_test
