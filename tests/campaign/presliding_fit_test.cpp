// A law of presliding that is named comes with its values from all samples: friction that is written down as Dahl's.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/engine/selection/diagnosis.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::selection::presliding_fit_test {
namespace {

using data::Column;

constexpr double kTravel = 0.9, kFriction = 0.05;  // rad, N m

// An axis that swings to and fro by so many rad, with a presliding of this travel.
data::Dataset axis(double amplitude_rad = 8.0, double travel_rad = kTravel) {
  data::Dataset dataset;
  std::mt19937_64 random(4);
  std::normal_distribution<double> noise(0.0, 5e-4);
  for (const double hz : {0.3, 0.5, 0.8}) {
    double state = -1.0;
    dataset.experiments.push_back(
        tests::written_experiment(std::to_string(hz), 2e-3, 6000, [&](double t, data::Experiment& e) {
          const double rate = kTurn * hz, q = -amplitude_rad * std::cos(rate * t),
                       w = amplitude_rad * rate * std::sin(rate * t);
          const double end = w > 0.0 ? 1.0 : -1.0;
          state = end + (state - end) * std::exp(-2e-3 * std::abs(w) / travel_rad);
          e[Column::motor_position].push_back(q);
          e[Column::motor_torque].push_back(-1e-4 * rate * rate * q + 1e-3 * w + kFriction * state + noise(random));
        }));
  }
  return dataset;
}

TEST(PreslidingFit, HasTheTravelAndTheFrictionOfAllSamplesAndTheErrorsThatItTakesOffThere) {
  const Diagnosis found = diagnose(axis(), tests::plain_model(), {});
  ASSERT_EQ(found.named.size(), 1U);
  const auto law = std::ranges::find(found.candidates, found.named.front().effect, &Candidate::effect);
  ASSERT_NE(law, found.candidates.end());
  ASSERT_EQ(law->effect, "dahl_friction");
  EXPECT_TRUE(law->admissible);
  EXPECT_NE(law->note.find("around reversals"), std::string::npos);
  for (const estimation::Estimate& e : law->parameters) {
    const double truth = e.parameter == "torque" ? kFriction : kTravel;
    if (e.parameter == "torque" || e.parameter == "presliding") {
      EXPECT_NEAR(e.value, truth, (e.parameter == "torque" ? 0.01 : 0.05) * truth);
    }
  }
  EXPECT_LT(law->rmse_cv_after, 0.3 * law->rmse_cv_before);
  EXPECT_GT(law->chi2_decrease_percent, 90.0);
  ASSERT_TRUE(law->evidence.has_value());
}

TEST(PreslidingFit, WhoseTravelIsThatOfTheMotionBetweenTwoSamplesIsNeitherNamedNorTheVerdictOfAMissingEffect) {
  const Diagnosis found = diagnose(axis(100.0, 0.02), tests::plain_model(), {});
  EXPECT_TRUE(found.named.empty());
  EXPECT_NE(found.verdict, Verdict::missing_effect);
  EXPECT_FALSE(found.recovered_percent);
  const auto law = std::ranges::find(found.candidates, "dahl_friction", &Candidate::effect);
  ASSERT_NE(law, found.candidates.end());
  EXPECT_NE(law->note.find("around reversals"), std::string::npos) << "it was named until it was fitted with them";
  EXPECT_TRUE(std::ranges::any_of(
      found.possible, [](const PossibleEffect& possible) { return possible.group.front().effect == "dahl_friction"; }));
}

}  // namespace
}  // namespace flexspline::selection::presliding_fit_test
