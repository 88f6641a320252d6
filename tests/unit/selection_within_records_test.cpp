// What shows within records alone: against samples whose factor is known.
#include "host/engine/selection/within_records.hpp"

#include <gtest/gtest.h>

#include <cmath>
#include <random>

#include "host/engine/estimation/least_squares.hpp"

namespace flexspline::selection::selection_within_records_test {
namespace {

constexpr Eigen::Index kOfRecord = 400, kRecords = 3;

struct Samples {
  Eigen::VectorXd target;
  Eigen::MatrixXd base, extended;
  std::vector<estimation::RowRange> records;
};

// y = c_i x (1 + true_slope t) + noise, with a factor c_i of each record; the extended model has x (1 + slope t). `t`
// rises from -1 to 1 within a record, or is each record's own number.
Samples samples_of(double true_slope, double slope, bool within, unsigned seed) {
  std::mt19937 chance(seed);
  std::normal_distribution<double> normal;
  Samples s;
  const Eigen::Index n = kOfRecord * kRecords;
  s.target.resize(n);
  s.base.resize(n, 1);
  s.extended.resize(n, 1);
  for (Eigen::Index i = 0; i < kRecords; ++i) {
    s.records.push_back({static_cast<std::size_t>(i), i * kOfRecord, (i + 1) * kOfRecord});
    for (Eigen::Index k = 0; k < kOfRecord; ++k) {
      const Eigen::Index row = i * kOfRecord + k;
      const double x = normal(chance);
      const double t = within ? 2.0 * static_cast<double>(k) / kOfRecord - 1.0 : static_cast<double>(i);
      s.base(row, 0) = x;
      s.extended(row, 0) = x * (1.0 + slope * t);
      s.target[row] = (1.0 + 0.2 * static_cast<double>(i)) * x * (1.0 + true_slope * t) + 0.3 * normal(chance);
    }
  }
  return s;
}

WithinRecords compared(const Samples& s) {
  return compare_within_records(s.target, s.base, s.extended, s.records);
}

TEST(WithinRecords, WhatChangesWithinEachRecordSpeaksForTheEffectInEach) {
  const WithinRecords found = compared(samples_of(0.3, 0.3, true, 1));
  EXPECT_GT(found.deviance, 50.0);
  EXPECT_GT(found.least, 10.0);
}

TEST(WithinRecords, WhatDiffersBetweenRecordsAloneSaysNothing) {
  // Each record's own factor takes it up.
  const WithinRecords found = compared(samples_of(0.3, 0.3, false, 2));
  EXPECT_NEAR(found.deviance, 0.0, 1e-9);
}

TEST(WithinRecords, AnEffectThatIsNotThereIsContradictedByEachRecord) {
  const WithinRecords found = compared(samples_of(0.0, 0.3, true, 3));
  EXPECT_LT(found.deviance, -50.0);
  EXPECT_LT(found.least, -10.0);
}

TEST(WithinRecords, DevianceIsTheLogarithmOfTheSquaresRatioTimesTheSamplesThatCount) {
  // Of one record: n / tau ln(SSE / SSE'), with both sums by hand.
  const Samples s = samples_of(0.2, 0.2, true, 4);
  const auto left = [&](const Eigen::VectorXd& x) -> Eigen::VectorXd {
    const Eigen::VectorXd y = s.target.head(kOfRecord), own = x.head(kOfRecord);
    return y - own * (own.dot(y) / own.squaredNorm());
  };
  const Eigen::VectorXd before = left(s.base.col(0)), after = left(s.extended.col(0));
  const double tau = estimation::autocorrelation_time({{0, 0, kOfRecord}}, after);
  const WithinRecords found = compare_within_records(s.target, s.base, s.extended, {s.records.front()});
  EXPECT_NEAR(found.deviance, kOfRecord / tau * std::log(before.squaredNorm() / after.squaredNorm()), 1e-6);
  EXPECT_EQ(found.deviance, found.least);
}

}  // namespace
}  // namespace flexspline::selection::selection_within_records_test
