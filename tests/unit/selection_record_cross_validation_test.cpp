// host/selection/record_cross_validation: what records that were left out say, by the sign test.
#include "host/selection/record_cross_validation.hpp"

#include <gtest/gtest.h>

namespace flexspline::selection {
namespace {

TEST(CarriedOver, IsCertainFromFourRecordsOfFourOn) {
  // By the binomial distribution with one half: 1/16 is below 0.1, 1/8 is not; 7 of 9 are 46/512, 6 of 9 are 130/512.
  EXPECT_TRUE((CarriedOver{4, 0}.is_certain()));
  EXPECT_FALSE((CarriedOver{3, 0}.is_certain()));
  EXPECT_TRUE((CarriedOver{7, 2}.is_certain()));
  EXPECT_FALSE((CarriedOver{6, 3}.is_certain()));
}

TEST(CarriedOver, WithoutARecordThatDecidesNothingIsCertainAndNothingRefuted) {
  EXPECT_FALSE((CarriedOver{0, 0}.is_certain()));
  EXPECT_FALSE((CarriedOver{0, 0}.is_refuted()));
}

TEST(CarriedOver, IsRefutedBelowThreeRecordsOfFive) {
  EXPECT_FALSE((CarriedOver{3, 2}.is_refuted()));
  EXPECT_FALSE((CarriedOver{2, 1}.is_refuted()));
  EXPECT_TRUE((CarriedOver{1, 1}.is_refuted()));
  EXPECT_TRUE((CarriedOver{5, 4}.is_refuted()));
}

}  // namespace
}  // namespace flexspline::selection
