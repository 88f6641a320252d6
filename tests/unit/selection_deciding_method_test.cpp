// Which method decides on the motor's balance, rule by rule.
#include <gtest/gtest.h>

#include <cmath>

#include "host/engine/selection/deciding_method.hpp"
#include "host/engine/selection/policy.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::selection_deciding_method_test {
namespace {

// A balance with a known noise of 1, whose error is 10, and 5 with its one candidate.
SearchedBalance motor_with(std::string_view effect) {
  SearchedBalance motor;
  motor.floor.rmse = 1.0;
  CandidateFit candidate;
  candidate.model.entry = &catalogue::get(effect);
  candidate.gain.score = kPolicy.named_score + 100.0;
  candidate.gain.chi2_percent = 75.0;
  candidate.fit.residual = Eigen::VectorXd::Constant(100, 5.0);
  candidate.fit.root_weights = Eigen::VectorXd::Ones(100);
  motor.search.base.residual = Eigen::VectorXd::Constant(100, 10.0);
  motor.search.base.root_weights = Eigen::VectorXd::Ones(100);
  motor.candidates = {candidate};
  return motor;
}

// The same, but with its candidate the error is 1.2: hardly above the noise.
SearchedBalance motor_near_noise_with(std::string_view effect) {
  SearchedBalance motor = motor_with(effect);
  motor.candidates.front().fit.residual.setConstant(1.2);
  return motor;
}

Resampling halves_that_chose(std::string_view effect, double frequency) {
  Resampling resampling;
  resampling.subsamples = 100.0;
  resampling.support = {{std::string(effect), std::nullopt, frequency}};
  return resampling;
}

Resampling::FoundTerm found(std::string_view effect) {
  Resampling::FoundTerm term;
  term.group = {{std::string(effect), std::nullopt}};
  term.frequency = 0.8;
  term.share_percent = 40.0;
  return term;
}

TEST(DecidingMethod, IsLikelihoodWhereNothingCanBeResampled) {
  EXPECT_EQ(deciding_method(Resampling{}, motor_with("quadratic_drag")), Method::likelihood);
  Resampling too_little;
  too_little.too_little = true;
  EXPECT_EQ(deciding_method(too_little, motor_with("quadratic_drag")), Method::resampling);
}

TEST(DecidingMethod, IsResamplingWhereLikelihoodNamesNothing) {
  SearchedBalance motor = motor_with("quadratic_drag");
  motor.candidates.clear();
  EXPECT_EQ(deciding_method(halves_that_chose("quadratic_drag", 0.0), motor), Method::resampling);
}

// 100 samples of which each leaves an error of 1.2 where they are fitted.
TEST(DecidingMethod, IsResamplingWhereTheModelDoesNotHoldOnDataLeftOut) {
  SearchedBalance motor = motor_near_noise_with("quadratic_drag");
  const Resampling chosen = halves_that_chose("quadratic_drag", 0.9);
  motor.candidates.front().fit.left_out = {{100.0, 100.0 * 1.44 * 2.9}};
  EXPECT_EQ(deciding_method(chosen, motor), Method::likelihood);
  motor.candidates.front().fit.left_out = {{100.0, 100.0 * 1.44 * 3.1}};
  EXPECT_EQ(deciding_method(chosen, motor), Method::resampling);
}

TEST(DecidingMethod, IsResamplingForPreslidingAsLikelihoodLeavesOutReversals) {
  EXPECT_EQ(deciding_method(halves_that_chose("dahl_friction", 1.0), motor_with("dahl_friction")), Method::resampling);
}

TEST(DecidingMethod, IsLikelihoodForWhatHalvesCannotChooseAndExplainsNearlyAll) {
  SearchedBalance motor = motor_with("current_saturation");
  Resampling nothing;
  nothing.subsamples = 100.0;
  motor.candidates.front().gain.chi2_percent = 100.0 * kPolicy.most_share - 1.0;
  EXPECT_EQ(deciding_method(nothing, motor), Method::resampling);
  motor.candidates.front().gain.chi2_percent = kPolicy.nearly_all_percent + 0.5;
  EXPECT_EQ(deciding_method(nothing, motor), Method::likelihood);
}

TEST(DecidingMethod, IsResamplingWhereHalvesFoundOtherEffectsOnly) {
  SearchedBalance motor = motor_near_noise_with("quadratic_drag");
  Resampling others = halves_that_chose("quadratic_drag", 0.9);
  EXPECT_EQ(deciding_method(others, motor), Method::likelihood);
  others.found = {found("coulomb_asymmetry")};
  EXPECT_EQ(deciding_method(others, motor), Method::resampling);
}

// The likelier one has a state, which halves are not offered, and the other one is a special case of it.
TEST(DecidingMethod, IsLikelihoodForALawWithMemoryThatContainsWhatHalvesFound) {
  SearchedBalance motor = motor_with("driving_dependent_loss");
  motor.candidates.push_back(motor.candidates.front());
  CandidateFit& special = motor.candidates.back();
  special.model.entry = &catalogue::get("load_dependent_friction");
  special.gain.score -= kPolicy.confounded_margin + 1.0;
  Resampling halves = halves_that_chose("load_dependent_friction", 0.9);
  halves.found = {found("load_dependent_friction")};
  EXPECT_EQ(deciding_method(halves, motor), Method::likelihood);
  halves.found.push_back(found("coulomb_asymmetry"));
  EXPECT_EQ(deciding_method(halves, motor), Method::resampling) << "it does not contain the other one";
  halves.found.pop_back();
  special.gain.score += 2.0;
  EXPECT_EQ(deciding_method(halves, motor), Method::resampling) << "they are about as likely";
}

TEST(DecidingMethod, IsResamplingWhereHalvesDidNotChooseTheLikeliestUnlessMostAbstained) {
  SearchedBalance motor = motor_near_noise_with("quadratic_drag");
  Resampling few = halves_that_chose("quadratic_drag", kPolicy.named_frequency - 0.1);
  EXPECT_EQ(deciding_method(few, motor), Method::resampling);
  few.abstained = 100.0 * kPolicy.most_abstaining_to_judge + 1.0;
  EXPECT_EQ(deciding_method(few, motor), Method::likelihood);
}

TEST(DecidingMethod, IsResamplingWhereANoisyTorqueMayBeExplained) {
  SearchedBalance motor = motor_near_noise_with("load_dependent_friction");
  Resampling resampling = halves_that_chose("load_dependent_friction", 0.9);
  EXPECT_EQ(deciding_method(resampling, motor), Method::likelihood);
  resampling.torque_has_noise = true;
  EXPECT_EQ(deciding_method(resampling, motor), Method::resampling);
}

TEST(DecidingMethod, IsLikelihoodWhereItsEffectLeavesTheNoiseAndResamplingWhereStructureRemains) {
  SearchedBalance motor = motor_with("quadratic_drag");
  const Resampling resampling = halves_that_chose("quadratic_drag", 0.9);
  EXPECT_EQ(deciding_method(resampling, motor), Method::resampling);
  motor.candidates.front().fit.residual.setConstant(kPolicy.at_floor - 0.01);
  EXPECT_EQ(deciding_method(resampling, motor), Method::likelihood);
}

// Records of an axis with friction and inertia.
data::Dataset records(int count) {
  data::Dataset dataset;
  for (int k = 0; k < count; ++k)
    dataset.experiments.push_back(
        tests::written_experiment(std::to_string(k), 2e-3, 2000, [&](double t, data::Experiment& e) {
          const double rate = kTurn * (0.4 + 0.1 * k), w = 30.0 * rate * std::cos(rate * t);
          e[data::Column::motor_position].push_back(30.0 * std::sin(rate * t));
          e[data::Column::motor_torque].push_back(-3e-3 * rate * rate * std::sin(rate * t) + 1e-3 * w +
                                                  std::copysign(0.05, w));
        }));
  return dataset;
}

// Where the noise is not known, white noise hides small other causes that the effect resembles.
TEST(DecidingMethod, OfUnknownNoiseIsLikelihoodOnlyForAnEffectThatMattersInThreeRecordsThatLeaveWhiteNoise) {
  Resampling resampling = halves_that_chose("quadratic_drag", 0.9);
  const auto method = [&](int count, double percent) {
    const data::Dataset dataset = records(count);
    const auto identified = estimation::identify(dataset, tests::plain_model(), {});
    SearchedBalance motor = motor_with("quadratic_drag");
    motor.floor.rmse.reset();
    motor.search.data = &identified->data.front();
    motor.candidates.front().gain.chi2_percent = percent;
    return deciding_method(resampling, motor);
  };
  resampling.von_neumann_ratio = 1.0;
  EXPECT_EQ(method(3, 5.0), Method::likelihood);
  EXPECT_EQ(method(3, 4.9), Method::resampling);
  EXPECT_EQ(method(2, 5.0), Method::resampling);
  resampling.von_neumann_ratio = 0.9;
  EXPECT_EQ(method(3, 5.0), Method::resampling);
}

TEST(DecidingMethod, LastRuleAlwaysApplies) {
  const Resampling resampling;
  const SearchedBalance motor;
  EXPECT_TRUE(deciding_rules().back().applies({resampling, motor}));
}

}  // namespace
}  // namespace flexspline::selection::selection_deciding_method_test
