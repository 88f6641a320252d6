// An effect of the measured current that halves of the data cannot choose, as a delay: what likelihood and held-out
// experiments have to show so that it is named.
#include <gtest/gtest.h>

#include "host/engine/selection/deciding_method.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection::selection_unseen_by_halves_test {
namespace {

// It takes off a share of the squared error on data left out, and leaves that part of the error on held-out
// experiments.
CandidateFit delay(double chi2_percent, std::optional<double> held_out_ratio) {
  CandidateFit candidate;
  candidate.model.entry = &catalogue::get("current_delay");
  candidate.gain.chi2_percent = chi2_percent;
  candidate.held_out_ratio = held_out_ratio;
  return candidate;
}

std::vector<CandidateFit> alone(double chi2_percent, std::optional<double> held_out_ratio) {
  std::vector<CandidateFit> one;
  one.push_back(delay(chi2_percent, held_out_ratio));
  return one;
}

Resampling nothing_found() {
  Resampling resampling;
  resampling.subsamples = 100.0;
  return resampling;
}

TEST(EffectThatHalvesCannotChoose, IsNamedWhereItTakesOffMostOfTheErrorAndHeldOutDataConfirmIt) {
  EXPECT_TRUE(stands_alone(nothing_found(), alone(51.0, 0.89)));
}

TEST(EffectThatHalvesCannotChoose, IsNotNamedForLessThanHalfOfTheError) {
  EXPECT_FALSE(stands_alone(nothing_found(), alone(49.0, 0.70)));
}

TEST(EffectThatHalvesCannotChoose, IsNotNamedWhereHeldOutDataDoNotConfirmIt) {
  EXPECT_FALSE(stands_alone(nothing_found(), alone(80.0, 0.90)));
}

// A limit of the current that they do not reach.
TEST(EffectThatHalvesCannotChoose, IsNotJudgedByHeldOutDataThatCannotShowIt) {
  std::vector<CandidateFit> candidates = alone(58.0, 0.996);
  EXPECT_FALSE(stands_alone(nothing_found(), candidates));
  candidates.front().shows_held_out = false;
  EXPECT_TRUE(stands_alone(nothing_found(), candidates));
}

TEST(EffectThatHalvesCannotChoose, WithoutHeldOutDataNoOtherEffectMayExplainAnyPart) {
  std::vector<CandidateFit> candidates = alone(58.0, std::nullopt);
  EXPECT_TRUE(stands_alone(nothing_found(), candidates));
  candidates.push_back(candidates.front());
  candidates.back().model.entry = &catalogue::get("torque_constant_saturation");
  candidates.back().gain.score = 2.0 * kPolicy.named_score;
  candidates.back().gain.chi2_percent = 4.9;
  EXPECT_TRUE(stands_alone(nothing_found(), candidates));
  candidates.back().gain.chi2_percent = 5.1;
  EXPECT_FALSE(stands_alone(nothing_found(), candidates));
  candidates.back().gain.score = 0.5 * kPolicy.named_score;
  EXPECT_TRUE(stands_alone(nothing_found(), candidates));
}

TEST(EffectThatHalvesCannotChoose, IsNotNamedWhereHalvesFindSomethingElse) {
  Resampling resampling = nothing_found();
  Resampling::FoundTerm found;
  found.group = {{"quadratic_drag", std::nullopt}};
  found.frequency = 0.7;
  resampling.found = {found};
  EXPECT_FALSE(stands_alone(resampling, alone(80.0, 0.70)));
}

}  // namespace
}  // namespace flexspline::selection::selection_unseen_by_halves_test
