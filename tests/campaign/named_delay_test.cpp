// A delay of the current, as the diagnosis tells it.
#include <gtest/gtest.h>

#include <cmath>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/support/delayed_current.hpp"

namespace flexspline::selection::named_delay_test {
namespace {

TEST(NamedDelay, IsTheVerdictOfTheDiagnosisWithTheValueOfTheLag) {
  const Diagnosis result = diagnose(tests::recorded_with_delay(8e-3, 0.2, 8e-3), tests::model_of_delayed_axis(), {});
  EXPECT_EQ(result.named, (std::vector<NamedEffect>{{"current_delay", std::nullopt}}));
  EXPECT_EQ(result.verdict, Verdict::missing_effect);
  const Candidate& first = result.candidates.front();
  EXPECT_EQ(first.effect, "current_delay");
  EXPECT_NE(first.note.find("are those of the lag"), std::string::npos);
  EXPECT_NEAR(first.parameters.front().value, 8e-3, 1e-3);
  EXPECT_LT(*first.parameters.front().low, 8e-3);
  EXPECT_GT(*first.parameters.front().high, 8e-3);
  // The weights of the records are in the error before, not in the size.
  EXPECT_NEAR(std::hypot(first.rmse_cv_after, first.size->rms) / first.rmse_cv_before, 1.0, 0.15);
}

// The lag is the delay's own column then.
TEST(NamedDelay, InTheModelIsNoLagToSpeakOf) {
  model::Model model = tests::model_of_delayed_axis();
  model.effects.push_back(catalogue::blank_effect(catalogue::get("current_delay"), data::Axis::rotary));
  const Diagnosis result = diagnose(tests::recorded_with_delay(8e-3, 0.2, 8e-3), model, {});
  EXPECT_TRUE(result.named.empty());
  EXPECT_FALSE(result.delay_s);
  EXPECT_TRUE(result.delay_advice.empty());
}

}  // namespace
}  // namespace flexspline::selection::named_delay_test
