// An effect of the measured current that halves of the data cannot choose, as a delay: what likelihood and held-out
// experiments have to show so that it is named.
#include <gtest/gtest.h>

#include "host/engine/selection/deciding_method.hpp"

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

Resampling nothing_found() {
  Resampling resampling;
  resampling.subsamples = 100.0;
  return resampling;
}

TEST(EffectThatHalvesCannotChoose, IsNamedWhereItTakesOffMostOfTheErrorAndHeldOutDataConfirmIt) {
  EXPECT_TRUE(stands_alone(nothing_found(), delay(51.0, 0.89)));
}

TEST(EffectThatHalvesCannotChoose, IsNotNamedForLessThanHalfOfTheError) {
  EXPECT_FALSE(stands_alone(nothing_found(), delay(49.0, 0.70)));
}

TEST(EffectThatHalvesCannotChoose, IsNotNamedWithoutHeldOutDataThatConfirmIt) {
  EXPECT_FALSE(stands_alone(nothing_found(), delay(80.0, 0.90)));
  EXPECT_FALSE(stands_alone(nothing_found(), delay(80.0, std::nullopt)));
}

// The effort leads by 5 ms, which explains a share of what is above the noise. The model that the delay is compared
// with has that lag, so that little is left for the likelihood.
TEST(EffectThatHalvesCannotChoose, MayBeALagThatExplainsMostOfTheErrorAndOfThatOnHeldOutData) {
  Resampling leads = nothing_found();
  leads.lag_s = -5e-3;
  leads.lag_share = 0.6;
  EXPECT_TRUE(stands_alone(leads, delay(3.0, 0.70)));
  EXPECT_FALSE(stands_alone(leads, delay(3.0, 0.71)));
  leads.lag_share = 0.4;
  EXPECT_FALSE(stands_alone(leads, delay(3.0, 0.70)));
  // The current that is logged late is no effect of the catalogue.
  Resampling lags = nothing_found();
  lags.lag_s = 5e-3;
  lags.lag_share = 0.6;
  EXPECT_FALSE(stands_alone(lags, delay(3.0, 0.70)));
}

TEST(EffectThatHalvesCannotChoose, WithoutHeldOutDataALagThatExplainsMostNeedsAFifthOfTheLeftOutSquares) {
  Resampling leads = nothing_found();
  leads.lag_s = -5e-3;
  leads.lag_share = 0.6;
  EXPECT_TRUE(stands_alone(leads, delay(20.0, std::nullopt)));
  EXPECT_FALSE(stands_alone(leads, delay(19.9, std::nullopt)));
  leads.lag_share = 0.49;
  EXPECT_FALSE(stands_alone(leads, delay(80.0, std::nullopt)));
}

TEST(EffectThatHalvesCannotChoose, IsNotNamedWhereHalvesFindSomethingElse) {
  Resampling resampling = nothing_found();
  Resampling::FoundTerm found;
  found.group = {{"quadratic_drag", std::nullopt}};
  found.frequency = 0.7;
  resampling.found = {found};
  EXPECT_FALSE(stands_alone(resampling, delay(80.0, 0.70)));
}

}  // namespace
}  // namespace flexspline::selection::selection_unseen_by_halves_test
