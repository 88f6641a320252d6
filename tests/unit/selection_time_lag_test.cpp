// The lag of the effort's time base, against the lag that was put in and its closed-form standard error.
#include <gtest/gtest.h>

#include <cmath>
#include <numbers>
#include <random>

#include "host/common/signals/butterworth.hpp"
#include "host/engine/selection/time_lag.hpp"

namespace flexspline::selection::selection_time_lag_test {
namespace {

constexpr double kSample_s = 4e-3;
constexpr double kRate = 2.0 * std::numbers::pi * 1.5;  // rad/s
constexpr Eigen::Index kRows = 4000;
constexpr double kAmplitude = 2.0;

// One record of a sine of 1.5 Hz in the model, and of 7 Hz as a term that may be added; both `lag_s` later in the
// target.
RegressorTable sines(double lag_s, double noise, unsigned seed) {
  std::mt19937_64 chance(seed);
  std::normal_distribution<double> normal(0.0, 1.0);
  RegressorTable table;
  table.records = 1;
  table.held_out = {0};
  table.highest_hz = table.highest_law_hz = 30.0;
  table.model_columns = 1;
  table.model_low = {-1.0};
  table.runs = {{0, 0, kRows, kSample_s}};
  table.columns.resize(kRows, 2);
  table.target.resize(kRows);
  table.velocity_over_noise = Eigen::VectorXd::Constant(kRows, 100.0);
  for (Eigen::Index k = 0; k < kRows; ++k) {
    const double t = kSample_s * static_cast<double>(k);
    table.columns(k, 0) = std::sin(kRate * t);
    table.columns(k, 1) = std::sin(4.7 * kRate * t);
    table.target[k] =
        kAmplitude * std::sin(kRate * (t - lag_s)) + 0.5 * std::sin(4.7 * kRate * (t - lag_s)) + noise * normal(chance);
  }
  // A table's samples are at its highest bandwidth, noise included.
  const signals::ZeroPhaseFilter filter(signals::ZeroPhaseFilter::kDefaultOrder, table.highest_hz, 1.0 / kSample_s);
  Eigen::MatrixXd rows(kRows, 3);
  rows << table.columns, table.target;
  filter.apply_columns_in_place(rows);
  table.columns = rows.leftCols(2);
  table.target = rows.col(2);
  CandidateTerm term;
  term.name = "wave";
  term.columns = {1};
  table.terms = {term};
  return table;
}

TEST(TimeLag, IsTheOneThatWasPutInWithinItsStandardError) {
  for (const double lag_s : {-9e-3, -1e-3, 0.0, 2.5e-3, 7e-3}) {
    const auto lag = estimate_time_lag(sines(lag_s, 0.1, 1), {0}, LagRange::longest, {});
    ASSERT_TRUE(lag) << lag_s;
    EXPECT_NEAR(lag->lag_s, lag_s, 4.0 * lag->std_s + 2e-5) << lag_s;
  }
}

TEST(TimeLag, StandardErrorIsThatOverManyNoises) {
  double sum = 0.0, squares = 0.0, stated = 0.0;
  constexpr unsigned kRuns = 60;
  for (unsigned seed = 0; seed < kRuns; ++seed) {
    const auto lag = estimate_time_lag(sines(3e-3, 0.3, 100 + seed), {0}, LagRange::longest, {});
    ASSERT_TRUE(lag);
    sum += lag->lag_s;
    squares += lag->lag_s * lag->lag_s;
    stated += lag->std_s / kRuns;
  }
  const double std = std::sqrt(squares / kRuns - sum * sum / kRuns / kRuns);
  // Of 60 runs a standard deviation is known within 9 %.
  EXPECT_NEAR(stated / std, 1.0, 0.35);
}

TEST(TimeLag, TakenOffItLeavesNone) {
  RegressorTable table = sines(6e-3, 0.02, 2);
  const auto before = estimate_time_lag(table, {0}, LagRange::longest, {});
  ASSERT_TRUE(before);
  EXPECT_GT(before->reduction_share, 0.9);
  correct_time_lag(table, before->lag_s);
  const auto after = estimate_time_lag(table, {0}, LagRange::longest, {});
  ASSERT_TRUE(after);
  EXPECT_NEAR(after->lag_s, 0.0, 1e-4);
}

// Four rows are 16 ms.
TEST(TimeLag, LongerThanUsualIsFoundUpToTheLongestOfAnAmplifier) {
  for (const double lag_s : {-22e-3, 21e-3}) {
    const auto lag = estimate_time_lag(sines(lag_s, 0.1, 4), {0}, LagRange::longest, {});
    ASSERT_TRUE(lag) << lag_s;
    EXPECT_NEAR(lag->lag_s, lag_s, 4.0 * lag->std_s + 1e-4) << lag_s;
    EXPECT_FALSE(estimate_time_lag(sines(lag_s, 0.1, 4), {0}, LagRange::usual, {}));
  }
}

TEST(TimeLag, BeyondTheSearchedRangeIsNotStated) {
  EXPECT_FALSE(estimate_time_lag(sines(30e-3, 0.1, 3), {0}, LagRange::longest, {}));
}

}  // namespace
}  // namespace flexspline::selection::selection_time_lag_test
