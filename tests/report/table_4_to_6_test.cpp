// Tables 4, 5 and 6: stiffness and structural damping from locked-load experiments, for several exponents of the
// torsion's rate, and with a cubic spring.
#include <gtest/gtest.h>

#include "hil/thesis_models/published.hpp"
#include "hil/thesis_models/published_tables.hpp"
#include "host/engine/comparison/compare.hpp"
#include "tests/report/rhs100_data.hpp"

namespace flexspline::tests::table_4_to_6_test {
namespace {

namespace published = report::published;

// What a wrong exponent gives depends on the filter, and that of the report is not known: at 20 Hz it comes out as
// printed. All else is found with the cut-offs that the tool chooses.
constexpr double kWrongExponentHz = 20.0;

estimation::PipelineOptions at_cutoff(std::optional<double> hz) {
  estimation::PipelineOptions options;
  options.cutoff_hz = hz;
  return options;
}

struct Rows {
  Column stiffness, cubic, damping, exponent, rmse;
};

Rows one_by_one(const data::Dataset& dataset, const model::Model& model, std::optional<double> cutoff_hz = {}) {
  Rows rows;
  for (const data::Experiment& e : dataset.experiments) {
    if (e.role != data::Role::fit) continue;
    const auto found = estimation::identify(only(dataset, e.name), model, at_cutoff(cutoff_hz));
    rows.stiffness.push_back(estimate(*found, "linear_stiffness", "stiffness").value);
    rows.damping.push_back(estimate(*found, "structural_damping", "torque").value);
    rows.rmse.push_back(found->fits.front().rmse());
    if (model.find("cubic_stiffness")) rows.cubic.push_back(estimate(*found, "cubic_stiffness", "stiffness").value);
    if (!model.find("structural_damping")->find("exponent")->fixed)
      rows.exponent.push_back(estimate(*found, "structural_damping", "exponent").value);
  }
  return rows;
}

Rows as_published(const std::array<published::ComplianceRow, 4>& table) {
  Rows rows;
  for (const published::ComplianceRow& r : table) {
    rows.stiffness.push_back(r.stiffness);
    rows.cubic.push_back(r.cubic);
    rows.damping.push_back(r.damping);
  }
  return rows;
}

model::Model with_exponent(const rhs100::Set& set, double exponent) {
  model::Model model = base_model(set);
  fix(model, "structural_damping", "exponent", exponent);
  return model;
}

model::Model with_free_exponent(const rhs100::Set& set) {
  model::Model model = base_model(set);
  model::Parameter* exponent = model.find("structural_damping")->find("exponent");
  exponent->value.reset();
  exponent->fixed = false;
  return model;
}

class Table4 : public ::testing::Test {
 protected:
  const rhs100::Set set = rhs100::table_4();
  const data::Dataset dataset = dataset_of(set);
};
using Table5 = Table4;

class Table6 : public ::testing::Test {
 protected:
  const rhs100::Set set = rhs100::table_6();
  const data::Dataset dataset = dataset_of(set);
};

TEST_F(Table4, SquareRootDampingGivesTheReportsRowsAndSpreads) {
  const Rows ours = one_by_one(dataset, with_exponent(set, 0.5)), theirs = as_published(published::kTable4);
  ASSERT_EQ(ours.stiffness.size(), 4u);
  EXPECT_LT(worst_percent(ours.stiffness, theirs.stiffness), 0.5);
  EXPECT_LT(worst_percent(ours.damping, theirs.damping), 0.5);
  EXPECT_NEAR(mean(ours.stiffness), 6.34e3, 0.01e3);
  EXPECT_NEAR(mean(ours.damping), 57.2, 0.2);
  // As printed, over n; over n - 1 they are 11.1 and 38.4.
  EXPECT_NEAR(spread_percent(ours.stiffness, true), 9.6, 0.2);
  EXPECT_NEAR(spread_percent(ours.damping, true), 33.0, 0.5);
}

// The data have an exponent of 1/2; that a fit with 1/3 gives what the report's did is no matter of course.
TEST_F(Table4, AThirdAsExponentGivesWhatTheReportsFitGave) {
  const Rows ours = one_by_one(dataset, with_exponent(set, 1.0 / 3.0), kWrongExponentHz),
             theirs = as_published(published::kTable4Third);
  EXPECT_LT(worst_percent(ours.stiffness, theirs.stiffness), 3.0);
  EXPECT_LT(worst_percent(ours.damping, theirs.damping), 13.0);
  EXPECT_NEAR(spread_percent(ours.stiffness, true), 9.5, 1.5);
  EXPECT_NEAR(spread_percent(ours.damping, true), 38.0, 3.0);
}

TEST_F(Table4, AHalfLeavesTheLeastErrorOfAllExponentsTried) {
  const Rows half = one_by_one(dataset, with_exponent(set, 0.5), kWrongExponentHz);
  for (const double exponent : {0.1, 1.0 / 3.0, 1.0}) {
    const Rows other = one_by_one(dataset, with_exponent(set, exponent), kWrongExponentHz);
    for (std::size_t k = 0; k < 4; ++k) EXPECT_GT(other.rmse[k], 5.0 * half.rmse[k]) << exponent << ", row " << k;
  }
}

// Section 4.2.2: the nominal values of either exponent on all eleven experiments.
TEST_F(Table4, AHalfHasTheSmallerWorstErrorInAlmostAllElevenExperiments) {
  const auto worst = [&](double exponent) {
    model::Model nominal = with_exponent(set, exponent);
    const Rows rows = one_by_one(dataset, nominal);
    fix(nominal, "linear_stiffness", "stiffness", mean(rows.stiffness));
    fix(nominal, "structural_damping", "torque", mean(rows.damping));
    Column gains;
    for (const auto& e : comparison::compare(dataset, nominal, {}).experiments)
      for (const auto& s : e.signals)
        if (s.signal == "transmission_balance") gains.push_back(s.h_infinity.value);
    return gains;
  };
  const Column half = worst(0.5), third = worst(1.0 / 3.0);
  ASSERT_EQ(half.size(), 11u);
  ASSERT_EQ(third.size(), 11u);
  int better = 0;
  for (std::size_t k = 0; k < 11; ++k) better += half[k] < third[k];
  EXPECT_GE(better, 9);
}

TEST_F(Table5, AFreeExponentComesOutAtAHalf) {
  const Rows ours = one_by_one(dataset, with_free_exponent(set));
  ASSERT_EQ(ours.exponent.size(), 4u);
  for (const double exponent : ours.exponent) EXPECT_NEAR(exponent, 0.5, 0.02);
  const Rows half = one_by_one(dataset, with_exponent(set, 0.5));
  for (std::size_t k = 0; k < 4; ++k) EXPECT_GT(ours.rmse[k], 0.9 * half.rmse[k]);
}

TEST_F(Table6, RowsAndSpreadsComeOutAsTheReports) {
  const Rows ours = one_by_one(dataset, base_model(set)), theirs = as_published(published::kTable6);
  EXPECT_LT(worst_percent(ours.stiffness, theirs.stiffness), 0.5);
  EXPECT_LT(worst_percent(ours.damping, theirs.damping), 0.5);
  for (std::size_t k = 0; k < 3; ++k) EXPECT_NEAR(ours.cubic[k] / theirs.cubic[k], 1.0, 0.02) << k;
  // Where the torsion is small a filter rounds the square root of its rate, and the cubic term takes part of that: 18 %
  // too large at 20 Hz averaged over seven seeds, 6 % at 120 Hz over six. One run has a standard error of 5 to 8 %.
  EXPECT_NEAR(ours.cubic[3] / theirs.cubic[3], 1.0, 0.2) << "50-7";
  // Over n, as printed.
  EXPECT_NEAR(spread_percent(ours.stiffness, true), 6.5, 0.3);
  EXPECT_NEAR(spread_percent(ours.cubic, true), 109.0, 8.0);
  EXPECT_NEAR(spread_percent(ours.damping, true), 33.3, 0.5);
}

TEST_F(Table6, TheCubicTermIsUnreliableWithASpreadAboveAHundredPercent) {
  const Rows ours = one_by_one(dataset, base_model(set));
  EXPECT_GT(spread_percent(ours.cubic), 100.0);
  EXPECT_LT(spread_percent(ours.stiffness), 30.0);
  // And all four experiments together do not even agree on its sign.
  const auto together = estimation::identify(dataset, base_model(set), {});
  EXPECT_LT(estimate(*together, "cubic_stiffness", "stiffness").value, 0.2 * mean(ours.cubic));
  // And the tool's own std/avg says so, with every experiment: over n - 1, where the report's 109 % are over n.
  const estimation::Estimate& cubic = estimate(*together, "cubic_stiffness", "stiffness");
  EXPECT_EQ(cubic.counted(), 4u);
  EXPECT_NEAR(cubic.spread_percent.value(), 109.0 * std::sqrt(4.0 / 3.0), 10.0);
  EXPECT_EQ(cubic.reliable, std::optional(false));
  EXPECT_EQ(estimate(*together, "linear_stiffness", "stiffness").reliable, std::optional(true));
}

// Figure 33: the average of the cubic models on the experiment with the largest torsion.
TEST_F(Table6, TheCubicModelOverpredictsAtLargeTorsionAndTheLinearOneDoesNot) {
  const auto prediction_over_measurement = [&](model::Model model) {
    const Rows rows = one_by_one(dataset, model);
    fix(model, "linear_stiffness", "stiffness", mean(rows.stiffness));
    fix(model, "structural_damping", "torque", mean(rows.damping));
    if (!rows.cubic.empty()) fix(model, "cubic_stiffness", "stiffness", mean(rows.cubic));
    const data::Dataset largest = only(dataset, "100-8");
    const estimation::PreparedData prepared = estimation::prepare({&largest.experiments.front()}, model, {});
    estimation::RegressionProblem balance(prepared, estimation::Balance::transmission);
    const Eigen::VectorXd rest = balance.residual(estimation::terms_of(model));
    Eigen::Index at = 0;
    const double measured = balance.target().cwiseAbs().maxCoeff(&at);
    return (balance.target()[at] - rest[at]) / std::copysign(measured, balance.target()[at]);
  };
  const double cubic = prediction_over_measurement(base_model(set));
  model::Model linear = base_model(set);
  std::erase_if(linear.effects, [](const model::Effect& e) { return e.type == "cubic_stiffness"; });
  const double straight = prediction_over_measurement(linear);
  EXPECT_GT(cubic, 1.2);
  EXPECT_NEAR(straight, 1.0, 0.2);
}

}  // namespace
}  // namespace flexspline::tests::table_4_to_6_test
