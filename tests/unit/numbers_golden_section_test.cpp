// The golden-section search against a parabola and against the share that its sections leave.
#include "host/common/numbers/golden_section.hpp"

#include <gtest/gtest.h>

#include <cmath>

namespace flexspline::numbers::numbers_golden_section_test {
namespace {

TEST(GoldenSection, FindsTheLeastOfAParabolaWithinWhatItsSectionsLeave) {
  for (const double least : {-1.9, 0.3, 1.99})
    for (const int sections : {5, 10, 20}) {
      int calls = 0;
      const double found = golden_section(-2.0, 2.0, sections, [&](double x) {
        ++calls;
        return (x - least) * (x - least);
      });
      EXPECT_LE(std::abs(found - least), 0.5 * 4.0 * std::pow(0.6180339887498949, sections) + 1e-12);
      EXPECT_EQ(calls, sections + 2);
    }
}

TEST(GoldenSection, GoesToTheEndWhereTheFunctionFallsThroughout) {
  EXPECT_NEAR(golden_section(1.0, 3.0, 30, [](double x) { return -x; }), 3.0, 1e-5);
  EXPECT_NEAR(golden_section(1.0, 3.0, 30, [](double x) { return x; }), 1.0, 1e-5);
}

}  // namespace
}  // namespace flexspline::numbers::numbers_golden_section_test
