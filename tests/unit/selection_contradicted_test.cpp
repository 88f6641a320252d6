// What halves of the data chose and the likelihood of all data speaks against is named only where held-out data confirm
// it.
#include <gtest/gtest.h>

#include "host/engine/selection/naming_rules.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection::selection_contradicted_test {
namespace {

// A balance whose left-out error is 1, and a candidate that makes it `error`.
SearchedBalance balance(std::string_view effect, double score, double error) {
  SearchedBalance motor;
  motor.search.base.left_out = {{100.0, 100.0}};
  CandidateFit candidate;
  candidate.model.entry = &catalogue::get(effect);
  candidate.gain.score = score;
  candidate.fit.left_out = {{100.0, 100.0 * error * error}};
  motor.candidates = {candidate};
  return motor;
}

Resampling::FoundTerm found(std::string_view effect, std::optional<double> held_out_ratio) {
  Resampling::FoundTerm term;
  term.group = {{std::string(effect), std::nullopt}};
  term.frequency = 0.8;
  term.held_out_ratio = held_out_ratio;
  return term;
}

TEST(Contradicted, WhereLikelihoodFallsAndTheLeftOutErrorRises) {
  const SearchedBalance motor = balance("gravity", -300.0, 1.06);
  EXPECT_TRUE(is_contradicted(found("gravity", 0.97), motor));
  EXPECT_TRUE(is_contradicted(found("gravity", std::nullopt), motor));
}

TEST(Contradicted, NotWhereHeldOutDataConfirmAFifthOfTheSquares) {
  const SearchedBalance motor = balance("gravity", -300.0, 1.06);
  EXPECT_FALSE(is_contradicted(found("gravity", 0.89), motor));
  EXPECT_TRUE(is_contradicted(found("gravity", 0.90), motor));
}

TEST(Contradicted, NotWhereEitherSignIsMissing) {
  EXPECT_FALSE(is_contradicted(found("gravity", 0.97), balance("gravity", -300.0, 0.99)));
  EXPECT_FALSE(is_contradicted(found("gravity", 0.97), balance("gravity", -kPolicy.named_score + 1.0, 1.06)));
  EXPECT_FALSE(is_contradicted(found("quadratic_drag", 0.97), balance("gravity", -300.0, 1.06)));
}

TEST(Contradicted, PreslidingIsNotJudgedAsLikelihoodLeavesOutReversals) {
  EXPECT_FALSE(is_contradicted(found("dahl_friction", 0.97), balance("dahl_friction", -300.0, 3.0)));
}

}  // namespace
}  // namespace flexspline::selection::selection_contradicted_test
