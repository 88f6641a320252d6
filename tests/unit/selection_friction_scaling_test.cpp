// What halves of the data chose and only records can show: an effect that scales friction by the temperature.
#include <gtest/gtest.h>

#include <cmath>

#include "host/common/numbers/distributions.hpp"
#include "host/engine/selection/friction_scaling.hpp"

namespace flexspline::selection::selection_friction_scaling_test {
namespace {

TEST(FrictionScaling, StaysWhereFrictionOfTheRecordsGoesWithIt) {
  EXPECT_TRUE(is_shown_between_records(6, 0.04, false));
  EXPECT_TRUE(is_shown_between_records(4, 0.003, true));
}

TEST(FrictionScaling, IsTakenBackWhereItDoesNotWhateverAFewHeldOutRecordsSay) {
  EXPECT_FALSE(is_shown_between_records(6, 0.06, true));
  EXPECT_FALSE(is_shown_between_records(4, 0.6, true));
}

TEST(FrictionScaling, OfFewerRecordsThanTheTestNeedsHeldOutExperimentsDecide) {
  EXPECT_TRUE(is_shown_between_records(3, 1.0, true));
  EXPECT_FALSE(is_shown_between_records(3, 1.0, false));
}

TEST(FrictionScaling, LikelihoodOfRecordsHasThePValueOfTheLineThroughThem) {
  // Five points whose squares about their mean are 9.5, and about the line of slope 0.97 are 0.091.
  const double t = 0.97 / std::sqrt(0.091 / 3.0 / 10.0);
  EXPECT_NEAR(p_value_of_likelihood(5.0 * std::log(9.5 / 0.091), 5) / numbers::student_t_above(3.0, t), 1.0, 1e-9);
  EXPECT_EQ(p_value_of_likelihood(100.0, 2), 1.0);
  EXPECT_EQ(p_value_of_likelihood(-1.0, 6), 1.0);
}

}  // namespace
}  // namespace flexspline::selection::selection_friction_scaling_test
