// Table 8: the amplitudes of the Stribeck term at low speed, each experiment fitted alone with the averages of table 7.
#include <gtest/gtest.h>

#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"
#include "host/engine/estimation/estimate.hpp"
#include "host/engine/selection/diagnosis.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::tests::table_8_test {
namespace {

namespace published = report::published;

struct Rows {
  Column positive, negative;
  std::size_t within = 0;  // amplitudes whose 95 % interval holds the row's
};

Rows as_published() {
  Rows rows;
  for (const published::StribeckRow& r : published::kTable8) {
    rows.positive.push_back(r.positive);
    rows.negative.push_back(r.negative);
  }
  return rows;
}

Rows one_by_one(const data::Dataset& dataset, const model::Model& model) {
  const Rows truth = as_published();
  Rows rows;
  for (std::size_t k = 0; k < dataset.experiments.size(); ++k) {
    const auto found = estimation::estimate(only(dataset, dataset.experiments[k].name), model, {});
    const auto take = [&](const char* name, double true_value) {
      const estimation::Estimate& e = estimate(*found, "stribeck_gaussian", name);
      rows.within += e.low && *e.low <= true_value && true_value <= *e.high;
      return e.value;
    };
    rows.positive.push_back(take("amplitude_positive", truth.positive[k]));
    rows.negative.push_back(take("amplitude_negative", truth.negative[k]));
  }
  return rows;
}

class Table8 : public ::testing::Test {
 protected:
  const rhs100::Set set = rhs100::table_8();
  const data::Dataset dataset = dataset_of(set);
  const model::Model base = base_model(set);
};

TEST(Table8Rows, ThePrintedFourteenPercentAreTwentySix) {
  const Rows rows = as_published();
  EXPECT_NEAR(spread_percent(rows.positive), 26.1, 0.1);  // printed: 14.7
  EXPECT_NEAR(spread_percent(rows.negative), 23.6, 0.1);  // printed: 23.8
  EXPECT_NEAR(mean(rows.positive), -7.74e-3, 0.01e-3);    // printed: -7.61e-3
  EXPECT_NEAR(mean(rows.negative), -1.97e-2, 0.01e-2);    // printed: -2.03e-2
}

TEST_F(Table8, SpreadsComeOutAsTheReportsRowsGive) {
  const Rows ours = one_by_one(dataset, base);
  EXPECT_NEAR(spread_percent(ours.positive), 26.1, 3.0);
  EXPECT_NEAR(spread_percent(ours.negative), 23.6, 1.5);
  EXPECT_NEAR(mean(ours.positive), -7.74e-3, 0.3e-3);
  EXPECT_NEAR(mean(ours.negative), -1.97e-2, 0.03e-2);
}

// By the tool's own std/avg, over the whole set in one identification: no run is blanked by the pooled error.
TEST_F(Table8, AllTogetherTheSpreadIsThatOfTheRows) {
  const auto found = estimation::identify(dataset, base, {});  // with the cut-off that the tool chooses
  const estimation::Estimate& positive = estimate(*found, "stribeck_gaussian", "amplitude_positive");
  const estimation::Estimate& negative = estimate(*found, "stribeck_gaussian", "amplitude_negative");
  EXPECT_EQ(positive.per_experiment.size(), 15u);
  EXPECT_GE(positive.counted(), 13u);
  EXPECT_EQ(negative.counted(), 15u);
  EXPECT_NEAR(positive.spread_percent.value(), 26.1, 3.0);
  EXPECT_NEAR(negative.spread_percent.value(), 23.6, 1.5);
  for (const estimation::ExperimentValue& v : positive.per_experiment)
    EXPECT_NE(v.value.has_value(), !v.left_out.empty());
}

// With the cut-offs that the tool chooses: the friction that rises within 0.1 rad/s is over in some tens of
// milliseconds of each stroke, and the bulk of the motion alone would suggest 6 Hz.
TEST_F(Table8, EveryRowComesBack) {
  const Rows ours = one_by_one(dataset, base), theirs = as_published();
  EXPECT_LT(worst_percent(ours.negative, theirs.negative), 5.0);
  EXPECT_GE(ours.within, 28u) << "of 30 amplitudes have a 95 % interval that holds the row's";
  for (std::size_t k = 0; k < ours.positive.size(); ++k)
    EXPECT_NEAR(ours.positive[k], theirs.positive[k], 1e-3) << published::kTable8[k].experiment;
}

TEST_F(Table8, FrictionThatRisesAtLowSpeedIsAcceptedAndNamedSo) {
  // Both amplitudes are negative in every row, and none is held at zero.
  const Rows ours = one_by_one(dataset, base);
  for (const double amplitude : ours.positive) EXPECT_LT(amplitude, 0.0);
  for (const double amplitude : ours.negative) EXPECT_LT(amplitude, 0.0);
  EXPECT_NE(catalogue::get("stribeck_gaussian").info->causes.find("rises out of standstill"), std::string_view::npos);

  // Not known beforehand, it is what the tool names.
  model::Model without = base;
  std::erase_if(without.effects, [](const model::Effect& e) { return e.type == "stribeck_gaussian"; });
  const selection::Diagnosis found = selection::diagnose(dataset, without, {});
  ASSERT_EQ(found.verdict, selection::Verdict::missing_effect);
  ASSERT_EQ(found.named.size(), 1u);
  EXPECT_EQ(found.named.front().effect, "stribeck_gaussian");
  const selection::Candidate& named = found.candidates.front();
  EXPECT_EQ(named.effect, "stribeck_gaussian");
  EXPECT_NE(named.note.find("rises out of standstill"), std::string::npos) << named.note;
  for (const estimation::Estimate& e : named.parameters) {
    if (e.parameter == "velocity")
      EXPECT_NEAR(e.value, published::kTable8Velocity, 0.02);
    else
      EXPECT_LT(e.value, 0.0) << e.parameter;
  }
}

}  // namespace
}  // namespace flexspline::tests::table_8_test
