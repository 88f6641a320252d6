// The samples of a regressor table at one bandwidth.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>

#include "host/engine/selection/filtered_table.hpp"
#include "host/engine/selection/setting.hpp"

namespace flexspline::selection::selection_filtered_table_test {
namespace {

constexpr double kRowS = 1e-3;
constexpr Eigen::Index kRows = 4000;

// A column of the model at 3 Hz, one of a term at 200 Hz, and a target of both; two records, the second one held out.
RegressorTable two_sines() {
  RegressorTable table;
  table.records = 2;
  table.held_out = {0, 1};
  table.highest_hz = 400.0;
  table.highest_law_hz = 400.0;
  table.model_columns = 1;
  table.model_low = {-effects::kUnbounded};
  const Eigen::ArrayXd t = Eigen::ArrayXd::LinSpaced(kRows, 0.0, kRowS * static_cast<double>(kRows - 1));
  table.columns.resize(kRows, 2);
  table.columns << (2.0 * std::numbers::pi * 3.0 * t).sin(), (2.0 * std::numbers::pi * 200.0 * t).sin();
  table.target = table.columns.rowwise().sum();
  table.scale = Eigen::Vector2d::Ones();
  CandidateTerm term;
  term.name = "term";
  term.columns = {1};
  table.terms = {term};
  table.runs = {{0, 0, kRows / 2, kRowS}, {1, kRows / 2, kRows, kRowS}};
  table.velocity_over_noise = Eigen::VectorXd::Constant(kRows, 100.0);
  return table;
}

TEST(FilteredTable, KeepsWhatIsBelowTheBandwidthAndTakesOffWhatIsAbove) {
  const RegressorTable table = two_sines();
  const RegressorTable low = filtered_table(table, all_columns(table), 25.0);
  // Four rows a period of 25 Hz; 1.5 periods, 60 ms, are left out at each end.
  ASSERT_EQ(low.runs.size(), 2U);
  EXPECT_DOUBLE_EQ(low.runs[0].row_s, 10.0 * kRowS);
  EXPECT_EQ(low.runs[0].last - low.runs[0].first, 188);
  EXPECT_EQ(low.target.size(), 2 * 188);
  // At the ends the filter guesses what lies beyond; far from them nothing of that is left.
  for (Eigen::Index k = 40; k < 148; ++k) {
    const double t = 0.06 + 0.01 * static_cast<double>(k);
    // A Butterworth filter of fifth order, both ways, leaves 1/(1 + (f/fc)^10).
    EXPECT_NEAR(low.columns(k, 0), std::sin(2.0 * std::numbers::pi * 3.0 * t), 1e-3);
    EXPECT_LT(std::abs(low.columns(k, 1)), 1e-6);
    EXPECT_NEAR(low.target[k], low.columns.row(k).sum(), 1e-9);
  }
}

TEST(FilteredTable, OfTheTablesOwnBandwidthHasItsSamples) {
  const RegressorTable table = two_sines();
  const RegressorTable same = filtered_table(table, all_columns(table), table.highest_hz);
  // 1.5 periods of 400 Hz are four samples.
  EXPECT_EQ(same.columns.topRows(100), table.columns.middleRows(4, 100));
}

TEST(FilteredTable, HasChosenColumnsAlone) {
  const RegressorTable table = two_sines();
  const RegressorTable small = filtered_table(table, choose_columns(table, {}), 25.0);
  EXPECT_EQ(small.columns.cols(), 1);
  EXPECT_TRUE(small.terms.empty());
}

TEST(FilteredTable, TakesOtherTargetsWithoutOtherColumns) {
  RegressorTable table = two_sines();
  RegressorTable filtered = filtered_table(table, all_columns(table), 25.0);
  const Eigen::MatrixXd before = filtered.columns;
  table.target *= 2.0;
  const Eigen::VectorXd once = filtered.target;
  filter_targets(table, filtered);
  EXPECT_LT((filtered.target - 2.0 * once).norm(), 1e-9 * once.norm());
  EXPECT_EQ(filtered.columns, before);
}

// A reversal at 1 s, and rest from 1.5 s to 1.7 s.
TEST(FilteredTable, TheMaskLeavesOutReversalsAndAlwaysRest) {
  RegressorTable table = two_sines();
  table.velocity_over_noise.segment(1000, 500).setConstant(-100.0);
  table.velocity_over_noise.segment(1500, 200).setConstant(1.0);
  const ChosenColumns all = all_columns(table);
  const RegressorTable low = filtered_table(table, all, 25.0);
  const SelectionPolicy policy;
  const Setting kept = make_setting(low, all, false, false, policy),
                masked = make_setting(low, all, true, false, policy);
  const auto seconds = [](const Setting& setting) { return 0.01 * static_cast<double>(setting.rows.rows()); };
  // Of 1.88 s, rest of 0.2 s with the filter's reach of 60 ms on both sides; then 60 ms on both sides of the reversal.
  EXPECT_NEAR(seconds(kept), 1.88 - 0.32, 0.02);
  EXPECT_NEAR(seconds(masked), 1.88 - 0.32 - 0.12, 0.03);
  EXPECT_EQ(make_setting(low, all, true, true, policy).runs.front().record, 1U);
}

// A period of 25 Hz is 40 ms.
TEST(FilteredTable, AStopOfAQuarterOfAPeriodIsRestAndAShorterOneIsNot) {
  RegressorTable table = two_sines();
  table.velocity_over_noise.segment(600, 12).setConstant(1.0);
  table.velocity_over_noise.segment(1300, 7).setConstant(1.0);
  const RegressorTable low = filtered_table(table, all_columns(table), 25.0);
  const auto state_at = [&](double s) { return low.states[static_cast<std::size_t>((s - 0.06) / 0.01)]; };
  EXPECT_EQ(state_at(0.605), SampleState::at_rest);
  EXPECT_EQ(state_at(0.65), SampleState::at_rest);
  EXPECT_EQ(state_at(1.305), SampleState::near_reversal);
}

}  // namespace
}  // namespace flexspline::selection::selection_filtered_table_test
