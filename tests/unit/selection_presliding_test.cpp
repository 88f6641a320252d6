// A law of presliding, added to a model of Coulomb friction, on a motion and a torque that are written down.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/engine/estimation/identify.hpp"
#include "host/engine/selection/add.hpp"
#include "host/engine/selection/candidate_tables.hpp"
#include "host/engine/selection/presliding.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/swinging_axis.hpp"

namespace flexspline::selection::selection_presliding_test {
namespace {

using data::Column;
using estimation::Balance;

constexpr double kTravel_rad = 0.2, kDry_nm = tests::kSwingingDry_nm, kNoise_nm = tests::kSwingingNoise_nm;

data::Dataset swinging() {
  return tests::swinging_axis(kTravel_rad);
}

TEST(PreslidingLaw, ThatIsAddedIsFittedAroundReversalsAndTakesTheErrorThereToTheNoise) {
  const data::Dataset dataset = swinging();
  const Addition added = add(dataset, tests::plain_model(), "dahl_friction", {});
  EXPECT_GT(added.before.rmse_fit, 10.0 * added.after.rmse_fit);
  EXPECT_LT(added.after.rmse_fit, 1.5 * kNoise_nm);
  ASSERT_FALSE(added.warnings.empty());
  EXPECT_NE(added.warnings.back().find("around reversals of the motor"), std::string::npos);
  std::size_t compared = 0;
  for (const estimation::Estimate& e : added.estimates) {
    if (e.effect != "dahl_friction") continue;
    const double truth = e.parameter == "presliding" ? kTravel_rad : kDry_nm;
    EXPECT_NEAR(e.value, truth, 0.03 * truth) << e.parameter;
    ++compared;
  }
  EXPECT_EQ(compared, 2u);
}

TEST(PreslidingLaw, ThatIsAddedWithoutAMaskHasNoNoteOnReversalsAsAllModelsAreJudgedThere) {
  const Addition added = add(swinging(), tests::plain_model(), "dahl_friction", {std::nullopt, false});
  EXPECT_GT(added.before.rmse_fit, 10.0 * added.after.rmse_fit);
  for (const std::string& warning : added.warnings)
    EXPECT_EQ(warning.find("around reversals of the motor"), std::string::npos) << warning;
}

TEST(PreslidingLaw, KeepsTheSamplesAroundReversalsOfTheMotorThatAModelOfVelocityAloneMasks) {
  const data::Dataset dataset = swinging();
  const std::vector<const data::Experiment*> all = {&dataset.experiments[0], &dataset.experiments[1]};
  model::Model with = tests::plain_model();
  for (model::Effect& effect : with.effects)
    if (effect.type == "coulomb_friction") effect = catalogue::blank_effect(catalogue::get("dahl_friction"), {});
  const auto masked = [&](const model::Model& model) {
    std::size_t sum = 0;
    const estimation::PreparedData prepared = estimation::prepare(all, model, {});
    for (const estimation::Record& r : prepared.records) sum += r.rows[estimation::index(Balance::motor)].masked;
    return sum;
  };
  EXPECT_GT(masked(tests::plain_model()), 0u);
  EXPECT_EQ(masked(with), 0u);
}

TEST(PreslidingLaw, IsSearchedUpToAQuarterOfTheUsualStrokeThoughNoiseMakesManyTinyOnes) {
  data::Dataset dataset = swinging();
  std::mt19937_64 random(2);
  std::normal_distribution<double> noise(0.0, 1e-3);
  for (data::Experiment& e : dataset.experiments)
    for (double& q : e[Column::motor_position]) q += noise(random);
  const estimation::PreparedData prepared =
      estimation::prepare({&dataset.experiments[0], &dataset.experiments[1]}, tests::plain_model(), {});
  const std::vector<double> travels = presliding_travels(prepared, kPolicy);
  ASSERT_FALSE(travels.empty());
  EXPECT_LT(travels.front(), 0.5 * kTravel_rad);
  EXPECT_NEAR(travels.back(), std::min(kPolicy.longest_presliding, 0.25 * 6.0), 0.02);
}

// The same strokes with dry friction alone, whose axis sticks at each reversal until the torque has passed from one
// limit of friction to the other.
data::Dataset sticking() {
  constexpr double kStuck_s = 0.03;
  std::mt19937_64 random(3);
  std::normal_distribution<double> noise(0.0, kNoise_nm);
  data::Dataset dataset;
  for (const double frequency_hz : {0.21, 0.34}) {
    const double rate = kTurn * frequency_hz, half_s = 0.5 / frequency_hz;
    dataset.experiments.push_back(
        tests::written_experiment(frequency_hz < 0.3 ? "slow" : "fast", 2e-3, 6000, [&](double t, data::Experiment& e) {
          const double strokes = std::floor(t / (half_s + kStuck_s)), within = t - strokes * (half_s + kStuck_s);
          const double way = std::fmod(strokes, 2.0) == 0.0 ? 1.0 : -1.0, angle = rate * std::min(within, half_s);
          const double q = -3.0 * way * std::cos(angle), w = 3.0 * way * rate * std::sin(angle);
          const double passed = std::max(within - half_s, 0.0) / kStuck_s;
          e[Column::motor_position].push_back(q);
          e[Column::motor_torque].push_back(-1e-3 * rate * rate * q + 4e-3 * w + kDry_nm * way * (1.0 - 2.0 * passed) +
                                            noise(random));
        }));
  }
  return dataset;
}

using Experiments = std::vector<const data::Experiment*>;

bool resolves_presliding(const data::Dataset& dataset) {
  const auto fitted = estimation::identify(dataset, tests::plain_model(), {});
  const Experiments all = {&dataset.experiments[0], &dataset.experiments[1]};
  return make_tables(all, fitted->model.drive, fitted->terms, Balance::motor, kPolicy).presliding_is_resolved;
}

TEST(PreslidingLaw, HasATravelThatIsResolvedWhereItIsThereAndNoneWhereTheAxisOnlySticks) {
  EXPECT_TRUE(resolves_presliding(swinging()));
  EXPECT_FALSE(resolves_presliding(sticking()));
}

}  // namespace
}  // namespace flexspline::selection::selection_presliding_test
