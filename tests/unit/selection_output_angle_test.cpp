// Over a part of an output turn a wave of its angle is an offset and a slope: halves of the data that chose it do not
// show that it is one.
#include <gtest/gtest.h>

#include <utility>
#include <vector>

#include "host/engine/selection/naming_rules.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection::selection_output_angle_test {
namespace {

// A balance with one candidate of that score, which takes off a share of the squared error. No noise is known.
SearchedBalance balance(std::string_view effect, double score, double percent) {
  SearchedBalance motor;
  motor.search.base.left_out = {{100.0, 100.0}};
  CandidateFit candidate;
  candidate.model.entry = &catalogue::get(effect);
  candidate.gain.score = score;
  candidate.gain.chi2_percent = percent;
  motor.candidates = {candidate};
  return motor;
}

// All subsamples chose these; the candidate is the first of them.
bool is_stated_of(const std::vector<NamedEffect>& group, double score, std::optional<double> held_out_ratio,
                  double percent) {
  Resampling resampling;
  resampling.subsamples = 100.0;
  Resampling::FoundTerm found;
  found.group = group;
  found.frequency = 1.0;
  found.held_out_ratio = held_out_ratio;
  SearchedBalance motor = balance(group.front().effect, score, percent);
  motor.candidates.front().model.order = group.front().order;
  return may_be_stated(resampling, found, motor);
}
// All subsamples chose it, or could not distinguish it from `other`.
bool is_stated(std::string_view effect, double score, std::optional<double> held_out_ratio, double percent = 10.0,
               std::string_view other = {}) {
  std::vector<NamedEffect> group = {{std::string(effect), std::nullopt}};
  if (!other.empty()) group.push_back({std::string(other), 1.0});
  return is_stated_of(group, score, held_out_ratio, percent);
}

TEST(OutputAngle, AnEffectOfItNeedsALikelihoodThatIsSignificant) {
  EXPECT_TRUE(is_stated("gravity", kPolicy.named_score + 1.0, std::nullopt));
  EXPECT_FALSE(is_stated("gravity", kPolicy.named_score - 1.0, std::nullopt));
}

// A cable that drags a little with the angle looks like a weight.
TEST(OutputAngle, ASmallEffectIsNotStatedWhereTheNoiseIsNotKnown) {
  EXPECT_TRUE(is_stated("gravity", kPolicy.named_score + 30.0, std::nullopt, 5.0));
  EXPECT_FALSE(is_stated("gravity", kPolicy.named_score + 30.0, std::nullopt, 4.9));
}

TEST(OutputAngle, OrHalfOfTheSquaredHeldOutError) {
  EXPECT_TRUE(is_stated("gravity", 0.0, 0.70));
  EXPECT_FALSE(is_stated("gravity", 0.0, 0.71));
}

TEST(OutputAngle, FrictionOverATurnOfTheOutputNeedsAsMuchAndOverOneOfTheMotorDoesNot) {
  for (const auto& [order, is_enough] : {std::pair{0.02, false}, {1.0, true}})
    EXPECT_EQ(is_stated_of({{"angle_dependent_friction", order}}, kPolicy.named_score + 30.0, 0.97, 2.6), is_enough);
  EXPECT_TRUE(is_stated_of({{"angle_dependent_friction", 0.02}}, kPolicy.named_score + 30.0, 0.97, 5.1));
}

TEST(OutputAngle, OtherEffectsAreStatedByTheirFrequencyAlone) {
  EXPECT_TRUE(is_stated("quadratic_drag", 0.0, std::nullopt));
  EXPECT_TRUE(is_stated("torque_ripple", 0.0, 0.99));
}

// Of a drive without a gear a ripple of the motor's turn is the same wave.
TEST(OutputAngle, WhatCannotBeDistinguishedFromAnEffectOfItNeedsAsMuch) {
  EXPECT_FALSE(is_stated("gravity", 0.0, 0.82, 10.0, "torque_ripple"));
  EXPECT_FALSE(is_stated("torque_ripple", 0.0, 0.82, 10.0, "gravity"));
  EXPECT_TRUE(is_stated("gravity", 0.0, 0.70, 10.0, "torque_ripple"));
}

}  // namespace
}  // namespace flexspline::selection::selection_output_angle_test
