// Each rule that an effect found by halves of the data must keep, and the reason that the user gets where it does not.
#include <gtest/gtest.h>

#include <set>

#include "host/engine/selection/named_by_resampling.hpp"
#include "host/engine/selection/naming_rules.hpp"
#include "host/engine/selection/policy.hpp"

namespace flexspline::selection::selection_naming_rules_test {
namespace {

// Found in nine of ten halves, with a tenth off the held-out error: it keeps every rule.
Resampling::FoundTerm found(std::vector<std::string> effects) {
  Resampling::FoundTerm term;
  for (std::string& effect : effects) term.group.push_back({std::move(effect), std::nullopt});
  term.frequency = 0.95;
  term.share_percent = 40.0;
  term.held_out_ratio = 0.85;
  return term;
}

// A balance of known noise, whose error is far above it.
SearchedBalance motor() {
  SearchedBalance balance;
  balance.floor.rmse = 1.0;
  balance.search.base.residual = Eigen::VectorXd::Constant(100, 10.0);
  balance.search.base.root_weights = Eigen::VectorXd::Ones(100);
  return balance;
}

// The reason why `term` is not named; empty: it is named.
std::string why_not(const Resampling::FoundTerm& term, const std::vector<NamedEffect>& before = {},
                    bool is_behind_group = false) {
  Resampling resampling;
  resampling.subsamples = 100.0;
  const SearchedBalance balance = motor();
  const FoundOnMotor effect{term, resampling, balance, before, is_behind_group};
  const NamingRule* rule = broken_rule(effect);
  return rule ? rule->why_not(effect) : "";
}

const std::vector<NamedEffect> kBefore = {{"coulomb_asymmetry", std::nullopt}};

TEST(NamingRules, NameWhatMostHalvesChoseAndHeldOutDataConfirm) {
  EXPECT_EQ(why_not(found({"quadratic_drag"})), "");
  EXPECT_EQ(why_not(found({"quadratic_drag"}), kBefore), "");
}

TEST(NamingRules, RefuseWhatRaisesTheHeldOutError) {
  Resampling::FoundTerm term = found({"quadratic_drag"});
  term.held_out_ratio = 1.2;
  term.refused_by_holdout = true;
  EXPECT_EQ(why_not(term), "the error on experiments that are held out rises by 20.0 % with it");
}

TEST(NamingRules, RefuseWhatFewHalvesChoseWithoutConfirmation) {
  Resampling::FoundTerm term = found({"quadratic_drag"});
  term.frequency = kPolicy.min_frequency_of_all - 0.01;
  EXPECT_EQ(why_not(term), "");
  term.held_out_ratio = 0.99;
  EXPECT_EQ(why_not(term), "the squared error on experiments that are held out falls by 2.0 % only");
}

// Held-out motions may show what the fitted ones hide in their noise.
TEST(NamingRules, NameAtAKnownFloorWhatHalvesTheSquaredHeldOutError) {
  SearchedBalance at_floor = motor();
  at_floor.search.base.residual.setConstant(1.0);
  Resampling resampling;
  resampling.subsamples = 100.0;
  Resampling::FoundTerm term = found({"quadratic_drag"});
  term.held_out_ratio = 0.70;
  EXPECT_TRUE(may_be_stated(resampling, term, at_floor));
  term.held_out_ratio = 0.72;
  EXPECT_FALSE(may_be_stated(resampling, term, at_floor));
}

TEST(NamingRules, RefuseASecondChoiceWithoutConfirmation) {
  Resampling::FoundTerm term = found({"quadratic_drag"});
  term.is_second_choice = true;
  EXPECT_EQ(why_not(term), "");
  term.held_out_ratio.reset();
  EXPECT_NE(why_not(term).find("only after another one was refused"), std::string::npos);
}

// Stick phases look like presliding in some halves.
TEST(NamingRules, RefusePreslidingThatFewerThanNineOfTenHalvesChoseUnlessHeldOutDataConfirmIt) {
  Resampling::FoundTerm term = found({"dahl_friction"});
  term.frequency = 0.7;
  EXPECT_EQ(why_not(term), "");
  term.held_out_ratio.reset();
  EXPECT_EQ(why_not(term), "without experiments that are held out 90 of 100 are needed");
  term.held_out_ratio = 0.99;
  EXPECT_EQ(why_not(term), "the squared error on experiments that are held out falls by 2.0 % only");
  term.frequency = kPolicy.certain_frequency;
  EXPECT_EQ(why_not(term), "");
}

TEST(NamingRules, RefuseAGroupBehindANameAndAnythingBehindAGroup) {
  EXPECT_EQ(why_not(found({"quadratic_drag", "power_law_friction"})), "");
  EXPECT_NE(why_not(found({"quadratic_drag", "power_law_friction"}), kBefore).find("cannot be distinguished"),
            std::string::npos);
  EXPECT_NE(why_not(found({"quadratic_drag"}), kBefore, true).find("a group of effects explains more"),
            std::string::npos);
}

TEST(NamingRules, RefuseASmallShareBehindANameUnlessHeldOutDataConfirmItStrongly) {
  Resampling::FoundTerm term = found({"quadratic_drag"});
  term.share_percent = 4.9;
  EXPECT_EQ(why_not(term), "");
  EXPECT_EQ(why_not(term, kBefore), "");
  term.held_out_ratio = 0.95;
  EXPECT_NE(why_not(term, kBefore).find("4.9 % of the squared error"), std::string::npos);
}

TEST(NamingRules, RefuseWhatIsNotCertainUnlessHeldOutDataConfirmIt) {
  Resampling::FoundTerm term = found({"quadratic_drag"});
  term.frequency = kPolicy.certain_frequency - 0.01;
  term.held_out_ratio = 0.99;
  EXPECT_EQ(why_not(term), "");
  EXPECT_EQ(why_not(term, kBefore), "the squared error on experiments that are held out falls by 2.0 % only");
  term.frequency = kPolicy.unconfirmed_frequency - 0.01;
  EXPECT_EQ(why_not(term), "the squared error on experiments that are held out falls by 2.0 % only");
  term.held_out_ratio = 0.97;
  EXPECT_EQ(why_not(term), "");
  term.held_out_ratio.reset();
  EXPECT_EQ(why_not(term), "");
  term.held_out_ratio = 0.99;
  term.frequency = kPolicy.certain_frequency;
  EXPECT_EQ(why_not(term, kBefore), "");
}

TEST(NamingRules, HaveNamesOfTheirOwn) {
  std::set<std::string_view> names;
  for (const NamingRule& rule : naming_rules()) EXPECT_TRUE(names.insert(rule.name).second) << rule.name;
}

// The reasons come from the rules themselves, so that none can be given for an effect that keeps them all.
TEST(NamingRules, GiveTheirReasonsToThePossibleEffects) {
  Resampling resampling;
  resampling.subsamples = 100.0;
  resampling.found = {found({"coulomb_asymmetry"}), found({"quadratic_drag"})};
  resampling.found.back().refused_by_holdout = true;
  resampling.found.back().held_out_ratio = 1.5;
  Diagnosis result;
  result.resampling = resampling;
  SearchedBalance balance = motor();
  name_stable(balance, result);
  ASSERT_EQ(result.named, kBefore);
  ASSERT_EQ(result.possible.size(), 1u);
  EXPECT_EQ(result.possible.front().group.front().effect, "quadratic_drag");
  EXPECT_EQ(result.possible.front().why_not, "the error on experiments that are held out rises by 50.0 % with it");
}

TEST(UnknownStructure, IsCertainWhereHeldOutDataConfirmItOrNearlyAllHalvesChoseIt) {
  Resampling::FoundTerm term = found({});
  term.held_out_ratio.reset();
  term.frequency = 0.95;
  EXPECT_TRUE(term.is_unknown_structure());
  term.frequency = 0.8;
  EXPECT_FALSE(term.is_unknown_structure());
  term.held_out_ratio = 0.93;  // squared 0.86
  EXPECT_TRUE(term.is_unknown_structure());
  term.held_out_ratio = 0.96;
  EXPECT_FALSE(term.is_unknown_structure());
  term.held_out_ratio = 0.5;
  term.refused_by_holdout = true;
  EXPECT_FALSE(term.is_unknown_structure());
  EXPECT_FALSE(found({"quadratic_drag"}).is_unknown_structure());
}

}  // namespace
}  // namespace flexspline::selection::selection_naming_rules_test
