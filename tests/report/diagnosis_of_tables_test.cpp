// What is named where the report's tables are one drive: each run has a stiffness of its own, so that the transmission
// has the largest error, and friction at speed is sublinear between the runs of table 7.
#include <gtest/gtest.h>

#include "host/engine/selection/diagnosis.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::tests::diagnosis_of_tables_test {
namespace {

using estimation::Balance;

model::Model of_both(const rhs100::Set& a, const rhs100::Set& b) {
  model::Model model = base_model(a);
  for (model::Effect& e : base_model(b).effects) model.effects.push_back(std::move(e));
  return model;
}

TEST(DiagnosisOfTables, FrictionBetweenRecordsIsLookedAtWhicheverBalanceHasTheLargestError) {
  const rhs100::Set at_speed = rhs100::table_7(), locked = rhs100::table_4();
  data::Dataset dataset = dataset_of(at_speed);
  for (data::Experiment& e : dataset_of(locked).experiments) dataset.experiments.push_back(std::move(e));
  const selection::Diagnosis d = selection::diagnose(dataset, of_both(at_speed, locked), {});
  ASSERT_EQ(d.named.size(), 1u);
  EXPECT_EQ(d.named.front().effect, "power_law_friction");
  ASSERT_TRUE(d.between_records);
  EXPECT_EQ(d.balance, Balance::motor);
  EXPECT_TRUE(d.partial);
  // Errors of the motor's balance, not of the one that had the largest: they are of another size.
  EXPECT_LT(d.base_rmse, 0.1);
  EXPECT_FALSE(d.friction_drift.empty());
}

}  // namespace
}  // namespace flexspline::tests::diagnosis_of_tables_test
