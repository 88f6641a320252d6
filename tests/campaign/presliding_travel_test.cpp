// Presliding named by all samples, those around reversals among them, where the regression's slow filter hides its
// travel.
#include <gtest/gtest.h>

#include <algorithm>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/swinging_axis.hpp"

namespace flexspline::selection::presliding_travel_test {
namespace {

Diagnosis diagnosis_of(double travel_rad) {
  const data::Dataset dataset = tests::swinging_axis(travel_rad);
  return diagnose(dataset, tests::plain_model(), {});
}

const Candidate* named_presliding(const Diagnosis& found) {
  if (std::ranges::find(found.named, NamedEffect{"dahl_friction", {}}) == found.named.end()) return nullptr;
  const auto at = std::ranges::find(found.candidates, "dahl_friction", &Candidate::effect);
  return at == found.candidates.end() ? nullptr : &*at;
}

TEST(PreslidingTravel, IsFoundWithinItsIntervalThoughTheFilterOfTheRegressionIsSlow) {
  for (const double travel_rad : {0.05, 0.2, 0.4}) {
    const Diagnosis found = diagnosis_of(travel_rad);
    const Candidate* const named = named_presliding(found);
    ASSERT_NE(named, nullptr) << travel_rad;
    for (const estimation::Estimate& e : named->parameters) {
      if (e.parameter != "presliding") continue;
      EXPECT_NEAR(e.value, travel_rad, 0.1 * travel_rad);
      EXPECT_LT(*e.low, travel_rad);
      EXPECT_GT(*e.high, travel_rad);
    }
  }
}

TEST(PreslidingTravel, OfAnAxisWithoutOneNamesNothing) {
  const Diagnosis found = diagnosis_of(1e-6);
  EXPECT_EQ(named_presliding(found), nullptr);
}

}  // namespace
}  // namespace flexspline::selection::presliding_travel_test
