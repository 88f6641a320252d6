// Which of two effects of one order over the motor's angle is named where an error of the phase makes them alike.
#include <gtest/gtest.h>

#include "host/engine/selection/group_members.hpp"

namespace flexspline::selection::selection_likelier_waves_test {
namespace {

CandidateFit candidate(std::string_view effect, double order, double score) {
  CandidateFit fit;
  fit.model.entry = &catalogue::get(effect);
  fit.model.order = order;
  fit.gain.score = score;
  fit.gain.chi2_percent = 50.0;
  return fit;
}

// What is found after the likelihood of friction over the angle, and of a ripple, of order 4 is known.
std::vector<NamedEffect> found_with(double friction_score, double ripple_score, double ripple_order = 4.0) {
  Resampling resampling;
  resampling.found.push_back({.group = {{"angle_dependent_friction", 4.0}}, .frequency = 0.8});
  SearchedBalance motor;
  motor.candidates = {candidate("angle_dependent_friction", 4.0, friction_score),
                      candidate("torque_ripple", ripple_order, ripple_score)};
  take_likelier_waves(resampling, motor);
  return resampling.found.front().group;
}

TEST(LikelierWaves, AWaveIsTakenForFrictionOverTheAngleThatAnErrorOfItsPhaseLeaves) {
  const auto group = found_with(292.0, 1209.0);
  ASSERT_EQ(group.size(), 1U);
  EXPECT_EQ(group[0].effect, "torque_ripple");
  EXPECT_EQ(group[0].order, 4.0);
}

TEST(LikelierWaves, FrictionOverTheAngleThatIsLikelierStays) {
  const auto group = found_with(4467.0, 120.0);
  ASSERT_EQ(group.size(), 1U);
  EXPECT_EQ(group[0].effect, "angle_dependent_friction");
}

TEST(LikelierWaves, ThoseThatAreAboutAsLikelyAreNotDistinguished) {
  EXPECT_EQ(found_with(298.0, 306.0).size(), 2U);
  EXPECT_EQ(found_with(306.0, 298.0).size(), 2U);
}

TEST(LikelierWaves, OfAnotherOrderOrWithoutSignificanceSayNothing) {
  EXPECT_EQ(found_with(50.0, 900.0, 5.0)[0].effect, "angle_dependent_friction");
  EXPECT_EQ(found_with(1.0, 2.0)[0].effect, "angle_dependent_friction");
}

// The group of a ripple once a turn beside a weight of that score and share of chi-square.
std::size_t group_with_a_weight(double score, double chi2_percent) {
  Resampling resampling;
  resampling.found.push_back({.group = {{"torque_ripple", 1.0}}, .frequency = 0.8});
  SearchedBalance motor;
  CandidateFit weight = candidate("gravity", 1.0, score);
  weight.model.order.reset();
  weight.gain.chi2_percent = chi2_percent;
  motor.candidates = {candidate("torque_ripple", 1.0, 77.7332), weight};
  add_identical_effects(resampling, motor);
  return resampling.found.front().group.size();
}

TEST(IdenticalEffects, AreOneGroupAsAWeightAndARippleOnceATurnAreWithoutAGear) {
  EXPECT_EQ(group_with_a_weight(77.7332 + 1e-9, 50.0 - 1e-9), 2U);
}

TEST(IdenticalEffects, AreNotThoseThatAreOnlyAboutAsLikely) {
  EXPECT_EQ(group_with_a_weight(77.9, 50.0), 1U);
  EXPECT_EQ(group_with_a_weight(77.7332, 49.9), 1U);
}

}  // namespace
}  // namespace flexspline::selection::selection_likelier_waves_test
