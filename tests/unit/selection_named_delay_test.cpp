// Where a lag between effort and motion is named as a delay of the current.
#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/effort_timing.hpp"
#include "host/engine/estimation/modelled_current.hpp"
#include "host/engine/selection/named_delay.hpp"
#include "host/engine/selection/policy.hpp"
#include "tests/support/delayed_current.hpp"

namespace flexspline::selection::selection_named_delay_test {
namespace {

bool names_delay(const Diagnosis& result) {
  return result.named == std::vector<NamedEffect>{{"current_delay", std::nullopt}};
}

// Of that step alone, where nothing else is named.
bool is_named(double delay_s, double noise_a, double held_out_delay_s) {
  const data::Dataset dataset = tests::recorded_with_delay(delay_s, noise_a, held_out_delay_s);
  const auto base = estimation::identify(dataset, tests::model_of_delayed_axis(), {});
  estimation::take_modelled_current(base->prepared, base->terms);
  const RegressionProblem& data = base->data.front();
  SearchedBalance motor;
  motor.search = {&data, Eigen::VectorXd::Ones(data.rows()), {}};
  motor.search.base = cross_validate(data, base->terms, motor.search.keep);
  motor.candidates =
      rank_candidates(motor.search, [](const CandidateModel& m) { return m.entry->name() == "current_delay"; });
  motor.held_out = std::make_unique<HeldOut>(dataset, *base, estimation::Balance::motor, nullptr);
  Diagnosis result;
  name_delay(motor, {}, result);
  return names_delay(result);
}

bool is_named(double delay_s, double noise_a = 0.02) {
  return is_named(delay_s, noise_a, delay_s);
}

// By the closed form of a regression on one column: it takes (c'y)^2 / c'c off the squares y'y.
TEST(NamedDelay, ShareIsThatOfTheSquaresWhichTheColumnTakesOff) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise;
  const Eigen::Index rows = 400;
  const Eigen::VectorXd column = Eigen::VectorXd::NullaryExpr(rows, [&] { return noise(random); });
  const Eigen::VectorXd y = -0.003 * column + 0.005 * Eigen::VectorXd::NullaryExpr(rows, [&] { return noise(random); });
  const double value = column.dot(y) / column.squaredNorm();
  CrossValidatedFit fit;
  fit.theta = Eigen::VectorXd::Constant(1, value);
  fit.residual = y - value * column;
  const double variance = fit.residual.squaredNorm() / static_cast<double>(rows - 1);
  fit.std = Eigen::VectorXd::Constant(1, std::sqrt(variance / column.squaredNorm()));
  fit.root_weights = Eigen::VectorXd::Constant(rows, 1.0 / std::sqrt(variance));
  const Lag lag = lag_of(fit);
  EXPECT_EQ(lag.seconds, value);
  EXPECT_NEAR(lag.share, 1.0 - fit.residual.squaredNorm() / y.squaredNorm(), 1e-3);
  EXPECT_NEAR(lag.standard_errors, std::abs(value) / fit.std[0], 1e-9);
}

TEST(NamedDelay, IsNamedWhereTheEffortComesFirstAndTheErrorFalls) {
  EXPECT_TRUE(is_named(10e-3));
}

TEST(NamedDelay, IsNotNamedWhereNothingIsLate) {
  EXPECT_FALSE(is_named(0.0));
}

// A filter of the current, which is no delay of its own.
TEST(NamedDelay, IsNotNamedWhereTheEffortComesLast) {
  EXPECT_FALSE(is_named(-10e-3));
}

// The order in which columns are read.
TEST(NamedDelay, IsNotNamedWithinASampleAndAHalf) {
  EXPECT_FALSE(is_named(tests::kDelayedSampleS));
}

TEST(NamedDelay, IsNotNamedWhereNoiseHidesIt) {
  EXPECT_FALSE(is_named(10e-3, 10.0));
}

TEST(NamedDelay, IsNotNamedWhereExperimentsThatAreHeldOutContradict) {
  EXPECT_FALSE(is_named(10e-3, 0.02, -10e-3));
}

// Its slope is the lag's column: the interval of the delay would hold anything.
TEST(NamedDelay, InTheModelLeavesNoLagToWidenItsInterval) {
  const data::Dataset dataset = tests::recorded_with_delay(8e-3, 0.2, 8e-3);
  model::Model model = tests::model_of_delayed_axis();
  EXPECT_TRUE(estimation::effort_lag(*estimation::identify(dataset, model, {})));
  model.effects.push_back(catalogue::blank_effect(catalogue::get("current_delay"), data::Axis::rotary));
  EXPECT_FALSE(estimation::effort_lag(*estimation::identify(dataset, model, {})));
}

}  // namespace
}  // namespace flexspline::selection::selection_named_delay_test
