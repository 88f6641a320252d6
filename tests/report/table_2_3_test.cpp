// Tables 2 and 3: the bare motor with its inertia supplied, as no other torque sets a scale (eq. 61); friction by
// direction, and what figures 24 to 27 show of it.
#include <gtest/gtest.h>

#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"
#include "host/common/signals/butterworth.hpp"
#include "host/engine/comparison/compare.hpp"
#include "host/physics/simulation/simulation.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::tests::table_2_3_test {
namespace {

namespace published = report::published;

constexpr double kDataSheetConstant = 0.0543;  // of the base model

double torque_constant(const estimation::Identification& found) {
  return kDataSheetConstant * (1.0 + estimate(found, "torque_constant_error", "ratio").value);
}

// The report divides by the final decision, not by the average, and by n.
double over_final(const Column& rows, double final_value) {
  return spread_percent(rows, true) * std::abs(mean(rows)) / final_value;
}

// Instants at which the shaft, from rest or from the other direction, is first faster than 2 rad/s in this one.
Column break_aways(const std::vector<double>& raw, int direction) {
  const std::vector<double> velocity = signals::ZeroPhaseFilter(5, 40.0, 1e3).apply(raw);
  Column at;
  bool armed = true;
  for (std::size_t k = 0; k < velocity.size(); ++k) {
    const double along = direction * velocity[k];
    if (armed && along > 2.0) at.push_back(static_cast<double>(k) * 1e-3);
    armed = armed ? along <= 2.0 : along < -2.0;
  }
  return at;
}

model::Model with_means_of_the_runs(const estimation::Identification& found) {
  model::Model model = found.model;
  for (const estimation::Estimate& e : found.estimates) {
    Column own;
    for (const estimation::ExperimentValue& v : e.per_experiment)
      if (v.value) own.push_back(*v.value);
    if (!own.empty()) model.find(e.id)->find(e.parameter)->value = mean(own);
  }
  return model;
}

class MotorTables : public ::testing::Test {
 protected:
  const rhs100::Set fast_set = rhs100::table_3_fast();
  const data::Dataset fast = dataset_of(fast_set), slow = dataset_of(rhs100::table_3_slow());
  const model::Model by_direction = base_model(fast_set);

  model::Model symmetric() const {
    model::Model model = by_direction;
    std::erase_if(model.effects, [](const model::Effect& e) { return e.type.ends_with("asymmetry"); });
    return model;
  }
  double free_run_error(const data::Dataset& dataset, const model::Model& model) const {
    return comparison::compare(dataset, model, {}).find_overall("motor_velocity")->nrmse;
  }
};
using Table2 = MotorTables;
using Table3 = MotorTables;
using Figures24To27 = MotorTables;

TEST_F(Table2, TheInertiaSuppliedSetsTheScaleOfAllElse) {
  const auto found = estimation::identify(slow, by_direction, {});
  const report::DcMotor motor = published::identified_motor();
  EXPECT_NEAR(torque_constant(*found) / motor.torque_constant, 1.0, 0.02);
  EXPECT_NEAR(derived(*found, "Tsp") / motor.friction.positive.coulomb, 1.0, 0.02);
  EXPECT_NEAR(derived(*found, "Tsn") / motor.friction.negative.coulomb, 1.0, 0.02);
  // Another inertia scales torque constant and friction alike.
  model::Model heavier = by_direction;
  fix(heavier, "inertia", "inertia", 1.1 * motor.inertia);
  const auto scaled = estimation::identify(slow, heavier, {});
  EXPECT_NEAR(torque_constant(*scaled) / torque_constant(*found), 1.1, 0.001);
  EXPECT_NEAR(derived(*scaled, "Tsp") / derived(*found, "Tsp"), 1.1, 0.001);
}

TEST_F(Table2, WithoutItNothingSetsTheScaleAndTheTorqueConstantIsNotClaimed) {
  model::Model open = by_direction;
  model::Parameter* inertia = open.find("inertia")->find("inertia");
  inertia->fixed = false;
  inertia->value.reset();
  const auto found = estimation::identify(slow, open, {});
  // All parameters at zero, with a motor that makes no torque, would leave no error at all.
  EXPECT_FALSE(estimate(*found, "torque_constant_error", "ratio").identifiable);
  bool said = false;
  for (const std::string& w : found->warnings) said = said || w.find("torque_constant_error.ratio") == 0;
  EXPECT_TRUE(said);
}

TEST_F(Table3, RowsAndDeviationsComeOutAsPrinted) {
  Column constant, viscous_positive, viscous_negative, coulomb_positive, coulomb_negative;
  for (std::size_t k = 0; k < fast.experiments.size(); ++k) {
    const auto found = estimation::identify(only(fast, fast.experiments[k].name), by_direction, {});
    constant.push_back(torque_constant(*found));
    viscous_positive.push_back(derived(*found, "Tvp"));
    viscous_negative.push_back(derived(*found, "Tvn"));
    coulomb_positive.push_back(derived(*found, "Tsp"));
    coulomb_negative.push_back(derived(*found, "Tsn"));
    EXPECT_NEAR(constant.back() / fast_set.experiments[k].drive.torque_constant_nm_a, 1.0, 0.005);
    EXPECT_NEAR(coulomb_positive.back() / published::kTable3CoulombPositive[k], 1.0, 0.01);
  }
  const report::DcMotor last = published::identified_motor();
  EXPECT_NEAR(over_final(constant, last.torque_constant), 0.82, 0.1);
  EXPECT_NEAR(over_final(viscous_negative, last.friction.negative.viscous), 23.3, 4.0);
  EXPECT_NEAR(over_final(viscous_positive, last.friction.positive.viscous), 11.5, 2.0);
  EXPECT_NEAR(over_final(coulomb_negative, last.friction.negative.coulomb), 9.0, 0.5);
  EXPECT_NEAR(over_final(coulomb_positive, last.friction.positive.coulomb), 5.7, 0.3);
}

TEST_F(Table3, HarmonicDriveFrictionIsTheTotalLessTheMotors) {
  const auto motor = estimation::identify(slow, by_direction, {});
  const rhs100::Set drive_set = rhs100::table_7();
  const auto drive = estimation::identify(dataset_of(drive_set), base_model(drive_set), {});
  // Section 4.3: T_f = T_fm + T_f1 + T_f2, of which the parts of the drive cannot be distinguished.
  const report::DcMotor known = published::identified_motor();
  const auto rest = [&](const char* name) { return derived(*drive, name) - derived(*motor, name); };
  EXPECT_NEAR(rest("Tsp") / (published::kTable7Average.coulomb_positive - known.friction.positive.coulomb), 1.0, 0.1);
  EXPECT_NEAR(rest("Tsn") / (published::kTable7Average.coulomb_negative - known.friction.negative.coulomb), 1.0, 0.1);
  EXPECT_NEAR(rest("Tvp") / (published::kTable7Average.viscous_positive - known.friction.positive.viscous), 1.0, 0.2);
  EXPECT_NEAR(rest("Tvn") / (published::kTable7Average.viscous_negative - known.friction.negative.viscous), 1.0, 0.2);
}

TEST_F(Figures24To27, FrictionByDirectionMatchesSlowAndFastMotionWhereOneForBothDoesNot) {
  const auto slow_both = estimation::identify(slow, symmetric(), {});
  const auto slow_each = estimation::identify(slow, by_direction, {});
  EXPECT_GT(free_run_error(slow, slow_both->model), 0.2);   // figure 24
  EXPECT_LT(free_run_error(slow, slow_each->model), 0.03);  // figure 26
  const auto fast_both = estimation::identify(fast, symmetric(), {});
  const auto fast_each = estimation::identify(fast, by_direction, {});
  // "There is still little discrepancy observed for high velocity": its runs have parameters of their own. What one
  // model for all leaves is what the mean of the runs' own parameters leaves.
  const double left = free_run_error(fast, fast_each->model);
  EXPECT_GT(free_run_error(fast, fast_both->model), 0.25);  // figure 25
  EXPECT_LT(left, 0.2);                                     // figure 27
  EXPECT_LT(left, 1.1 * free_run_error(fast, with_means_of_the_runs(*fast_each)));
}

TEST_F(Figures24To27, BreakAwayDependsOnTheDirectionAndTheModelBreaksAwayWithTheShaft) {
  const auto both = estimation::identify(slow, symmetric(), {});
  const auto each = estimation::identify(slow, by_direction, {});
  const auto late_ms = [&](const model::Model& model, int direction) {
    Column late;
    for (const data::Experiment& e : slow.experiments) {
      const Column measured = break_aways(e[data::Column::motor_velocity], direction);
      const Column simulated = break_aways(simulation::run(model, e).motor_velocity, direction);
      EXPECT_EQ(measured.size(), simulated.size()) << e.name;
      for (std::size_t k = 1; k < std::min(measured.size(), simulated.size()); ++k)
        late.push_back(1e3 * (simulated[k] - measured[k]));
    }
    return mean(late);
  };
  EXPECT_NEAR(late_ms(each->model, 1), 0.0, 3.0);
  EXPECT_NEAR(late_ms(each->model, -1), 0.0, 3.0);
  // One friction for both breaks away early where the shaft is held more firmly, and late where less.
  EXPECT_NEAR(late_ms(both->model, 1), -25.0, 5.0);
  EXPECT_NEAR(late_ms(both->model, -1), 25.0, 5.0);
}

}  // namespace
}  // namespace flexspline::tests::table_2_3_test
