// What halves of the data chose and only records can show: an effect that scales friction by the temperature.
#include <gtest/gtest.h>

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

}  // namespace
}  // namespace flexspline::selection::selection_friction_scaling_test
