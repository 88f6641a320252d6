// Wald's test of a named effect against the table of chi-square (Abramowitz and Stegun, 26.8).
#include <gtest/gtest.h>

#include "host/engine/selection/policy.hpp"
#include "host/engine/selection/wald_test.hpp"

namespace flexspline::selection::selection_wald_test {
namespace {

estimation::Estimate value(double times_std) {
  estimation::Estimate e;
  e.value = -2.0 * times_std;
  e.std = 2.0;
  return e;
}
Candidate candidate(std::initializer_list<double> times_std) {
  Candidate c;
  c.effect = "gravity";
  for (const double z : times_std) c.parameters.push_back(value(z));
  return c;
}

TEST(WaldTest, TheProbabilityIsThatOfChiSquareWithAsManyParameters) {
  EXPECT_NEAR(*wald_p_value(candidate({1.959964})), 0.05, 1e-6);
  EXPECT_NEAR(*wald_p_value(candidate({1.730818, 1.730818})), 0.05, 1e-5);  // 5.99146 in sum
}

TEST(WaldTest, OfARippleEachOrderThatIsTriedCounts) {
  Candidate ripple = candidate({3.0, 0.0});
  const double alone = *wald_p_value(ripple);
  ripple.order = 11.0;
  EXPECT_NEAR(*wald_p_value(ripple), kPolicy.highest_order * alone, 1e-12);
}

TEST(WaldTest, LawsWithNonlinearParametersHaveNone) {
  Candidate law = candidate({0.1});
  law.parameters.push_back({});
  EXPECT_FALSE(wald_p_value(law));
  law.parameters.back().fixed = true;
  EXPECT_TRUE(wald_p_value(law));
  // Its error changes nothing.
  Candidate presliding = candidate({0.1});
  presliding.effect = "dahl_friction";
  presliding.parameters.front().ref.parameter = catalogue::get(presliding.effect).index_of("presliding");
  EXPECT_FALSE(wald_p_value(presliding));
}

Diagnosis with(Candidate c) {
  Diagnosis result;
  result.verdict = Verdict::missing_effect;
  result.named.push_back({c.effect, c.order});
  result.candidates.push_back(std::move(c));
  return result;
}

TEST(WaldTest, ANameWhoseValuesMayBeZeroIsTakenBackWithItsReason) {
  Diagnosis result = with(candidate({1.0, -1.2}));
  take_back_insignificant(result);
  EXPECT_TRUE(result.named.empty());
  EXPECT_FALSE(result.candidates.front().admissible);
  EXPECT_NE(result.candidates.front().why_not, "");
}

TEST(WaldTest, ANameThatHeldOutExperimentsConfirmStaysThoughWhatElseIsMissingWidensItsInterval) {
  Diagnosis result = with(candidate({1.0, -1.2}));
  Resampling::FoundTerm found;
  found.group = result.named;
  found.held_out_ratio = 0.9;  // of the error: 0.81 of its square
  result.resampling.emplace();
  result.resampling->decides = true;
  result.resampling->found = {found};
  take_back_insignificant(result);
  EXPECT_EQ(result.named.size(), 1u);
  result.resampling->found.front().held_out_ratio = 0.98;  // 0.96 of its square
  take_back_insignificant(result);
  EXPECT_TRUE(result.named.empty());
}

Candidate presliding_of(double travel, double std) {
  Candidate law;
  law.effect = "dahl_friction";
  estimation::Estimate& e = law.parameters.emplace_back();
  e.ref.parameter = catalogue::get(law.effect).index_of("presliding");
  e.value = travel;
  e.std = std;
  return law;
}

TEST(WaldTest, PreslidingWhoseTravelMayBeZeroIsTakenBackThoughHeldOutExperimentsConfirmIt) {
  Diagnosis result = with(presliding_of(0.03, 0.02));
  Resampling::FoundTerm found;
  found.group = result.named;
  found.held_out_ratio = 0.5;
  result.resampling.emplace();
  result.resampling->decides = true;
  result.resampling->found = {found};
  take_back_insignificant(result);
  EXPECT_TRUE(result.named.empty());
  ASSERT_EQ(result.possible.size(), 1u);
  EXPECT_NE(result.candidates.front().why_not.find("too short for these samples"), std::string::npos);
}

TEST(WaldTest, OfPreslidingWhatAllSamplesSayCountsInsteadOfTheInterval) {
  Candidate law = presliding_of(0.03, 0.02);
  law.presliding_doubt = "";
  Diagnosis sure = with(law);
  take_back_insignificant(sure);
  EXPECT_EQ(sure.named.size(), 1u);
  law = presliding_of(0.03, 0.001);
  law.presliding_doubt = "the error does not fall";
  Diagnosis doubtful = with(law);
  take_back_insignificant(doubtful, false);  // not judged before all samples were asked
  EXPECT_EQ(doubtful.named.size(), 1u);
  take_back_insignificant(doubtful);
  EXPECT_TRUE(doubtful.named.empty());
  EXPECT_EQ(doubtful.candidates.front().why_not, "the error does not fall");
}

TEST(WaldTest, PreslidingOfAResolvedTravelStays) {
  Diagnosis result = with(presliding_of(0.03, 0.01));
  take_back_insignificant(result);
  EXPECT_EQ(result.named.size(), 1u);
}

TEST(WaldTest, ALawWhoseShapeMayBeAnythingIsTakenBackWhereHalvesOfTheDataChoseIt) {
  const auto names_left = [](double low, double high, bool halves_decide) {
    Candidate law;
    law.effect = "power_law_friction";
    estimation::Estimate& exponent = law.parameters.emplace_back();
    exponent.ref.parameter = catalogue::get(law.effect).index_of("exponent");
    exponent.value = 0.3;
    exponent.low = low;
    exponent.high = high;
    Diagnosis result = with(law);
    result.resampling.emplace();
    result.resampling->decides = halves_decide;
    take_back_insignificant(result);
    return result.named.size();
  };
  EXPECT_EQ(names_left(0.15, 0.85, true), 0U);
  EXPECT_EQ(names_left(0.15, 0.6, true), 1U);
  EXPECT_EQ(names_left(0.15, 0.85, false), 1U);
}

TEST(WaldTest, ASignificantNameStays) {
  Diagnosis result = with(candidate({1.0, -5.0}));
  take_back_insignificant(result);
  EXPECT_EQ(result.named.size(), 1U);
}

TEST(WaldTest, AConfoundedGroupStaysWhereOneOfItsMembersDiffersFromZeroAndGoesWhereNoneDoes) {
  const auto named_of_group = [](double times_std_of_second) {
    Diagnosis result = with(candidate({0.1}));
    result.verdict = Verdict::confusable_effects;
    Candidate second = candidate({times_std_of_second});
    second.effect = "current_offset";
    result.named.push_back({second.effect, second.order});
    result.candidates.push_back(std::move(second));
    take_back_insignificant(result);
    return result.named.size();
  };
  EXPECT_EQ(named_of_group(5.0), 2U);
  EXPECT_EQ(named_of_group(1.0), 0U);
}

}  // namespace
}  // namespace flexspline::selection::selection_wald_test
