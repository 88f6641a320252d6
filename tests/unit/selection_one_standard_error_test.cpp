// The one-standard-error rule: how much larger one model's error is, by the parts that were left out.
#include <gtest/gtest.h>

#include <cmath>

#include "host/engine/selection/cross_validation.hpp"

namespace flexspline::selection::selection_one_standard_error_test {
namespace {

// A record of as many samples as squares, so that its noise is 1.
LeftOut record(const std::array<double, kFolds>& squares) {
  LeftOut r;
  r.squares_of_part = squares;
  for (const double part : squares) r.squares += part;
  r.rows = r.squares;
  return r;
}

TEST(OneStandardError, IsThePairedStatisticOfStudent) {
  // Differences of 1 to 5: mean 3, deviation sqrt(2.5), t = 3 / sqrt(2.5 / 5).
  const LeftOut other = record({10, 20, 10, 20, 10}), larger = record({11, 22, 13, 24, 15});
  EXPECT_NEAR(standard_errors_over({larger}, {other}), 3.0 / std::sqrt(0.5), 1e-12);
}

TEST(OneStandardError, CountsPartsInUnitsOfTheirRecordsNoise) {
  const LeftOut other = record({10, 20, 10, 20, 10}), larger = record({11, 22, 13, 24, 15});
  LeftOut other_loud = other, larger_loud = larger;
  for (LeftOut* loud : {&other_loud, &larger_loud}) {
    loud->squares *= 1e6;
    for (double& part : loud->squares_of_part) part *= 1e6;
  }
  // Ten differences, each of 1 to 5 twice: the squares about the mean are 20 over nine.
  EXPECT_NEAR(standard_errors_over({larger, larger_loud}, {other, other_loud}), 3.0 / std::sqrt(20.0 / 9.0 / 10.0),
              1e-9);
}

TEST(OneStandardError, IsBelowOneWherePartsDisagreeAndNoneWhereTheErrorIsSmaller) {
  const LeftOut other = record({10, 10, 10, 10, 10});
  EXPECT_LT(standard_errors_over({record({15, 6, 16, 4, 10})}, {other}), 1.0);
  EXPECT_EQ(standard_errors_over({record({9, 9, 9, 9, 9})}, {other}), 0.0);
}

TEST(OneStandardError, LeavesOutPartsWithoutSamples) {
  const LeftOut other = record({10, 20, 10, 20, 0}), larger = record({11, 22, 13, 24, 0});
  // Differences of 1 to 4: mean 2.5, variance 5/3.
  EXPECT_NEAR(standard_errors_over({larger}, {other}), 2.5 / std::sqrt(5.0 / 3.0 / 4.0), 1e-12);
}

}  // namespace
}  // namespace flexspline::selection::selection_one_standard_error_test
