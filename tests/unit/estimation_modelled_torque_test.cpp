// Effects that read the torque through the gear, where no sensor measures it: weight and inertia that are written down.
#include <gtest/gtest.h>

#include <algorithm>
#include <cmath>
#include <random>

#include "host/engine/comparison/compare.hpp"
#include "host/engine/estimation/identify.hpp"
#include "host/engine/estimation/modelled_torque.hpp"
#include "host/engine/selection/add.hpp"
#include "shared/fixed/turn.hpp"
#include "tests/support/plain_model.hpp"
#include "tests/support/written_experiment.hpp"

namespace flexspline::estimation::estimation_modelled_torque_test {
namespace {

using data::Column;

constexpr double kRatio = 80.0, kInertia = 2e-4, kViscous = 2e-3, kDry = 0.04;
constexpr double kWeight_nm = 30.0, kLoadFriction = 0.15, kNoise_nm = 1e-3;

// An arm that a rigid gear swings about the lowest point: friction grows with what the gear carries.
data::Dataset swinging_arm() {
  std::mt19937_64 random(11);
  std::normal_distribution<double> noise(0.0, kNoise_nm);
  data::Dataset dataset;
  for (const double frequency_hz : {0.11, 0.19, 0.27}) {
    const double rate = kTurn * frequency_hz;
    dataset.experiments.push_back(
        tests::written_experiment("at " + std::to_string(frequency_hz), 2e-3, 8000, [&](double t, data::Experiment& e) {
          const double q = 130.0 * std::sin(rate * t), w = 130.0 * rate * std::cos(rate * t), a = -rate * rate * q;
          const double weight = kWeight_nm * std::sin(q / kRatio), carried = weight + kRatio * kInertia * a;
          const double sign = w > 0.0 ? 1.0 : -1.0;
          // Load friction is per torque at the output, over the ratio, as the catalogue has it.
          e[Column::motor_position].push_back(q);
          e[Column::motor_torque].push_back(kInertia * a + kViscous * w + kDry * sign + weight / kRatio +
                                            kLoadFriction * std::abs(carried) / kRatio * sign + noise(random));
        }));
  }
  dataset.experiments.back().role = data::Role::holdout;
  dataset.drive.gear_ratio = kRatio;
  return dataset;
}

// Of a unit coefficient, at one newton metre: the catalogue's own unit.
double torque_of_unit() {
  catalogue::DriveConstants<double> constants;
  constants.gear_ratio = kRatio;
  effects::Inputs<catalogue::Real> in;
  in.torque = in.torque_magnitude = in.direction = 1.0;
  const double one = 1.0;
  double torque = 0.0;
  catalogue::get("load_dependent_friction").real.torque(&one, constants, effects::Balance::motor, {&in, 1}, &torque);
  return torque;
}

TEST(ModelledTorque, FrictionThatGrowsWithTheLoadIsIdentifiedWithoutATorqueSensor) {
  const auto found = identify(swinging_arm(), tests::plain_model_with({"gravity", "load_dependent_friction"}), {});
  const auto value = [&](const char* effect, const char* parameter) {
    for (const Estimate& e : found->estimates)
      if (e.effect == effect && e.parameter == parameter) return e.value;
    return 0.0;
  };
  const double coefficient = kLoadFriction / kRatio / torque_of_unit();
  EXPECT_NEAR(value("load_dependent_friction", "coefficient"), coefficient, 0.03 * coefficient);
  EXPECT_NEAR(value("gravity", "sine"), kWeight_nm, 0.01 * kWeight_nm);
  EXPECT_NEAR(value("coulomb_friction", "torque"), kDry, 0.05 * kDry);
}

TEST(ModelledTorque, AddedLoadFrictionTakesTheErrorOnHeldOutDataToTheNoise) {
  const selection::Addition added =
      selection::add(swinging_arm(), tests::plain_model_with({"gravity"}), "load_dependent_friction", {});
  ASSERT_TRUE(added.before.rmse_holdout && added.after.rmse_holdout);
  EXPECT_GT(*added.before.rmse_holdout, 8.0 * *added.after.rmse_holdout);
  EXPECT_LT(*added.after.rmse_holdout, 1.5 * kNoise_nm);
  // `compare` has the same torque.
  const comparison::Comparison compared = comparison::compare(swinging_arm(), added.model, {}, {});
  ASSERT_FALSE(compared.overall.empty());
  EXPECT_LT(compared.overall.front().rmse, 1.5 * kNoise_nm);
}

TEST(ModelledTorque, SetTwiceIsSetOnce) {
  const auto found = identify(swinging_arm(), tests::plain_model_with({"gravity", "load_dependent_friction"}), {});
  PreparedData again = found->prepared;
  ASSERT_TRUE(take_torque_where_read(again, found->terms));
  PreparedData twice = again;
  ASSERT_TRUE(take_torque_where_read(twice, found->terms));
  EXPECT_EQ(again.records.front().inputs.torque, twice.records.front().inputs.torque);
  const std::vector<double>& torque = again.records.front().inputs.torque;
  EXPECT_NEAR(*std::max_element(torque.begin(), torque.end()), kWeight_nm, 0.05 * kWeight_nm);
}

TEST(ModelledTorque, IsNotMadeWithoutAWeightOrWhereNothingReadsIt) {
  const auto no_weight = identify(swinging_arm(), tests::plain_model_with({"load_dependent_friction"}), {});
  PreparedData prepared = no_weight->prepared;
  EXPECT_FALSE(take_torque_from_load(prepared, no_weight->terms));
  const auto no_reader = identify(swinging_arm(), tests::plain_model_with({"gravity"}), {});
  prepared = no_reader->prepared;
  EXPECT_FALSE(take_torque_where_read(prepared, no_reader->terms));
  EXPECT_TRUE(prepared.records.front().inputs.torque.empty());
}

}  // namespace
}  // namespace flexspline::estimation::estimation_modelled_torque_test
