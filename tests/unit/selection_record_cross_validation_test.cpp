// host/engine/selection/record_cross_validation: what records that were left out say, by the sign test.
#include "host/engine/selection/record_cross_validation.hpp"

#include <gtest/gtest.h>

namespace flexspline::selection::selection_record_cross_validation_test {
namespace {

TEST(RecordCrossValidation, IsCertainFromFourRecordsOfFourOn) {
  // By the binomial distribution with one half: 1/16 is below 0.1, 1/8 is not; 7 of 9 are 46/512, 6 of 9 are 130/512.
  EXPECT_TRUE((RecordCrossValidation{4, 0}.is_certain()));
  EXPECT_FALSE((RecordCrossValidation{3, 0}.is_certain()));
  EXPECT_TRUE((RecordCrossValidation{7, 2}.is_certain()));
  EXPECT_FALSE((RecordCrossValidation{6, 3}.is_certain()));
}

TEST(RecordCrossValidation, WithoutARecordThatDecidesNothingIsCertainAndNothingRefuted) {
  EXPECT_FALSE((RecordCrossValidation{0, 0}.is_certain()));
  EXPECT_FALSE((RecordCrossValidation{0, 0}.is_refuted()));
}

TEST(RecordCrossValidation, IsRefutedBelowThreeRecordsOfFive) {
  EXPECT_FALSE((RecordCrossValidation{3, 2}.is_refuted()));
  EXPECT_FALSE((RecordCrossValidation{2, 1}.is_refuted()));
  EXPECT_TRUE((RecordCrossValidation{1, 1}.is_refuted()));
  EXPECT_TRUE((RecordCrossValidation{5, 4}.is_refuted()));
}

}  // namespace
}  // namespace flexspline::selection::selection_record_cross_validation_test
