// A weight is named where the data show that its period is a turn of the output: torques that are written down, along
// strokes of several lengths.
#include <gtest/gtest.h>

#include <cmath>
#include <random>
#include <stdexcept>
#include <vector>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/named_on_balances.hpp"
#include "host/engine/selection/output_angle_period.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::selection_output_angle_period_test {
namespace {

using data::Column;

// The candidates `gravity` and `torque_ripple` of order 1 of an axis without a gear that moves `stroke_rad` to either
// side, and on which 0.05 N m sin(waves * angle) acts.
std::vector<CandidateFit> weight_and_ripple(double stroke_rad, double waves) {
  std::mt19937_64 random(7);
  std::normal_distribution<double> noise(0.0, 1.0);
  const data::Dataset dataset =
      tests::written_dataset({0.2, 0.3, 0.5}, 2e-3, 6000, [&](double hz, double t, data::Experiment& e) {
        const double rate = kTurn * hz, q = stroke_rad * std::sin(rate * t), w = stroke_rad * rate * std::cos(rate * t);
        e[Column::motor_position].push_back(q);
        e[Column::motor_torque].push_back(-1e-4 * rate * rate * q + 1e-3 * w + 0.02 * (w > 0.0 ? 1.0 : -1.0) +
                                          0.05 * std::sin(waves * q + 0.4) + 2e-3 * noise(random));
      });
  model::Model model = tests::plain_model();
  model.drive.gear_ratio.value = 1.0;
  const auto identified = estimation::identify(dataset, model, {});
  const RegressionProblem& data = identified->data.front();
  BalanceSearch search{&data, Eigen::VectorXd::Ones(data.rows()), {}};
  search.base = cross_validate(data, identified->terms, search.keep);
  std::vector<CandidateFit> candidates = rank_candidates(search, [](const CandidateModel& m) {
    return m.entry->name() == "gravity" || (m.entry->name() == "torque_ripple" && m.order == 1.0);
  });
  check_output_angle_period(search, candidates);
  return candidates;
}

CandidateFit weight(double stroke_rad, double waves) {
  for (CandidateFit& candidate : weight_and_ripple(stroke_rad, waves))
    if (candidate.model.entry->name() == "gravity") return std::move(candidate);
  throw std::logic_error("no weight is tried");
}

TEST(OutputAnglePeriod, IsCertainWhereAWeightTurnsOverALargePartOfATurn) {
  const CandidateFit candidate = weight(2.0, 1.0);
  EXPECT_FALSE(candidate.has_uncertain_period);
  EXPECT_TRUE(passes(candidate)) << candidate.why_not;
}

TEST(OutputAnglePeriod, IsUncertainOfAWaveWithAShorterPeriod) {
  for (const double waves : {2.0, 4.0, 8.0}) {
    const CandidateFit candidate = weight(0.25, waves);
    EXPECT_TRUE(candidate.has_uncertain_period) << waves;
    EXPECT_NE(candidate.why_not.find("half its period explains no less"), std::string::npos) << candidate.why_not;
  }
}

TEST(OutputAnglePeriod, IsUncertainOfAWeightThatHardlyTurns) {
  const CandidateFit candidate = weight(0.1, 1.0);
  EXPECT_TRUE(candidate.has_uncertain_period);
  EXPECT_NE(candidate.why_not.find("move over a larger part of a turn"), std::string::npos) << candidate.why_not;
}

// It is named with the offset then, as one group.
TEST(OutputAnglePeriod, IsNotAskedForWhereTheTravelMakesAnOffsetOfTheWave) {
  const CandidateFit candidate = weight(0.002, 1.0);
  EXPECT_FALSE(candidate.has_uncertain_period);
  EXPECT_TRUE(passes(candidate)) << candidate.why_not;
}

// Else a ripple would be named in the place of the weight.
TEST(OutputAnglePeriod, IsUncertainOfARippleThatIsTheSameFunctionWithoutAGear) {
  const std::vector<CandidateFit> candidates = weight_and_ripple(0.25, 2.0);
  ASSERT_EQ(candidates.size(), 2U);
  for (const CandidateFit& candidate : candidates) {
    EXPECT_TRUE(candidate.has_uncertain_period) << candidate.model.entry->name();
    EXPECT_FALSE(candidate.admissible);
  }
}

TEST(OutputAnglePeriod, WhereUncertainIsListedAsPossibleOnceIfThePartOfTheErrorIsATerms) {
  std::vector<SearchedBalance> all(1);
  all.front().candidates = weight_and_ripple(0.1, 1.0);
  Diagnosis result;
  result.named = {{"torque_ripple", 1.0}};
  list_waves_of_uncertain_period(all, result);
  list_waves_of_uncertain_period(all, result);
  ASSERT_EQ(result.possible.size(), 1U);
  EXPECT_EQ(result.possible.front().group.front().effect, "gravity");
  EXPECT_FALSE(result.possible.front().why_not.empty());
  for (CandidateFit& candidate : all.front().candidates) candidate.gain.chi2_percent = 100.0 * kPolicy.line_share - 0.1;
  Diagnosis small;
  list_waves_of_uncertain_period(all, small);
  EXPECT_TRUE(small.possible.empty());
}

}  // namespace
}  // namespace flexspline::selection::selection_output_angle_period_test
